//! The sentences of a report name what was done to a log.

use dose3::datasets::faults::Fault;
use dose3::datasets::synthetic::{Platform, suite, trajectory};
use dose3::report::{ReasonAxis, ReasonKind, Segment};
use dose3::{Detector, Frame, Report, Trajectory};

fn detector() -> Detector {
    Detector::fit(&suite(Platform::Vehicle, 6, 1)).unwrap()
}

fn drive() -> Trajectory {
    trajectory(Platform::Vehicle, 40, 1000, 10.0)
}

/// The worst stretch of the drive with a fault in poses 400 to 500.
fn worst(detector: &Detector, fault: &str) -> (Report, Segment) {
    let fault: Fault = fault.parse().unwrap();
    let faulty = fault.inject(&drive(), 400..500, 3).unwrap();
    let report = detector.judge(&faulty.trajectory).unwrap();
    assert!(report.is_ood(), "{fault}: {report}");
    let segments = report.segments.iter();
    let worst = segments.max_by_key(|s| s.worst_score).unwrap().clone();
    (report, worst)
}

#[test]
fn the_first_sentence_names_kind_and_axis() {
    let detector = detector();
    for (fault, kind, axes, words) in [
        (
            "freeze:2.0s",
            ReasonKind::Repeats,
            &[ReasonAxis::Pose][..],
            "pose repeats for 2.0 s",
        ),
        (
            "jump:3.0m",
            ReasonKind::Jump,
            &[ReasonAxis::Position],
            "position jumps 3.0 m in 0.10 s",
        ),
        (
            "jitter-rotation:3.0deg",
            ReasonKind::Noise,
            &[ReasonAxis::Roll, ReasonAxis::Pitch, ReasonAxis::Yaw],
            "rate noise",
        ),
        (
            "slip:3.0m/s",
            ReasonKind::Velocity,
            &[ReasonAxis::Left],
            "sideways speed 3.",
        ),
        (
            "reversal",
            ReasonKind::Backwards,
            &[ReasonAxis::Forward],
            "path runs backwards at",
        ),
    ] {
        let (_, segment) = worst(&detector, fault);
        let said = segment
            .reasons
            .iter()
            .find(|r| r.kind == kind && axes.contains(&r.axis));
        let all: Vec<&str> = segment
            .reasons
            .iter()
            .map(|r| r.sentence.as_str())
            .collect();
        let said = said.unwrap_or_else(|| panic!("{fault}: {all:?}"));
        assert!(said.sentence.contains(words), "{fault}: {all:?}");
        assert!(segment.reasons.len() <= 3 && said.strength > 1.0);
        assert!(
            segment
                .reasons
                .windows(2)
                .all(|p| p[0].strength >= p[1].strength)
        );
    }
}

#[test]
fn a_reason_says_where_in_the_file_and_comes_back_from_json() {
    let detector = detector();
    let (report, segment) = worst(&detector, "freeze:2.0s");
    let repeats = &segment.reasons[0];
    // Twenty poses repeat pose 400.
    assert_eq!(
        (repeats.place.first_row, repeats.place.last_row),
        (400, 420)
    );
    assert_eq!(
        repeats.place.first_stamp,
        report.segments[0].reasons[0].place.first_stamp
    );
    assert!(repeats.place.first_stamp.is_some());
    assert_eq!(repeats.trusted, Some([0.0, 0.0]));
    assert!(report.reasons.contains(repeats));
    let json = serde_json::to_string(&report).unwrap();
    let again: Report = serde_json::from_str(&json).unwrap();
    assert_eq!(again.segments, report.segments);
    assert!(report.to_string().contains(&repeats.sentence), "{report}");
}

#[test]
fn axes_without_names_are_x_y_and_z() {
    let unnamed = |mut log: Trajectory| {
        log.frame = Frame::Sensor;
        log
    };
    let trusted: Vec<Trajectory> = suite(Platform::Vehicle, 6, 1)
        .into_iter()
        .map(unnamed)
        .collect();
    let detector = Detector::fit(&trusted).unwrap();
    let slip: Fault = "slip:3.0m/s".parse().unwrap();
    let faulty = slip.inject(&unnamed(drive()), 400..500, 3).unwrap();
    let report = detector.judge(&faulty.trajectory).unwrap();
    let sentences: Vec<&str> = report.reasons.iter().map(|r| r.sentence.as_str()).collect();
    assert!(
        sentences.iter().any(|s| s.starts_with("speed along y 3.")),
        "{sentences:?}"
    );
}

#[test]
fn series_hold_what_the_sentences_say() {
    use dose3::series::{Axis, Quantity};
    let detector = detector();
    let log = drive();
    let slip: Fault = "slip:3.0m/s".parse().unwrap();
    let log = slip.inject(&log, 400..500, 3).unwrap().trajectory;
    let report = detector.judge(&log).unwrap();
    let series = detector.series(&log, &report).unwrap();
    assert_eq!((series.len(), series.rows.len()), (1000, 1000));
    assert_eq!(series.scores, report.poses.scores);
    let sideways = series.column(Quantity::Velocity(Axis::Left)).unwrap();
    let trusted = sideways.trusted.unwrap();
    assert!(sideways.values[450].unwrap().abs() > trusted.poses.high().max(-trusted.poses.low()));
    assert!(sideways.values[300].unwrap().abs() <= trusted.poses.high().max(-trusted.poses.low()));
    assert_eq!(sideways.values[0], None);
    // Detectors of older formats have no ranges, and say nothing rather than something wrong.
    let bytes = include_bytes!("../../../tests/fixtures/detector-v3.dose3");
    let old = Detector::from_bytes(bytes).unwrap();
    let log = trajectory(Platform::Vehicle, 40, 1000, 20.0);
    let report = old.judge(&log).unwrap();
    assert!(report.reasons.is_empty() && report.segments.iter().all(|s| s.reasons.is_empty()));
    let series = old.series(&log, &report).unwrap();
    assert!(
        series
            .columns
            .iter()
            .all(|c| c.trusted.is_none() && c.values.len() == 1000)
    );
}
