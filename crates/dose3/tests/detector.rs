//! A detector as a library user meets it: fitted, kept, judging.

use dose3::prelude::*;
use dose3::{Backend, Computing, DetectorBuilder, Error, FitOptions, Setting};
use dose3_datasets::synthetic::{Platform, suite, trajectory};

/// Quick: no network, or few passes of it.
fn builder(statistics: &str) -> DetectorBuilder {
    Detector::builder().options(FitOptions {
        statistics: Some(statistics.parse().unwrap()),
        density: "mixture:1".parse().unwrap(),
        steps: Some(6),
        ..FitOptions::default()
    })
}

#[test]
fn a_detector_comes_back_from_bytes_and_judges_the_same_on_any_number_of_threads() {
    let trusted = suite(Platform::Vehicle, 4, 1);
    let fitted = builder("kinematic,lin,residual").fit(&trusted).unwrap();
    let bytes = fitted.to_bytes().unwrap();
    let read = Detector::from_bytes(&bytes).unwrap();
    assert_eq!(read, fitted);
    assert_eq!(read.to_bytes().unwrap(), bytes);
    let log = trajectory(Platform::Vehicle, 20, 600, 20.0);
    let report = fitted.judge(&log).unwrap();
    let threads = Computing {
        threads: 3,
        backend: Backend::Engine,
    };
    assert_eq!(read.on(threads).judge(&log).unwrap(), report);

    let json = serde_json::to_string(&report).unwrap();
    let mut again: Report = serde_json::from_str(&json).unwrap();
    // Too many to be written.
    again.poses.scores.clone_from(&report.poses.scores);
    assert_eq!(again, report);
    assert!(report.to_string().starts_with(&log.name), "{report}");
}

#[test]
fn threads_may_share_a_detector() {
    fn shared<T: Send + Sync>(_: &T) {}
    let detector = builder("kinematic")
        .fit(&suite(Platform::Vehicle, 3, 1))
        .unwrap();
    shared(&detector);
    let logs = suite(Platform::Vehicle, 2, 9);
    let alone: Vec<Report> = logs
        .iter()
        .map(|log| detector.judge(log).unwrap())
        .collect();
    let together: Vec<Report> = std::thread::scope(|scope| {
        let detector = &detector;
        let judge = |log| scope.spawn(move || detector.judge(log).unwrap());
        let all: Vec<_> = logs.iter().map(judge).collect();
        all.into_iter()
            .map(|thread| thread.join().unwrap())
            .collect()
    });
    assert_eq!(alone, together);
}

#[test]
fn every_fact_stands_once_in_the_file() {
    let fitted = builder("residual")
        .seed(7)
        .fit(&suite(Platform::Drone, 3, 1))
        .unwrap();
    let json = serde_json::to_value(fitted.header()).unwrap();
    let keys: Vec<&str> = json
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect();
    for twice in ["needs", "probe", "representation", "seed", "draws"] {
        assert!(!keys.contains(&twice), "{keys:?}");
    }
    let plan = fitted.header().plan();
    assert_eq!((plan.steps, plan.draws, plan.seed), (6, 1, 7));
}

#[test]
fn settings_out_of_range_are_errors_that_name_the_setting() {
    let trusted = suite(Platform::Vehicle, 3, 1);
    let refused = |change: fn(&mut FitOptions)| {
        let mut options = FitOptions::default();
        change(&mut options);
        let fit = Detector::builder().options(options).fit(&trusted);
        fit.map(|_| ()).unwrap_err()
    };
    for (change, setting) in [
        (
            (|o| o.steps = Some(0)) as fn(&mut FitOptions),
            Setting::Steps,
        ),
        (|o| o.steps = Some(1000), Setting::Steps),
        (|o| o.draws = Some(0), Setting::Draws),
        (|o| o.stride = 0, Setting::Stride),
        (|o| o.alpha = 1.0, Setting::Alpha),
    ] {
        let error = refused(change);
        assert!(
            matches!(error, Error::Setting { setting: s, .. } if s == setting),
            "{setting:?}: {error}"
        );
        assert!(!error.to_string().contains("--"), "{error}");
    }
    assert!(matches!(Detector::fit(&[]), Err(Error::NoLog { .. })));
}

#[test]
fn a_log_that_does_not_fit_is_refused() {
    let detector = builder("kinematic")
        .fit(&suite(Platform::Vehicle, 3, 1))
        .unwrap();
    let slow = trajectory(Platform::Vehicle, 9, 400, 5.0);
    assert!(matches!(detector.judge(&slow), Err(Error::TooSlow { .. })));
    let mut unknown = trajectory(Platform::Vehicle, 9, 400, 20.0);
    unknown.frame = Frame::Sensor;
    assert!(matches!(detector.judge(&unknown), Err(Error::Frame { .. })));
    let mut far = trajectory(Platform::Vehicle, 9, 400, 20.0);
    far.poses.iter_mut().for_each(|p| p.translation *= 1e4);
    assert!(matches!(detector.judge(&far), Err(Error::NotMetres { .. })));
    assert!(matches!(
        Detector::from_bytes(
            &dose3::built_in::motion()
                .unwrap()
                .to_bytes(dose3::model::Precision::F16, &[])
                .unwrap()
        ),
        Err(Error::NotADetector)
    ));
}

#[test]
fn an_altered_byte_is_found_wherever_it_is() {
    let trusted: Vec<Trajectory> = (0..3)
        .map(|seed| trajectory(Platform::Vehicle, seed, 300, 10.0))
        .collect();
    let bytes = Detector::fit(&trusted).unwrap().to_bytes().unwrap();
    assert!(Detector::from_bytes(&bytes).is_ok());
    // The beginnings of both parts, and a byte here and there.
    let header = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let near = |at: usize, part: usize| (part..part + 64).contains(&at);
    let mut accepted = Vec::new();
    let mut tried = 0;
    for at in 0..bytes.len() {
        if !(near(at, 0) || near(at, header) || at % 9973 == 0 || at + 1 == bytes.len()) {
            continue;
        }
        let mut altered = bytes.clone();
        altered[at] ^= 1 << (at % 8);
        tried += 1;
        if Detector::from_bytes(&altered).is_ok() {
            accepted.push(at);
        }
    }
    assert!(tried > 150);
    assert!(accepted.is_empty(), "accepted in silence: {accepted:?}");
    // Cut off, or with something after it.
    assert!(Detector::from_bytes(&bytes[..bytes.len() - 1]).is_err());
    assert!(Detector::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
}
