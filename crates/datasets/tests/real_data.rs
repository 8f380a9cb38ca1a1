//! The readers on the real data sets. Runs where `DOSE3_DATA` names the folder that holds them.

#![allow(clippy::print_stderr)] // says what was measured, and that it was not run

use std::path::PathBuf;

use dose3_datasets::faults::{Control, Fault, Injection};
use dose3_datasets::{
    Format, Frame, Kind, LoadOptions, RateSource, Representation, Scaling, Trajectory,
    leave_one_out, load, load_all, windows,
};
use dose3_lie::Matrix;

fn data(part: &str) -> Option<PathBuf> {
    match std::env::var_os("DOSE3_DATA") {
        Some(root) => Some(PathBuf::from(root).join(part)),
        None => {
            eprintln!("not run: DOSE3_DATA is not set, no real data to read");
            None
        }
    }
}

fn check(trajectories: &[Trajectory]) {
    for log in trajectories {
        assert!(
            log.stamps.windows(2).all(|pair| pair[0] < pair[1]),
            "{}",
            log.name
        );
        for pose in &log.poses {
            let r = pose.rotation.matrix();
            let error = (r.tr_mul(r) - Matrix::identity()).amax();
            assert!(error < 1e-12, "{}: not orthogonal by {error:e}", log.name);
            assert!((r.determinant() - 1.0).abs() < 1e-12);
        }
    }
    let cut = windows(trajectories, 129, 64);
    let motion =
        Representation::fit(Kind::Motion, Scaling::PerDataset, trajectories, &cut).unwrap();
    for representation in [Representation::PAPER, motion] {
        for window in &cut {
            let tensor = representation
                .represent_window(window, trajectories)
                .unwrap();
            assert_eq!(tensor.translation.len(), 3 * tensor.length);
            assert!(
                tensor
                    .translation
                    .iter()
                    .chain(&tensor.rotation)
                    .all(|value| value.is_finite())
            );
        }
    }
    eprintln!(
        "{:?}: {} logs, {:?}",
        trajectories[0].format,
        trajectories.len(),
        motion.scaling
    );
}

#[test]
fn kitti() {
    let Some(root) = data("kitti/poses") else {
        return;
    };
    let logs = load_all(&[root], &LoadOptions::default()).unwrap();
    let names: Vec<&str> = logs.iter().map(|log| log.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "00", "01", "02", "03", "04", "05", "06", "07", "08", "09", "10"
        ]
    );
    assert_eq!(logs.iter().map(Trajectory::len).sum::<usize>(), 23_201);
    assert_eq!(logs[0].len(), 4541);
    for log in &logs {
        assert_eq!((log.format, log.frame), (Format::Kitti, Frame::CameraRdf));
        assert_eq!(
            (log.rate.hertz, log.rate.source),
            (10.0, RateSource::Nominal)
        );
        assert!(log.report.is_clean(), "{:?}", log.report);
    }
    check(&logs);
}

#[test]
fn kitti_with_its_times() {
    let Some(root) = data("") else { return };
    let times = Some(root.join("formats/kitti_00_times.txt"));
    let options = LoadOptions {
        times,
        ..LoadOptions::default()
    };
    let log = load(&root.join("kitti/poses/00.txt"), &options).unwrap();
    assert_eq!(log.stamps[1], 103_735_900);
    assert_eq!(log.rate.source, RateSource::Stamps);
    assert!((log.rate.hertz - 9.65).abs() < 0.02, "{}", log.rate);
    let wrong = load(&root.join("kitti/poses/01.txt"), &options)
        .unwrap_err()
        .to_string();
    assert!(
        wrong.contains("kitti_00_times.txt: expected 1101 stamps") && wrong.contains("found 4541")
    );
}

