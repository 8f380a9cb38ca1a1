//! Alarms on simulated windows that overlap as real ones do.

use dose3_ood::alarm::{AlarmConfig, AlarmReference, Change, RaisedBy, Watch};
use dose3_ood::{Combination, DetectorConfig, DetectorStatistics, Place};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Seconds from window to window.
const EVERY: f64 = 3.2;
const WINDOWS_AN_HOUR: usize = 1125;
/// Windows that share a step.
const OVERLAP: usize = 4;

/// Windows of a log: each is the mean of four steps in a row and of what the log is like, with a rough patch now and
/// then.
fn log(rng: &mut ChaCha8Rng, windows: usize, columns: usize) -> Vec<Vec<f64>> {
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    let own: Vec<f64> = (0..columns).map(|_| 0.3 * normal()).collect();
    let steps: Vec<Vec<f64>> = (0..windows + OVERLAP)
        .map(|_| (0..columns).map(|_| normal()).collect())
        .collect();
    let rough: Vec<f64> = {
        let mut level: f64 = 0.0;
        (0..windows)
            .map(|_| {
                level = 0.9 * level + 0.2 * normal();
                (0.5 * level).exp()
            })
            .collect()
    };
    (0..windows)
        .map(|w| {
            (0..columns)
                .map(|c| {
                    let sum: f64 = (w..w + OVERLAP).map(|s| steps[s][c]).sum();
                    own[c] + rough[w] * sum / 2.0
                })
                .collect()
        })
        .collect()
}

fn detector(seed: u64) -> DetectorStatistics {
    let config = DetectorConfig {
        statistics: "kinematic/cc".parse().unwrap(),
        combination: Combination::Fisher,
        density: "mixture:1".parse().unwrap(),
        ..DetectorConfig::default()
    };
    let columns = config.statistics.dimension();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut rows, mut places, mut names) = (Vec::new(), Vec::new(), Vec::new());
    for group in 0..12 {
        for row in log(&mut rng, 120, columns) {
            rows.push(row);
            places.push(Place {
                group,
                log: group,
                stretch: 0,
            });
        }
        names.push(format!("log {group}"));
    }
    DetectorStatistics::fit(config, &rows, &places, &names).unwrap()
}

fn config(per_hour: f64) -> AlarmConfig {
    AlarmConfig {
        per_hour,
        spacing: 1,
        overlap: OVERLAP,
        trusted_every: EVERY,
    }
}

/// What a watch says of every row.
fn heard(
    detector: &DetectorStatistics,
    reference: &AlarmReference,
    watch: &mut Watch,
    rows: &[Vec<f64>],
) -> Vec<(usize, Change, Option<RaisedBy>)> {
    let mut work = detector.single_workspace().unwrap();
    let mut all = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        let scores = detector.score_window(row, &mut work).unwrap();
        let step = watch.push(detector, reference, scores.tests);
        all.extend(step.change.map(|change| (i, change, step.by)));
    }
    all
}

#[test]
fn sound_hours_have_no_more_alarms_than_were_asked_for() {
    let mut alarms = 0;
    let hours = 4 * 12;
    for seed in 0..4 {
        let detector = detector(seed);
        let reference = AlarmReference::new(&detector, config(1.0)).unwrap();
        // The audit may leave one out.
        assert!(reference.basis().groups >= 11);
        let columns = detector.names().len();
        let mut rng = ChaCha8Rng::seed_from_u64(100 + seed);
        // Logs of five minutes, as the trusted ones are.
        for _ in 0..12 * 12 {
            let rows = log(&mut rng, WINDOWS_AN_HOUR / 12, columns);
            let mut watch = reference.watch();
            let changes = heard(&detector, &reference, &mut watch, &rows);
            let raised = changes.iter().filter(|(_, c, _)| *c == Change::Raised);
            alarms += raised.count();
        }
    }
    // Poisson of mean 48: three standard deviations beyond.
    assert!(alarms <= hours + 21, "{alarms} alarms in {hours} hours");
}

#[test]
fn a_rarer_alarm_has_higher_levels() {
    let detector = detector(7);
    let levels = |per_hour| {
        let reference = AlarmReference::new(&detector, config(per_hour)).unwrap();
        let runs: Vec<f64> = reference.runs().iter().map(|run| run.level).collect();
        (runs, reference.summed())
    };
    let ((hourly, sum), (daily, daily_sum)) = (levels(1.0), levels(1.0 / 24.0));
    assert_eq!(hourly.len(), 3);
    assert!(hourly.iter().zip(&daily).all(|(h, d)| d > h));
    assert!(daily_sum > sum);
    for bad in [0.0, -1.0, f64::NAN, 1e3] {
        assert!(AlarmReference::new(&detector, config(bad)).is_err());
    }
}

#[test]
fn a_fault_is_heard_and_its_end_too_and_a_watch_survives_json() {
    let detector = detector(8);
    let reference = AlarmReference::new(&detector, config(1.0)).unwrap();
    let columns = detector.names().len();
    let mut rng = ChaCha8Rng::seed_from_u64(55);
    let mut rows = log(&mut rng, 300, columns);
    // A third of the columns is off for long, then all are at once.
    for row in &mut rows[100..140] {
        row[..12].iter_mut().for_each(|x| *x += 5.0);
    }
    for row in &mut rows[220..224] {
        row.iter_mut()
            .for_each(|x| *x += rng.random_range(5.0..6.0));
    }
    let mut watch = reference.watch();
    let all = heard(&detector, &reference, &mut watch, &rows);
    let raised = |all: &[(usize, Change, Option<RaisedBy>)], from: usize, to: usize| {
        let within = |(i, c, _): &&(usize, Change, Option<RaisedBy>)| {
            *c == Change::Raised && (from..to).contains(i)
        };
        all.iter().filter(within).count()
    };
    assert_eq!(raised(&all, 100, 140), 1, "{all:?}");
    assert_eq!(raised(&all, 220, 222), 1, "{all:?}");
    let by = all.iter().find(|(i, ..)| *i == 220).unwrap().2;
    assert_eq!(by, Some(RaisedBy::Window));
    let ended = all.iter().filter(|(_, c, _)| *c == Change::Ended).count();
    assert_eq!(ended * 2, all.len());

    // Put away in the middle of the alarm.
    let mut first = reference.watch();
    let mut halves = heard(&detector, &reference, &mut first, &rows[..222]);
    let json = serde_json::to_string(&first).unwrap();
    let mut second: Watch = serde_json::from_str(&json).unwrap();
    assert!(second.fits(&reference.watch()) && second.is_raised());
    let rest = heard(&detector, &reference, &mut second, &rows[222..]);
    halves.extend(rest.into_iter().map(|(i, c, by)| (i + 222, c, by)));
    assert_eq!(halves, all);
    assert!(!second.fits(&Watch::new(3, 2, 2)));
}
