//! What is written is read back; what is damaged at random never panics and never gives NaN.

mod common;
#[path = "../../ood/src/property_cases.rs"]
mod property_cases;

use std::fs;

use dose3_datasets::{Format, Frame, LoadOptions, Trajectory, detect, load, write};
use dose3_lie::{Pose, Vector, so3};
use property_cases::cases;
use proptest::prelude::*;

/// Logs with any rotation, coordinates up to UTM size, and steps of 1 ms to 100 ms.
fn logs() -> impl Strategy<Value = Trajectory> {
    let pose = (
        prop::array::uniform3(-6.0..6.0_f64),
        prop::array::uniform3(-6e6..6e6_f64),
    );
    let step = 1_000..100_000_i64;
    (
        0..2_000_000_000_i64,
        prop::collection::vec((step, pose), 2..40),
    )
        .prop_map(|(second, rows)| {
            let mut stamp = second * 1_000_000_000;
            let mut stamps = Vec::new();
            let mut poses = Vec::new();
            for (step, (tangent, translation)) in rows {
                // Whole microseconds, as RobotCar stores them.
                stamp += step * 1_000;
                stamps.push(stamp);
                poses.push(Pose {
                    rotation: so3::exp(&Vector::from(tangent)),
                    translation: Vector::from(translation),
                });
            }
            Trajectory::new("log", Format::Tum, Frame::Sensor, stamps, poses)
        })
}

/// Writes, checks that the format is recognised, reads.
fn through(
    format: Format,
    file: &str,
    write: impl FnOnce(&mut fs::File) -> std::io::Result<()>,
) -> Trajectory {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(file);
    write(&mut fs::File::create(&path).unwrap()).unwrap();
    assert_eq!(detect(&path).unwrap(), format);
    let log = load(&path, &LoadOptions::default()).unwrap();
    assert_eq!(log.format, format);
    assert!(log.report.is_clean(), "{:?}", log.report);
    log
}

/// Largest difference of rotations (radians) and translations (metres).
fn difference(a: &[Pose], b: &[Pose]) -> (f64, f64) {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold((0.0, 0.0), |(angle, metres), (a, b)| {
        let turn = so3::distance(&a.rotation, &b.rotation);
        (
            turn.max(angle),
            (a.translation - b.translation).amax().max(metres),
        )
    })
}

proptest! {
    #![proptest_config(cases(48))]

    #[test]
    fn kitti(log in logs()) {
        let back = through(Format::Kitti, "00.txt", |sink| write::kitti(sink, &log));
        let (angle, metres) = difference(&log.poses, &back.poses);
        prop_assert!(angle < 1e-14 && metres == 0.0, "{angle:e} {metres:e}");
    }

    #[test]
    fn kitti_with_times(log in logs()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("00.txt");
        write::kitti(&mut fs::File::create(&path).unwrap(), &log).unwrap();
        write::kitti_times(&mut fs::File::create(folder.path().join("00_times.txt")).unwrap(), &log).unwrap();
        let back = load(&path, &LoadOptions::default()).unwrap();
        let since_first: Vec<i64> = log.stamps.iter().map(|stamp| stamp - log.stamps[0]).collect();
        prop_assert_eq!(back.stamps, since_first);
    }

    #[test]
    fn tum(log in logs()) {
        let back = through(Format::Tum, "a.txt", |sink| write::tum(sink, &log));
        let (angle, metres) = difference(&log.poses, &back.poses);
        prop_assert!(angle < 1e-14 && metres == 0.0, "{angle:e} {metres:e}");
        prop_assert_eq!(&back.stamps, &log.stamps);
        prop_assert_eq!(back.rate, log.rate);
    }

    #[test]
    fn euroc(log in logs()) {
        let back = through(Format::Euroc, "data.csv", |sink| write::euroc(sink, &log));
        let (angle, metres) = difference(&log.poses, &back.poses);
        prop_assert!(angle < 1e-14 && metres == 0.0, "{angle:e} {metres:e}");
        prop_assert_eq!(back.stamps, log.stamps);
    }

    #[test]
    fn robotcar_ins(log in logs()) {
        let back = through(Format::RobotCar, "ins.csv", |sink| write::robotcar_ins(sink, &log));
        let (angle, metres) = difference(&log.poses, &back.poses);
        prop_assert!(angle < 1e-13 && metres == 0.0, "{angle:e} {metres:e}");
        prop_assert_eq!(back.stamps, log.stamps);
    }

    #[test]
    fn robotcar_vo(log in logs()) {
        let origin = log.poses[0].inverse();
        let relative: Vec<Pose> = log.poses.iter().map(|pose| origin.compose(pose)).collect();
        let back = through(Format::RobotCar, "vo.csv", |sink| write::robotcar_vo(sink, &log));
        let (angle, metres) = difference(&relative, &back.poses);
        // Steps of thousands of kilometres, chained: an angle of 1e-12 there is 1e-5 m.
        prop_assert!(angle < 1e-12 && metres < 1e-5, "{angle:e} {metres:e}");
        prop_assert_eq!(back.stamps, log.stamps);
    }

    #[test]
    fn iros20(log in logs()) {
        let back = through(Format::Iros20, "a.npy", |sink| write::iros20(sink, &log, write::Precision::Double));
        let (angle, metres) = difference(&log.poses, &back.poses);
        prop_assert!(angle < 1e-14 && metres == 0.0, "{angle:e} {metres:e}");
        let back = through(Format::Iros20, "a.npy", |sink| write::iros20(sink, &log, write::Precision::Single));
        let (angle, metres) = difference(&log.poses, &back.poses);
        prop_assert!(angle < 1e-6 && metres <= 0.25, "{angle:e} {metres:e}");
    }

    #[test]
    fn iros20_poses(log in logs()) {
        let folder = tempfile::tempdir().unwrap();
        write::iros20_poses(folder.path(), &log).unwrap();
        prop_assert_eq!(detect(folder.path()).unwrap(), Format::Iros20Poses);
        let back = load(folder.path(), &LoadOptions::default()).unwrap();
        let (angle, metres) = difference(&log.poses, &back.poses);
        prop_assert!(angle < 1e-14 && metres == 0.0, "{angle:e} {metres:e}");
    }
}

