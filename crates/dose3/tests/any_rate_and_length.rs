//! Logs below 10 Hz, and logs of fewer poses than a window of 128 steps.

use dose3::prelude::*;
use dose3::{DetectorBuilder, Error, FitOptions, Setting, Trajectory};
use dose3_datasets::synthetic::{Platform, suite, trajectory};

fn builder(change: impl Fn(&mut FitOptions)) -> DetectorBuilder {
    let mut options = FitOptions {
        statistics: Some("kinematic,lin/cc".parse().unwrap()),
        density: "mixture:1".parse().unwrap(),
        ..FitOptions::default()
    };
    change(&mut options);
    Detector::builder().options(options)
}

fn logs(count: u64, poses: usize, hertz: f64) -> Vec<Trajectory> {
    let log = |seed| trajectory(Platform::Vehicle, seed, poses, hertz);
    (0..count).map(log).collect()
}

#[test]
fn slow_logs_are_fitted_and_judged_at_their_own_rate() {
    for hertz in [2.0, 5.0, 9.0] {
        let run = builder(|_| ()).run(&logs(4, 500, hertz), &mut ()).unwrap();
        let detector = run.detector;
        assert_eq!(detector.header().rate, hertz);
        let said = run.notes.iter().map(ToString::to_string);
        assert!(said.into_iter().any(|note| note.contains("measured at")));
        let report = detector
            .judge(&trajectory(Platform::Vehicle, 30, 900, 2.0 * hertz))
            .unwrap();
        assert_eq!(report.log.rate_hz, hertz);
        // A log that is slower still has no poses to compare.
        let slower = trajectory(Platform::Vehicle, 31, 400, 0.5 * hertz);
        assert!(matches!(
            detector.judge(&slower),
            Err(Error::TooSlow { .. })
        ));
    }
    // 1 Hz is too slow for anything.
    let refused = builder(|_| ()).fit(&logs(4, 500, 1.0));
    assert!(matches!(refused, Err(Error::TooSlow { .. })));
}

#[test]
fn another_rate_and_another_window_can_be_asked_for() {
    let trusted = suite(Platform::Vehicle, 4, 1);
    let detector = builder(|o| (o.rate, o.window) = (Some(20.0), Some(48)))
        .fit(&trusted)
        .unwrap();
    let header = detector.header();
    assert_eq!(
        (header.rate, header.window, header.stride),
        (20.0, Some(48), 12)
    );
    let report = detector.judge(&trusted[0]).unwrap();
    let second = &report.windows[1];
    assert_eq!((second.first_pose, second.last_pose), (12, 12 + 48));
    for (change, setting) in [
        (
            (|o| o.rate = Some(1.0)) as fn(&mut FitOptions),
            Setting::MeasuringRate,
        ),
        (|o| o.rate = Some(f64::NAN), Setting::MeasuringRate),
        (|o| o.window = Some(31), Setting::Window),
        (
            |o| (o.window, o.statistics) = (Some(64), Some("residual".parse().unwrap())),
            Setting::Window,
        ),
        (
            |o| (o.rate, o.statistics) = (Some(5.0), Some("residual".parse().unwrap())),
            Setting::MeasuringRate,
        ),
    ] {
        let error = builder(change).fit(&trusted).unwrap_err();
        assert!(
            matches!(error, Error::Setting { setting: s, .. } if s == setting),
            "{error}"
        );
    }
}

#[test]
fn short_logs_are_judged_in_windows_that_fit() {
    let detector = builder(|_| ()).fit(&logs(4, 600, 10.0)).unwrap();
    let again = Detector::from_bytes(&detector.to_bytes().unwrap()).unwrap();
    assert_eq!(again, detector);
    for (poses, length) in [(33, 33), (64, 33), (65, 65), (128, 65), (129, 129)] {
        let log = trajectory(Platform::Vehicle, 40, poses, 10.0);
        let report = again.judge(&log).unwrap();
        assert!(
            report
                .windows
                .iter()
                .all(|w| w.last_pose - w.first_pose + 1 == length),
            "{poses}"
        );
        let short = report.notes.iter().any(|note| note.contains("windows of"));
        assert_eq!(short, length < 129, "{:?}", report.notes);
        // What is broken is called in short windows too; of the long ones so few logs have too few for that.
        if length == 129 {
            continue;
        }
        let mut broken = log.clone();
        let jump = |(i, p): (usize, &mut dose3::Pose)| p.translation.x += (i % 2) as f64;
        broken.poses.iter_mut().enumerate().for_each(jump);
        assert!(again.judge(&broken).unwrap().verdict.differs(), "{poses}");
    }
    let few = trajectory(Platform::Vehicle, 40, 32, 10.0);
    assert!(again.judge(&few).is_err());
}

#[test]
fn short_trusted_logs_make_shorter_windows() {
    let run = builder(|_| ()).run(&logs(6, 100, 10.0), &mut ()).unwrap();
    assert_eq!(run.detector.header().window, Some(64));
    assert!(
        run.notes
            .iter()
            .any(|n| n.to_string().contains("windows of 64 steps"))
    );
    // One short log of eight is left out for the sake of the others.
    let mixed = [logs(7, 100, 10.0), logs(1, 40, 10.0)].concat();
    assert!(builder(|_| ()).fit(&mixed).is_err());
    let run = builder(|_| ())
        .leave_out(true)
        .run(&mixed, &mut ())
        .unwrap();
    let left: Vec<usize> = run.left_out.iter().map(|left| left.index).collect();
    assert_eq!(left, [7]);
}
