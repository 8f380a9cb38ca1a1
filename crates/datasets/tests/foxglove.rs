//! Poses and transforms of Foxglove in MCAP, written here byte by byte, as protobuf and as JSON.

#[path = "recording/foxglove.rs"]
mod foxglove;
#[path = "recording/writers.rs"]
#[allow(dead_code)] // also writes bags
mod writers;

use dose3_datasets::{Error, LoadOptions, RemarkKind, Trajectory, load_bytes};
use foxglove::Encoding;
use writers::{Channel, Message};

const POSES: usize = 30;
const ENCODINGS: [Encoding; 2] = [Encoding::Protobuf, Encoding::Json];

fn pose(index: usize) -> ([f64; 3], [f64; 4]) {
    let half: f64 = 0.01 * index as f64;
    let position = [0.8 * index as f64, 0.1, -0.2];
    (position, [0.0, 0.0, half.sin(), half.cos()])
}

fn stamp(index: usize) -> i64 {
    1_600_000_000_000_000_000 + index as i64 * 100_000_000
}

fn channel(id: u32, topic: &str, kind: &str) -> Channel {
    Channel {
        id,
        topic: topic.to_owned(),
        kind: kind.to_owned(),
    }
}

/// A message recorded half a second after its stamp.
fn message(channel: u32, index: usize, content: Vec<u8>) -> Message {
    Message {
        channel,
        time: stamp(index) + 500_000_000,
        content,
    }
}

fn read(bytes: &[u8], tf: Option<(&str, &str)>) -> Result<Trajectory, Error> {
    let options = LoadOptions {
        tf: tf.map(|(parent, child)| (parent.to_owned(), child.to_owned())),
        ..LoadOptions::default()
    };
    load_bytes("drive.mcap", bytes, &options)
}

#[track_caller]
fn check(log: &Trajectory, shift: [f64; 3]) {
    assert_eq!(log.len(), POSES, "{:?}", log.report);
    for index in 0..POSES {
        let (p, _) = pose(index);
        let found = &log.poses[index];
        let off = found.translation - dose3_lie::Vector::from(p) - dose3_lie::Vector::from(shift);
        assert!(off.norm() < 1e-9, "{index}: {off}");
        let turned = dose3_lie::Rotation::from_euler_angles(0.0, 0.0, 0.02 * index as f64);
        assert!((found.rotation.matrix() - turned.matrix()).amax() < 1e-12);
        assert_eq!(log.stamps[index], stamp(index));
    }
}

#[test]
fn poses_in_a_frame_are_read_in_both_encodings() {
    let channels = [channel(1, "/pose", "foxglove.PoseInFrame")];
    for encoding in ENCODINGS {
        for compression in ["", "lz4", "zstd"] {
            let all: Vec<Message> = (0..POSES)
                .map(|index| {
                    let (p, q) = pose(index);
                    message(1, index, encoding.pose(stamp(index), "odom", p, q))
                })
                .collect();
            let bytes = writers::mcap_of(encoding.name(), &channels, &all, compression, 7, true);
            let log = read(&bytes, None).unwrap();
            check(&log, [0.0; 3]);
            let mut remarks = log.report.remarks.iter();
            assert!(remarks.any(|remark| remark.text.contains("in `odom`")));
        }
    }
}

#[test]
fn transforms_are_chained_one_or_many_a_message_and_a_single_one_holds() {
    for encoding in ENCODINGS {
        for many in [false, true] {
            let kind = if many {
                "foxglove.FrameTransforms"
            } else {
                "foxglove.FrameTransform"
            };
            let channels = [channel(1, "/tf", kind)];
            let mut all = Vec::new();
            for index in 0..POSES {
                let (p, q) = pose(index);
                let still = [0.0, 0.0, 0.0, 1.0];
                let mut parts = vec![encoding.transform(stamp(index), "odom", "base_link", p, q)];
                if index == 3 {
                    // Once, for good.
                    parts.push(encoding.transform(
                        stamp(index),
                        "map",
                        "odom",
                        [100.0, 0.0, 2.0],
                        still,
                    ));
                }
                if many {
                    all.push(message(1, index, encoding.transforms(&parts)));
                } else {
                    all.extend(parts.into_iter().map(|part| message(1, index, part)));
                }
            }
            let bytes = writers::mcap_of(encoding.name(), &channels, &all, "", 5, true);
            check(
                &read(&bytes, Some(("odom", "base_link"))).unwrap(),
                [0.0; 3],
            );
            check(
                &read(&bytes, Some(("map", "base_link"))).unwrap(),
                [100.0, 0.0, 2.0],
            );
            let error = read(&bytes, None).unwrap_err().to_string();
            assert!(error.contains("name the two frames"), "{error}");
        }
    }
}

#[test]
fn a_pose_without_an_orientation_or_of_nan_is_lost_and_a_damaged_message_is_named() {
    let channels = [channel(1, "/pose", "foxglove.PoseInFrame")];
    for encoding in ENCODINGS {
        let with = |at: usize, content: Vec<u8>| {
            let mut all: Vec<Message> = (0..POSES)
                .map(|index| {
                    let (p, q) = pose(index);
                    message(1, index, encoding.pose(stamp(index), "odom", p, q))
                })
                .collect();
            all[at].content = content;
            read(
                &writers::mcap_of(encoding.name(), &channels, &all, "", 5, true),
                None,
            )
        };
        for (p, q) in [
            ([1.0, 2.0, 3.0], [0.0; 4]),
            ([f64::NAN; 3], [0.0, 0.0, 0.0, 1.0]),
        ] {
            let log = with(9, encoding.pose(stamp(9), "odom", p, q)).unwrap();
            assert_eq!((log.len(), log.report.lost.len()), (POSES - 1, 1));
            assert_eq!(log.report.lost[0].first_row, 9);
        }
        let whole = encoding.pose(stamp(9), "odom", pose(9).0, pose(9).1);
        let error = with(9, whole[..whole.len() - 3].to_vec())
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("message 9") && error.contains("foxglove.PoseInFrame"),
            "{error}"
        );
        // A time that no clock has.
        let never = encoding.pose(i64::MAX, "odom", pose(9).0, pose(9).1);
        assert!(with(9, never).is_err());
    }
}

#[test]
fn lists_of_poses_are_refused_and_bodies_known_by_the_name_of_their_frame() {
    let channels = [channel(1, "/particles", "foxglove.PosesInFrame")];
    let all = [message(1, 0, Vec::new()), message(1, 1, Vec::new())];
    let bytes = writers::mcap_of("protobuf", &channels, &all, "", 5, true);
    let error = read(&bytes, None).unwrap_err().to_string();
    assert!(error.contains("no one body"), "{error}");
    let channels = [channel(1, "/tf", "foxglove.FrameTransform")];
    let all: Vec<Message> = (0..POSES)
        .map(|index| {
            let (p, q) = pose(index);
            message(
                1,
                index,
                Encoding::Json.transform(stamp(index), "odom", "base_link", p, q),
            )
        })
        .collect();
    let bytes = writers::mcap_of("json", &channels, &all, "", 5, true);
    let log = read(&bytes, Some(("odom", "base_link"))).unwrap();
    assert_eq!(log.frame, dose3_datasets::Frame::BodyFlu);
    let mut remarks = log.report.remarks.iter();
    assert!(remarks.any(|remark| remark.kind == RemarkKind::Frame));
}