/// Replaces, removes or inserts bytes at random places.
fn damage(bytes: &[u8], edits: &[(usize, u8, u8)]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for (place, kind, value) in edits {
        let at = place % bytes.len().max(1);
        match kind % 4 {
            0 if !bytes.is_empty() => bytes[at] = *value,
            1 if !bytes.is_empty() => {
                bytes.remove(at);
            }
            2 => bytes.insert(at, *value),
            _ => bytes.truncate(at.max(bytes.len() / 2)),
        }
    }
    bytes
}

fn never_panics(bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log");
    fs::write(&path, bytes).unwrap();
    let forced = Format::ALL.into_iter().map(Some);
    for format in std::iter::once(None).chain(forced) {
        let options = LoadOptions {
            format,
            ..LoadOptions::default()
        };
        match load(&path, &options) {
            Ok(log) => {
                assert!(log.len() >= 2 && log.stamps.len() == log.len());
                assert!(log.stamps.windows(2).all(|pair| pair[0] < pair[1]));
                assert!(log.rate.hertz.is_finite() && log.rate.hertz > 0.0);
                for pose in &log.poses {
                    let values = pose.translation.iter().chain(pose.rotation.matrix().iter());
                    assert!(values.into_iter().all(|value| value.is_finite()));
                    let r = pose.rotation.matrix();
                    assert!((r.tr_mul(r) - dose3_lie::Matrix::identity()).amax() < 1e-12);
                }
            }
            Err(error) => assert!(error.to_string().len() < 1000, "{error}"),
        }
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn random_bytes(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        never_panics(&bytes);
    }

    #[test]
    fn random_text(text in "[-+0-9.eE, \\r\\n#a-z\u{feff}]{0,400}") {
        never_panics(text.as_bytes());
    }

    #[test]
    fn random_npy_headers(text in "[-0-9(),:' {}a-zL<>|]{0,80}", body in prop::collection::vec(any::<u8>(), 0..300)) {
        let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({text}), }}");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(body);
        never_panics(&bytes);
    }

    #[test]
    fn damaged_files(
        which in 0..10_usize,
        edits in prop::collection::vec((any::<usize>(), any::<u8>(), any::<u8>()), 1..6),
    ) {
        let bytes = match which {
            0 => common::kitti(4).into_bytes(),
            1 => common::tum(4).into_bytes(),
            2 => common::euroc(4).into_bytes(),
            3 => common::ins(4).into_bytes(),
            4 => common::vo(4).into_bytes(),
            5 => common::tum(4).replace(' ', ";").into_bytes(),
            6 => b"VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\nVERTEX_SE2 2 1 0 0\n".to_vec(),
            7 => b"0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 1 2\n1 0 0 1\n0 1 0 0\n0 0 1 0\n0 0 0 1\n".to_vec(),
            8 => br#"{"frames": [{"transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}, {"transform_matrix": [[1,0,0,1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}"#.to_vec(),
            _ => common::npy(4),
        };
        never_panics(&damage(&bytes, &edits));
    }
}

/// Our small reader and writer of `.npy` against an independent implementation.
#[test]
fn npy_agrees_with_npyz() {
    use npyz::WriterBuilder;

    let log = common::drive(5);
    let mut ours = Vec::new();
    write::iros20(&mut ours, &log, write::Precision::Double).unwrap();
    let mut rest = ours.as_slice();
    let mut stacked = Vec::new();
    for pose in &log.poses {
        let array = npyz::NpyFile::new(&mut rest).unwrap();
        assert_eq!(array.shape(), [4, 4]);
        let values: Vec<f64> = array.into_vec().unwrap();
        let expected = pose.matrix().transpose();
        assert_eq!(values, expected.as_slice());
        stacked.extend(values);
    }
    assert!(rest.is_empty());

    // One array of all poses, in either order and byte order.
    for (order, dtype) in [
        (npyz::Order::C, "<f8"),
        (npyz::Order::Fortran, "<f8"),
        (npyz::Order::C, ">f8"),
    ] {
        let mut theirs = Vec::new();
        let mut writer = npyz::WriteOptions::new()
            .dtype(npyz::DType::Plain(dtype.parse().unwrap()))
            .shape(&[5, 4, 4])
            .order(order)
            .writer(&mut theirs)
            .begin_nd()
            .unwrap();
        let index = |flat: usize| match order {
            npyz::Order::C => flat,
            // Fortran order: the first index runs fastest.
            npyz::Order::Fortran => (flat % 5) * 16 + (flat / 5 % 4) * 4 + flat / 20,
        };
        writer
            .extend((0..80).map(|flat| stacked[index(flat)]))
            .unwrap();
        writer.finish().unwrap();
        let back = through(Format::Npy, "a.npy", |sink| {
            std::io::Write::write_all(sink, &theirs)
        });
        assert!(
            difference(&log.poses, &back.poses).0 < 1e-14,
            "{order:?} {dtype}"
        );
    }
}