#[test]
fn robotcar() {
    let Some(root) = data("robotcar") else { return };
    let logs = load_all(&[root], &LoadOptions::default()).unwrap();
    let lengths: Vec<(&str, usize)> = logs
        .iter()
        .map(|log| (log.name.as_str(), log.len()))
        .collect();
    assert_eq!(
        lengths,
        [
            ("2019-01-11-14-02-26", 37_666),
            ("2019-01-14-12-05-52", 38_624),
            ("2019-01-14-14-48-55", 39_188),
            ("2019-01-15-13-06-37", 36_109),
        ]
    );
    for log in &logs {
        assert_eq!((log.format, log.frame), (Format::RobotCar, Frame::BodyFrd));
        assert!((log.rate.hertz - 20.0).abs() < 0.2, "{}", log.rate);
        assert!(
            log.report.is_clean() && log.report.gaps == 0,
            "{:?}",
            log.report
        );
        // About nine kilometres of Oxford, driven forward: the body's x axis is the direction of travel.
        assert!(
            (8_000.0..11_000.0).contains(&log.distance()),
            "{}",
            log.distance()
        );
        let forward: f64 = log
            .poses
            .windows(2)
            .map(|pair| {
                (pair[0].rotation.inverse() * (pair[1].translation - pair[0].translation)).x
            })
            .sum();
        assert!(forward > 0.97 * log.distance(), "{forward}");
    }
    check(&logs);
}

#[test]
fn iros20() {
    let Some(root) = data("iros20") else { return };
    let logs = load_all(&[root], &LoadOptions::default()).unwrap();
    assert_eq!(logs.len(), 42);
    assert_eq!(logs.iter().map(Trajectory::len).sum::<usize>(), 73_756);
    for log in &logs {
        assert_eq!((log.format, log.frame), (Format::Iros20, Frame::Object));
        assert!(log.report.is_clean(), "{:?}", log.report);
        assert!(log.report.largest_rotation_error < 5e-6);
    }
    for a in &logs {
        for b in &logs {
            assert_eq!(
                a.group == b.group,
                a.len() == b.len(),
                "{} {}",
                a.name,
                b.name
            );
        }
    }
    let folds = leave_one_out(&logs).unwrap();
    eprintln!("iros20: {} groups of equal length", folds.len());
    assert!(folds.len() < 42);
    check(&logs);
}

#[test]
fn faults() {
    let Some(root) = data("") else { return };
    for part in [
        "kitti/poses/00.txt",
        "robotcar/2019-01-11-14-02-26",
        "iros20/traj_11.npy",
    ] {
        let sound = load(&root.join(part), &LoadOptions::default()).unwrap();
        let range = sound.len() / 3..2 * sound.len() / 3;
        let step = |log: &Trajectory, pose: usize| log.poses[pose - 1].relative(&log.poses[pose]);
        for (_, _, fault) in Fault::suite() {
            let Injection {
                trajectory: faulty,
                affected,
            } = fault.inject(&sound, range.clone(), 1).unwrap();
            assert_eq!(faulty.poses[..range.start], sound.poses[..range.start]);
            // Both logs counted from their ends.
            for back in 1..faulty.len() - affected.end {
                let (a, b) = (
                    step(&faulty, faulty.len() - back),
                    step(&sound, sound.len() - back),
                );
                let error = (a.matrix() - b.matrix()).amax();
                assert!(error < 1e-8, "{fault} in {part}: {error:e}");
            }
            for pose in &faulty.poses {
                let r = pose.rotation.matrix();
                let error = (r.tr_mul(r) - Matrix::identity()).amax();
                assert!(error < 1e-12 && pose.is_finite(), "{fault} in {part}");
            }
        }
        for control in Control::ALL {
            let changed = control.apply(&sound, 1).unwrap();
            let ratio = changed.distance() / sound.distance();
            eprintln!("{control} of {part}: {ratio:.5} of the path");
            // IROS20's steps are mostly noise of the tracker, which interpolation averages out.
            let least = if part.starts_with("iros20") {
                0.5
            } else {
                0.99
            };
            assert!(
                (least..1.0001).contains(&ratio),
                "{control} of {part}: {ratio}"
            );
        }
    }
}

#[test]
fn tum_and_euroc() {
    let Some(root) = data("formats") else { return };
    let files = [
        "euroc_V102_groundtruth.csv",
        "tum_freiburg1_xyz_groundtruth.txt",
    ];
    let files = files.map(|file| root.join(file));
    let logs = load_all(&files, &LoadOptions::default()).unwrap();
    let found: Vec<_> = logs
        .iter()
        .map(|log| (log.format, log.len(), log.report.gaps))
        .collect();
    assert_eq!(found, [(Format::Euroc, 16_702, 0), (Format::Tum, 3_000, 0)]);
    let [euroc, tum] = &logs[..] else {
        panic!("{}", logs.len())
    };
    assert_eq!(euroc.stamps[0], 1_403_715_524_907_143_168);
    assert_eq!(tum.stamps[0], 1_305_031_098_665_900_000);
    assert!((tum.rate.hertz - 100.0).abs() < 0.1 && (euroc.rate.hertz - 200.0).abs() < 0.1);
    check(&logs[..1]);
    check(&logs[1..]);
}

