//! Logs at the edges of what logs are: judged or refused in words, never with a number that is none.

use dose3::nalgebra::Vector3;
use dose3::stream::StreamOptions;
use dose3::{Detector, Error, Frame, Pose, Report, Trajectory};
use dose3_datasets::synthetic::{Platform, suite, trajectory};
use dose3_datasets::{LoadOptions, load_bytes};
use std::sync::OnceLock;

fn detector() -> &'static Detector {
    static DETECTOR: OnceLock<Detector> = OnceLock::new();
    DETECTOR.get_or_init(|| Detector::fit(&suite(Platform::Vehicle, 8, 1)).unwrap())
}

fn drive() -> Trajectory {
    trajectory(Platform::Vehicle, 40, 1600, 20.0)
}

/// Judged as a whole and pose by pose; every number of the report is one.
fn judged(detector: &Detector, log: &Trajectory) -> Result<Report, Error> {
    let mut stream = detector.stream(log.frame, &StreamOptions::default())?;
    for (stamp, pose) in log.stamps.iter().zip(&log.poses) {
        let said = serde_json::to_string(stream.push(*stamp, *pose)?).unwrap();
        assert!(!said.contains("null,\"p_value"), "{said}");
    }
    let report = detector.judge(log)?;
    // What is no number is null in JSON and does not come back.
    let json = serde_json::to_string(&report).unwrap();
    let mut back: Report = serde_json::from_str(&json).unwrap();
    back.poses.scores.clone_from(&report.poses.scores);
    assert_eq!(back, report, "{}", log.name);
    let finite = |x: f64| x.is_finite();
    assert!(report.windows.iter().all(|w| finite(w.score.value())));
    assert!((0.0..=1.0).contains(&report.evidence.p_value));
    Ok(report)
}

fn from(name: &str, stamps: Vec<i64>, poses: Vec<Pose>) -> Trajectory {
    Trajectory::from_poses(name, Frame::BodyFlu, stamps, poses).unwrap()
}

fn with_positions(
    log: &Trajectory,
    position: impl Fn(usize, Vector3<f64>) -> Vector3<f64>,
) -> Trajectory {
    let mut other = log.clone();
    for (i, pose) in other.poses.iter_mut().enumerate() {
        pose.translation = position(i, pose.translation);
    }
    other
}

#[test]
fn one_pose_or_a_few_are_too_short() {
    for poses in 1..=30 {
        let rows = (0..poses).map(|i| format!("{}.05 {i} 0 0 0 0 0 1\n", i));
        let text: String = rows.collect();
        let Ok(log) = load_bytes("short", text.as_bytes(), &LoadOptions::default()) else {
            continue;
        };
        let mut log = log;
        log.frame = Frame::BodyFlu;
        assert!(detector().judge(&log).is_err(), "{poses} poses");
    }
    let two = drive().cut(0..2);
    let refused = judged(detector(), &two).unwrap_err().to_string();
    assert!(
        refused.contains("short") || refused.contains("poses"),
        "{refused}"
    );
}

