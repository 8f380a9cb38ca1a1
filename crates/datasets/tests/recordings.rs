//! Recordings of ROS, written here byte by byte: what is in them comes out, whatever the container, the packing and
//! the damage.

#[path = "recording/writers.rs"]
mod writers;

use std::fs;

use dose3_datasets::{
    Error, Format, Frame, LoadOptions, ReadOption, RemarkKind, RowKind, Trajectory, contents,
    detect, load, load_all, load_bytes, survey,
};
use writers::{Channel, Message, Ros, bag, mcap, rosbag2};

const POSES: usize = 30;

/// A turn, 10 Hz: stamps in the headers, half a second before the time of recording.
fn pose(index: usize) -> ([f64; 3], [f64; 4]) {
    let half: f64 = 0.01 * index as f64;
    (
        [0.8 * index as f64, 0.1, -0.2],
        [0.0, 0.0, half.sin(), half.cos()],
    )
}

fn stamp(index: usize) -> i64 {
    1_600_000_000_000_000_000 + index as i64 * 100_000_000
}

fn messages(channel: u32, content: impl Fn(usize) -> Vec<u8>) -> Vec<Message> {
    (0..POSES)
        .map(|index| Message {
            channel,
            time: stamp(index) + 500_000_000,
            content: content(index),
        })
        .collect()
}

fn channel(id: u32, topic: &str, kind: &str) -> Channel {
    Channel {
        id,
        topic: topic.to_owned(),
        kind: kind.to_owned(),
    }
}

/// Odometry, pictures that are not to be touched, and a static transform.
fn drive(ros: Ros) -> (Vec<Channel>, Vec<Message>) {
    let channels = vec![
        channel(1, "/camera", "sensor_msgs/Image"),
        channel(2, "/odom", "nav_msgs/Odometry"),
    ];
    let mut all = Vec::new();
    let odometry = messages(2, |index| {
        let mut writer = ros.message();
        let (p, q) = pose(index);
        writer
            .header(stamp(index), "odom")
            .text("base_link")
            .numbers(&p)
            .numbers(&q)
            .numbers(&[0.0; 36 + 6 + 36]);
        writer.done()
    });
    for message in odometry {
        all.push(Message {
            channel: 1,
            time: message.time,
            content: vec![7; 3000],
        });
        all.push(message);
    }
    (channels, all)
}

#[track_caller]
fn check(log: &Trajectory, kept: std::ops::Range<usize>) {
    assert_eq!(log.len(), kept.len(), "{:?}", log.report);
    for (at, index) in kept.enumerate() {
        let (p, _) = pose(index);
        assert_eq!(log.poses[at].translation.as_slice(), p);
        let off = log.poses[at].rotation.matrix()
            - dose3_lie::Rotation::from_euler_angles(0.0, 0.0, 0.02 * index as f64).matrix();
        assert!(off.amax() < 1e-12);
        assert_eq!(log.stamps[at], stamp(index));
    }
}

fn read(bytes: &[u8], options: &LoadOptions) -> Result<Trajectory, Error> {
    load_bytes("drive.rec", bytes, options)
}