/// Self-made files with the defects of real ones: all but those whose stamps are lost are read, and to the motion
/// that they were made from.
#[test]
fn field() {
    let Some(root) = data("field") else { return };
    let mut files: Vec<PathBuf> = std::fs::read_dir(root)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_none_or(|end| end != "sh"))
        .collect();
    files.sort();
    for file in files {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        let result = load(&file, &LoadOptions::default());
        if ["b01", "b02", "b03"]
            .iter()
            .any(|lost| name.starts_with(lost))
        {
            assert!(
                result.unwrap_err().to_string().contains("say the rate"),
                "{name}"
            );
            continue;
        }
        let log = result.unwrap();
        check(std::slice::from_ref(&log));
        // The gap of an hour, the index as a stamp: the others are all at 10 Hz and 8 m/s.
        if name.starts_with("a07") || name.starts_with("b17") {
            continue;
        }
        assert_eq!((log.rate.hertz * 100.0).round(), 1000.0, "{name}");
        let steps = log.len() - 1 - log.breaks.len() + log.report.missing_frames;
        let per_step = log.distance() / steps as f64;
        let expected = if name.starts_with("a06") {
            1.28..1.29
        } else {
            0.75..0.81
        };
        assert!(expected.contains(&per_step), "{name}: {per_step}");
    }
}

/// The same 300 odometry messages in every container and packing, and the transforms of a robot.
#[test]
fn bags() {
    let Some(root) = data("bags") else { return };
    let mut prints = std::collections::HashSet::new();
    for entry in std::fs::read_dir(&root).unwrap() {
        let path = entry.unwrap().path();
        if path
            .file_name()
            .unwrap()
            .to_string_lossy()
            .starts_with("tf_")
        {
            let tf = Some(("odom".to_owned(), "base_link".to_owned()));
            let options = LoadOptions {
                tf,
                ..LoadOptions::default()
            };
            let log = load(&path, &options).unwrap();
            check(std::slice::from_ref(&log));
            assert_eq!(log.frame, Frame::BodyFlu);
            assert!((log.rate.hertz - 10.0).abs() < 0.5, "{}", log.rate);
            continue;
        }
        let log = load(&path, &LoadOptions::default()).unwrap();
        assert_eq!((log.len(), log.rate.hertz), (300, 10.0), "{path:?}");
        assert!((log.distance() - 299.0).abs() < 1e-9);
        prints.insert(log.fingerprint());
    }
    assert_eq!(prints.len(), 1);
    let Some(formats) = data("formats") else {
        return;
    };
    let path = formats.join("ros2_nav2_turtlebot.mcap");
    let found = dose3_datasets::contents(&path, &LoadOptions::default());
    let found = found.unwrap().unwrap();
    let counts: Vec<_> = found
        .topics
        .iter()
        .map(|topic| (topic.name.as_str(), topic.messages))
        .collect();
    assert_eq!(
        counts[..2],
        [("/amcl_pose", Some(135)), ("/odom", Some(2639))]
    );
    let options = LoadOptions {
        topics: vec!["/odom".to_owned()],
        ..LoadOptions::default()
    };
    let odom = load(&path, &options).unwrap();
    let tf = Some(("odom".to_owned(), "base_link".to_owned()));
    let options = LoadOptions {
        tf,
        ..LoadOptions::default()
    };
    let transforms = load(&path, &options).unwrap();
    // The robot publishes its odometry both ways.
    let mut same = 0;
    for (stamp, pose) in odom.stamps.iter().zip(&odom.poses) {
        if let Ok(at) = transforms.stamps.binary_search(stamp) {
            let off = transforms.poses[at].translation - pose.translation;
            assert!(off.norm() < 1e-6, "{stamp}: {off}");
            same += 1;
        }
    }
    assert!(same > 1000, "{same}");
}