#[test]
fn a_body_that_never_moves_is_judged() {
    let log = drive();
    let still = from("still", log.stamps.clone(), vec![log.poses[700]; log.len()]);
    assert!(judged(detector(), &still).unwrap().is_ood());
    // Trusted logs that never move are a reason, not a crash.
    let all = [0, 1, 2].map(|i| {
        from(
            &format!("still {i}"),
            log.stamps.clone(),
            vec![log.poses[i]; 1600],
        )
    });
    match Detector::fit(&all) {
        Ok(detector) => {
            assert!(judged(&detector, &still).is_ok_and(|report| !report.is_ood()));
            assert!(judged(&detector, &log).unwrap().is_ood());
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

#[test]
fn motion_of_denormal_numbers_is_judged() {
    let log = drive();
    for scale in [1e-300, 1e-310, 5e-324] {
        let tiny = with_positions(&log, |_, p| p * scale);
        // A vehicle that covers no millimetre in a minute may be refused as one that is not in metres.
        match judged(detector(), &tiny) {
            Ok(report) => assert!(report.is_ood(), "{scale}"),
            Err(error) => assert!(matches!(error, Error::NotMetres { .. }), "{error}"),
        }
    }
}

#[test]
fn maps_with_coordinates_of_millions_of_metres_change_no_verdict() {
    let log = drive();
    let report = judged(detector(), &log).unwrap();
    for (place, tolerance) in [
        (Vector3::new(5e5, 4.6e6, 100.0), 1e-2),
        (Vector3::new(1e7, -1e7, 3e3), 1e-2),
    ] {
        let far = judged(detector(), &with_positions(&log, |_, p| p + place)).unwrap();
        assert_eq!(far.verdict, report.verdict);
        for (a, b) in far.windows.iter().zip(&report.windows) {
            let (a, b) = (a.score.value(), b.score.value());
            assert!(
                (a - b).abs() <= tolerance * (1.0 + b.abs()),
                "{a} and {b} at {place:?}"
            );
        }
    }
    // At the end of what is read.
    let far = with_positions(&log, |_, p| p + Vector3::repeat(9.9e8));
    judged(detector(), &far).unwrap();
}

#[test]
fn very_fast_logs_are_brought_to_the_rate_of_the_detector() {
    let slow = judged(detector(), &trajectory(Platform::Vehicle, 41, 400, 20.0)).unwrap();
    let fast = trajectory(Platform::Vehicle, 41, 100_000, 5000.0);
    let report = judged(detector(), &fast).unwrap();
    assert_eq!(report.log.rate_hz, slow.log.rate_hz);
    assert_eq!(report.windows.len(), slow.windows.len());
    // A microsecond apart, and too short for a window.
    let mut log = drive();
    log.stamps = (0..log.len() as i64).map(|i| i * 1000).collect();
    let log = from("a millisecond", log.stamps, log.poses);
    assert!(judged(detector(), &log).is_err());
}

#[test]
fn stamps_at_the_ends_of_time_are_stamps() {
    let log = drive();
    let report = judged(detector(), &log).unwrap();
    let length = log.stamps[log.len() - 1] - log.stamps[0];
    for first in [i64::MIN, i64::MIN / 2, -length / 2, i64::MAX - length] {
        let stamps: Vec<i64> = log
            .stamps
            .iter()
            .map(|s| first + (s - log.stamps[0]))
            .collect();
        let moved = judged(detector(), &from("moved", stamps, log.poses.clone())).unwrap();
        let scores =
            |r: &Report| -> Vec<f64> { r.windows.iter().map(|w| w.score.value()).collect() };
        assert_eq!(scores(&moved), scores(&report), "from {first}");
    }
    // From the first to the last of them.
    let mut stamps = log.stamps.clone();
    stamps.iter_mut().take(800).for_each(|s| *s += i64::MIN);
    stamps
        .iter_mut()
        .skip(800)
        .for_each(|s| *s += i64::MAX - length - log.stamps[0]);
    let torn = judged(detector(), &from("torn", stamps, log.poses)).unwrap();
    assert!(!torn.windows.is_empty());
}

#[test]
fn a_single_trusted_log_says_like_or_unlike() {
    let detector = Detector::fit(&[trajectory(Platform::Vehicle, 1, 3000, 20.0)]).unwrap();
    let report = judged(&detector, &drive()).unwrap();
    assert!(!report.is_ood(), "{report}");
    let said = report.notes.concat();
    assert!(said.contains("cut from 1 trusted log"), "{report}");
    let flight = trajectory(Platform::Drone, 3, 1600, 20.0);
    let other = judged(&detector, &flight).unwrap();
    // Unlike the one log; what else is trusted nobody has said.
    assert!(other.verdict.differs() && !other.is_ood(), "{other}");
}