#[test]
fn every_container_gives_the_same_poses() {
    let (channels, all) = drive(Ros::Two);
    let (channels_1, all_1) = drive(Ros::One);
    for (bytes, format) in [
        (mcap(Ros::Two, &channels, &all, "", 7, true), Format::Mcap),
        (
            mcap(Ros::Two, &channels, &all, "lz4", 7, true),
            Format::Mcap,
        ),
        (
            mcap(Ros::One, &channels_1, &all_1, "lz4", 100, true),
            Format::Mcap,
        ),
        (
            mcap(Ros::Two, &channels, &all, "lz4", 7, false),
            Format::Mcap,
        ),
        (mcap(Ros::Two, &channels, &all, "", 0, false), Format::Mcap),
        (mcap(Ros::Two, &channels, &all, "", 0, true), Format::Mcap),
        (bag(&channels_1, &all_1, "none", 8, true), Format::Bag),
        (bag(&channels_1, &all_1, "lz4", 8, true), Format::Bag),
        (bag(&channels_1, &all_1, "bz2", 8, true), Format::Bag),
        (bag(&channels_1, &all_1, "none", 8, false), Format::Bag),
        (rosbag2(&channels, &all), Format::Rosbag2),
    ] {
        let log = read(&bytes, &LoadOptions::default()).unwrap();
        check(&log, 0..POSES);
        assert_eq!((log.format, log.frame), (format, Frame::BodyFlu));
        assert_eq!((log.row_kind, log.rows[3]), (RowKind::Message, 3));
        // From a file the same, without reading it whole.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.rec");
        fs::write(&path, &bytes).unwrap();
        assert_eq!(detect(&path).unwrap(), format);
        assert_eq!(
            load(&path, &LoadOptions::default()).unwrap().fingerprint(),
            log.fingerprint()
        );
        let found = contents(&path, &LoadOptions::default()).unwrap().unwrap();
        let odom = found
            .topics
            .iter()
            .find(|topic| topic.name == "/odom")
            .unwrap();
        assert_eq!(
            (odom.messages, odom.poses, odom.child_frame.as_deref()),
            (Some(30), true, Some("base_link"))
        );
        assert!((odom.hertz.unwrap() - 10.0).abs() < 1e-9);
        let camera = found
            .topics
            .iter()
            .find(|topic| topic.name == "/camera")
            .unwrap();
        assert_eq!((camera.messages, camera.poses), (Some(30), false));
        // The time of recording, on request.
        let options = LoadOptions {
            record_time: true,
            ..LoadOptions::default()
        };
        assert_eq!(
            read(&bytes, &options).unwrap().stamps[0],
            stamp(0) + 500_000_000
        );
    }
}

#[test]
fn what_was_whole_is_recovered_from_a_recording_that_breaks_off() {
    let (channels, all) = drive(Ros::Two);
    let (channels_1, all_1) = drive(Ros::One);
    for bytes in [
        mcap(Ros::Two, &channels, &all, "", 6, true),
        mcap(Ros::Two, &channels, &all, "lz4", 6, true),
        mcap(Ros::Two, &channels, &all, "", 0, false),
        bag(&channels_1, &all_1, "none", 6, true),
        bag(&channels_1, &all_1, "lz4", 6, true),
    ] {
        let log = read(&bytes[..bytes.len() / 2], &LoadOptions::default()).unwrap();
        assert!(log.len() > 5 && log.len() < POSES, "{}", log.len());
        check(&log, 0..log.len());
        assert!(
            log.report
                .remarks
                .iter()
                .any(|remark| remark.kind == RemarkKind::DamagedRecording)
        );
    }
}

#[test]
fn folders_of_several_files_are_one_recording() {
    let (channels, all) = drive(Ros::Two);
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    fs::create_dir(&bag).unwrap();
    let (first, second) = all.split_at(20);
    fs::write(bag.join("bag_0.db3"), rosbag2(&channels, first)).unwrap();
    fs::write(
        bag.join("bag_1.mcap"),
        mcap(Ros::Two, &channels, second, "lz4", 5, true),
    )
    .unwrap();
    let metadata = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - bag_0.db3\n    - bag_1.mcap\n  duration:\n    nanoseconds: 1\n";
    fs::write(bag.join("metadata.yaml"), metadata).unwrap();
    let log = load(&bag, &LoadOptions::default()).unwrap();
    check(&log, 0..POSES);
    assert_eq!((log.name.as_str(), log.format), ("bag", Format::Rosbag2));
    let found = survey(folder.path(), &LoadOptions::default()).unwrap();
    assert_eq!((found.logs, found.ignored.len()), (vec![bag.clone()], 0));
    // Files elsewhere are none of it.
    fs::write(folder.path().join("other.db3"), "").unwrap();
    let other = folder.path().join("other.db3").display().to_string();
    for name in ["../other.db3", "/dev/zero", "sub/../../other.db3", &other] {
        fs::write(
            bag.join("metadata.yaml"),
            metadata.replace("bag_0.db3", name),
        )
        .unwrap();
        let refused = load(&bag, &LoadOptions::default()).unwrap_err().to_string();
        assert!(
            refused.contains("in the folder of the recording"),
            "{refused}"
        );
    }
    fs::write(
        bag.join("metadata.yaml"),
        metadata.replace("bag_0", "./bag_0"),
    )
    .unwrap();
    assert!(load(&bag, &LoadOptions::default()).is_ok());
    fs::remove_file(bag.join("bag_1.mcap")).unwrap();
    assert!(
        load(&bag, &LoadOptions::default())
            .unwrap_err()
            .to_string()
            .contains("bag_1.mcap")
    );
}

#[test]
fn topics_are_chosen_or_listed() {
    let (mut channels, mut all) = drive(Ros::Two);
    channels.push(channel(
        3,
        "/amcl",
        "geometry_msgs/PoseWithCovarianceStamped",
    ));
    channels.push(channel(4, "/gps", "geometry_msgs/PointStamped"));
    channels.push(channel(5, "/plan", "nav_msgs/Path"));
    channels.push(channel(6, "/bare", "geometry_msgs/Pose"));
    channels.push(channel(7, "/many", "geometry_msgs/PoseArray"));
    let two = Ros::Two;
    all.extend(messages(3, |index| {
        let (p, q) = pose(index);
        let mut writer = two.message();
        writer
            .header(stamp(index), "map")
            .numbers(&p)
            .numbers(&q)
            .numbers(&[0.0; 36]);
        writer.done()
    }));
    all.extend(messages(6, |index| {
        let (p, q) = pose(index);
        let mut writer = two.message();
        writer.numbers(&p).numbers(&q);
        writer.done()
    }));
    // Each path is longer than the one before; the last has all poses.
    all.extend((1..=POSES).map(|length| {
        let mut writer = two.message();
        writer.header(stamp(length), "map").u32(length as u32);
        for index in 0..length {
            let (p, q) = pose(index);
            writer.header(stamp(index), "map").numbers(&p).numbers(&q);
        }
        Message {
            channel: 5,
            time: stamp(length),
            content: writer.done(),
        }
    }));
    let bytes = mcap(two, &channels, &all, "lz4", 9, true);
    let error = read(&bytes, &LoadOptions::default()).unwrap_err();
    assert_eq!(error.read_option(), Some(ReadOption::Topic));
    assert!(
        error
            .to_string()
            .contains("/odom (nav_msgs/Odometry), /amcl"),
        "{error}"
    );
    let topic = |name: &str| LoadOptions {
        topics: vec![name.to_owned()],
        ..LoadOptions::default()
    };
    for name in ["/odom", "amcl", "/plan"] {
        check(&read(&bytes, &topic(name)).unwrap(), 0..POSES);
    }
    let bare = read(&bytes, &topic("/bare")).unwrap();
    assert_eq!(
        (bare.len(), bare.stamps[0]),
        (POSES, stamp(0) + 500_000_000)
    );
    for (name, reason) in [
        ("/gps", "without an orientation"),
        ("/many", "no one body"),
        ("/camera", "no poses"),
        ("/none", "the topic /none"),
    ] {
        let error = read(&bytes, &topic(name)).unwrap_err().to_string();
        assert!(error.contains(reason), "{error}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("day.mcap");
    fs::write(&path, &bytes).unwrap();
    let options = LoadOptions {
        topics: vec!["/odom".to_owned(), "/amcl".to_owned()],
        ..LoadOptions::default()
    };
    let logs = load_all(&[path], &options).unwrap();
    let names: Vec<&str> = logs.iter().map(|log| log.name.as_str()).collect();
    assert_eq!(names, ["day:/odom", "day:/amcl"]);
}

#[test]
fn transforms_are_chained_without_ros() {
    for ros in [Ros::One, Ros::Two] {
        let channels = vec![
            channel(1, "/tf", "tf2_msgs/TFMessage"),
            channel(2, "/tf_static", "tf2_msgs/TFMessage"),
        ];
        let transform = |parent: &str, child: &str, stamp: i64, p: [f64; 3], q: [f64; 4]| {
            let mut writer = ros.message();
            writer
                .u32(1)
                .header(stamp, parent)
                .text(child)
                .numbers(&p)
                .numbers(&q);
            writer.done()
        };
        let mut all: Vec<Message> = vec![Message {
            channel: 2,
            time: stamp(0),
            content: transform(
                "base_link",
                "lidar",
                0,
                [0.0, 0.0, 1.0],
                [0.0, 0.0, 0.0, 1.0],
            ),
        }];
        for index in 0..POSES {
            let (p, q) = pose(index);
            all.push(Message {
                channel: 1,
                time: stamp(index),
                content: transform("odom", "base_link", stamp(index), p, q),
            });
            if index % 5 == 0 || index == POSES - 1 {
                all.push(Message {
                    channel: 1,
                    time: stamp(index),
                    content: transform(
                        "map",
                        "odom",
                        stamp(index),
                        [100.0, 0.0, 0.0],
                        [0.0, 0.0, 0.0, 1.0],
                    ),
                });
            }
        }
        let bytes = match ros {
            Ros::One => bag(&channels, &all, "lz4", 8, true),
            Ros::Two => mcap(Ros::Two, &channels, &all, "", 8, true),
        };
        let error = read(&bytes, &LoadOptions::default()).unwrap_err();
        assert_eq!(error.read_option(), Some(ReadOption::Tf), "{error}");
        let tf = |a: &str, b: &str| LoadOptions {
            tf: Some((a.to_owned(), b.to_owned())),
            ..LoadOptions::default()
        };
        check(&read(&bytes, &tf("odom", "base_link")).unwrap(), 0..POSES);
        let log = read(&bytes, &tf("map", "lidar")).unwrap();
        assert_eq!(log.len(), POSES);
        for (index, found) in log.poses.iter().enumerate() {
            let (p, _) = pose(index);
            let off = found.translation - dose3_lie::Vector::new(p[0] + 100.0, p[1], p[2] + 1.0);
            assert!(off.norm() < 1e-9, "{index}: {off}");
        }
        let error = read(&bytes, &tf("map", "gripper")).unwrap_err().to_string();
        assert!(
            error.contains("no frame `gripper`; there are base_link, lidar, map, odom"),
            "{error}"
        );
    }
}

#[test]
fn damaged_recordings_never_panic() {
    use rand::{RngExt, SeedableRng};
    let (channels, all) = drive(Ros::Two);
    let (channels_1, all_1) = drive(Ros::One);
    let whole = [
        mcap(Ros::Two, &channels, &all[..12], "", 5, true),
        mcap(Ros::Two, &channels, &all[..12], "lz4", 5, true),
        bag(&channels_1, &all_1[..12], "none", 5, true),
        bag(&channels_1, &all_1[..12], "bz2", 5, true),
        rosbag2(&channels, &all[..12]),
    ];
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    for bytes in whole {
        for _ in 0..400 {
            let mut damaged = bytes.clone();
            for _ in 0..rng.random_range(1..4) {
                // Most damage near the front and the end, where the structure is.
                let reach = if rng.random() {
                    damaged.len()
                } else {
                    600.min(damaged.len())
                };
                let mut at = rng.random_range(0..reach);
                if rng.random() {
                    at = damaged.len() - 1 - at;
                }
                damaged[at] = if rng.random() { rng.random() } else { 0xff };
            }
            if rng.random() {
                damaged.truncate(rng.random_range(0..bytes.len()));
            }
            if let Ok(log) = read(&damaged, &LoadOptions::default()) {
                assert!(log.len() >= 2 && log.stamps.windows(2).all(|pair| pair[0] < pair[1]));
            }
        }
    }
}
