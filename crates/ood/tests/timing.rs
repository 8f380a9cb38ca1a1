//! Stamps of logs against those of trusted logs.

use dose3_ood::timing::{Cadence, Symptom, TimingEvent, TimingReference};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Exp1, StandardNormal};

const STEP: f64 = 0.05;

fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

/// Stamps every 50 ms, with normal noise.
fn stamps(seed: u64, poses: usize, noise: f64) -> Vec<i64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut stamp = |i: usize| {
        let draw: f64 = rng.sample(StandardNormal);
        nanoseconds(1000.0 + STEP * i as f64 + noise * draw)
    };
    (0..poses).map(&mut stamp).collect()
}

fn fit(logs: &[Vec<i64>]) -> TimingReference {
    let groups: Vec<usize> = (0..logs.len()).collect();
    let logs: Vec<Cadence> = logs.iter().map(|log| Cadence::of(log).unwrap()).collect();
    TimingReference::fit(&logs, &groups).unwrap()
}

fn trusted(noise: f64) -> TimingReference {
    fit(&(0..4)
        .map(|log| stamps(log, 3000, noise))
        .collect::<Vec<_>>())
}

fn chance(reference: &TimingReference, log: &[i64]) -> f64 {
    reference.judge(&Cadence::of(log).unwrap(), 0.005).chance
}

fn words(reference: &TimingReference, log: &[i64]) -> Vec<String> {
    let verdict = reference.judge(&Cadence::of(log).unwrap(), 0.005);
    verdict.events.iter().map(ToString::to_string).collect()
}

/// Without some of the poses 400 to 599, ten seconds of them.
fn lossy(log: &[i64], seed: u64) -> Vec<i64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut kept = |i: &usize| !(400..600).contains(i) || !rng.random_bool(0.2);
    (0..log.len()).filter(&mut kept).map(|i| log[i]).collect()
}

fn jittered(log: &[i64], seed: u64) -> Vec<i64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut late = |stamp: &i64| {
        let draw: f64 = rng.sample(StandardNormal);
        stamp + nanoseconds(0.1 * draw)
    };
    let mut log: Vec<i64> = log.iter().map(&mut late).collect();
    log.sort_unstable();
    log
}

#[test]
fn stamps_like_the_trusted_ones_raise_no_alarm() {
    for noise in [0.0, 0.0005, 0.005] {
        let reference = trusted(noise);
        let alarms = (100..300).filter(|seed| {
            let log = stamps(*seed, 1000, noise);
            chance(&reference, &log) <= 0.05
        });
        assert!(alarms.count() <= 10, "noise {noise}");
    }
    // Loss that the trusted logs have as well.
    let poor = |seed: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut stamp = 0.0;
        let mut next = || {
            let lost: f64 = Exp1.sample(&mut rng);
            stamp += STEP * (1.0 + (0.5 * lost).floor());
            nanoseconds(stamp)
        };
        (0..1000).map(|_| next()).collect::<Vec<i64>>()
    };
    let reference = fit(&(0..8).map(poor).collect::<Vec<_>>());
    let alarms = (100..300).filter(|seed| chance(&reference, &poor(*seed)) <= 0.05);
    assert!(alarms.count() <= 10);
}

#[test]
fn perfect_trusted_stamps_do_not_make_an_alarm_of_microseconds() {
    let reference = trusted(0.0);
    assert_eq!(chance(&reference, &stamps(9, 1000, 0.0)), 1.0);
    assert!(chance(&reference, &stamps(9, 1000, 50e-6)) > 0.05);
    assert!(chance(&reference, &stamps(9, 1000, 20e-3)) < 0.005);
    // One pose lost now and then is nothing either.
    let mut log = stamps(9, 1000, 0.0);
    log.remove(700);
    log.remove(300);
    assert!(chance(&reference, &log) > 0.05);
}

#[test]
fn faults_of_stamps_are_found_and_named() {
    for logs in [2, 3, 10] {
        let reference = fit(&(0..logs)
            .map(|log| stamps(log, 3000, 0.5e-3))
            .collect::<Vec<_>>());
        for seed in 50..60 {
            let sound = stamps(seed, 1000, 0.5e-3);
            assert!(words(&reference, &sound).is_empty());

            assert!(chance(&reference, &lossy(&sound, seed)) < 0.005);
            assert!(chance(&reference, &jittered(&sound, seed)) < 0.005);

            let mut stalled = sound.clone();
            stalled.drain(301..320);
            assert_eq!(
                words(&reference, &stalled),
                ["no pose for 1.0 s from 15.0 s on, trusted at most 52 ms".to_owned()]
                    .map(|text| text.replace("52", &trusted_milliseconds(&reference, &stalled)))
            );

            let mut burst = sound.clone();
            for i in 301..320 {
                burst[i] = burst[320] - 1_000_000 * (320 - i as i64);
            }
            let found = words(&reference, &burst).join("; ");
            assert!(
                found.contains("no pose for 1.0 s from 15.0 s on"),
                "{found}"
            );
            assert!(found.contains("doubled or together"), "{found}");

            let mut thin = sound[..400].to_vec();
            thin.extend(sound[400..600].iter().step_by(2));
            thin.extend(&sound[600..]);
            let found = words(&reference, &thin).join("; ");
            assert!(found.contains("a pose every 0.1 s between"), "{found}");
            assert!(found.contains("every 50 ms in the whole log"), "{found}");

            let half: Vec<i64> = sound.iter().copied().step_by(2).collect();
            let found = words(&reference, &half);
            assert_eq!(found, ["10.0 poses a second, trusted 20.0 to 20.0"]);
        }
    }
}

/// The longest trusted step, as the words have it.
fn trusted_milliseconds(reference: &TimingReference, log: &[i64]) -> String {
    let log = Cadence::of(log).unwrap();
    let verdict = reference.judge(&log, 0.005);
    let pause = verdict
        .findings
        .iter()
        .find(|f| f.symptom == Symptom::Pause);
    format!("{:.0}", 1e3 * (log.period() + pause.unwrap().trusted))
}

#[test]
fn lost_poses_are_placed_and_counted() {
    let sound = stamps(50, 1000, 0.5e-3);
    let log: Vec<i64> = (0..1000)
        .filter(|i| !(400..600).contains(i) || i % 5 != 2)
        .map(|i| sound[i])
        .collect();
    let verdict = trusted(0.5e-3).judge(&Cadence::of(&log).unwrap(), 0.005);
    assert_eq!(verdict.decided, Symptom::Lost);
    let [
        TimingEvent::Missing {
            poses,
            seconds,
            share,
            ..
        },
    ] = &verdict.events[..]
    else {
        panic!("{:?}", verdict.events);
    };
    // Poses 402 and 597 are the first and the last that are missing.
    assert_eq!((poses.start, poses.end), (401, 401 + 158));
    assert!((seconds[0] - 20.05).abs() < 0.01 && (seconds[1] - 29.9).abs() < 0.01);
    assert!((share - 40.0 / 197.0).abs() < 1e-9, "{share}");
}

#[test]
fn a_slow_start_is_compared_with_slow_starts() {
    let slow_start = |seed: u64, pause: f64| {
        let mut log = stamps(seed, 1000, 0.5e-3);
        for (index, stamp) in log.iter_mut().enumerate().take(8) {
            *stamp -= nanoseconds((8 - index) as f64 * pause);
        }
        log
    };
    let reference = fit(&(0..6).map(|log| slow_start(log, 1.0)).collect::<Vec<_>>());
    let log = slow_start(9, 1.0);
    let cadence = Cadence::of(&log).unwrap();
    assert_eq!(cadence.settled(), 8);
    assert!((cadence.highest(Symptom::Start) - 1.0).abs() < 0.01);
    assert!(cadence.highest(Symptom::Pause) < 0.01);
    assert!(chance(&reference, &log) > 0.05);
    // The same pause later is none of those, and a start as slow is none of regular logs.
    let mut later = stamps(9, 1000, 0.5e-3);
    later.drain(301..320);
    assert!(chance(&reference, &later) < 0.005);
    assert!(chance(&trusted(0.5e-3), &log) < 0.005);
}

#[test]
fn one_trusted_log_says_less_than_ten() {
    let of = |logs: u64| {
        fit(&(0..logs)
            .map(|log| stamps(log, 1000, 5e-3))
            .collect::<Vec<_>>())
    };
    let log = stamps(77, 1000, 9e-3);
    let chances: Vec<f64> = [1, 3, 10, 30].map(|logs| chance(&of(logs), &log)).to_vec();
    assert!(
        chances.windows(2).all(|pair| pair[1] < pair[0]),
        "{chances:?}"
    );
    // A log of one group with another is no more evidence than one.
    let logs = [stamps(0, 1000, 5e-3), stamps(1, 1000, 5e-3)];
    let logs: Vec<Cadence> = logs.iter().map(|log| Cadence::of(log).unwrap()).collect();
    assert_eq!(TimingReference::fit(&logs, &[4, 4]).unwrap().len(), 1);
    assert!(TimingReference::fit(&logs, &[4]).is_err());
    assert!(TimingReference::fit(&[], &[]).is_err());
}

#[test]
fn a_reference_is_stored_and_read_back() {
    let reference = trusted(0.5e-3);
    let text = serde_json::to_string(&reference).unwrap();
    assert_eq!(
        serde_json::from_str::<TimingReference>(&text).unwrap(),
        reference
    );
    let verdict = reference.judge(
        &Cadence::of(&lossy(&stamps(5, 1000, 0.0), 1)).unwrap(),
        0.005,
    );
    let text = serde_json::to_string(&verdict).unwrap();
    assert_eq!(serde_json::from_str(&text).ok(), Some(verdict));
    for damaged in [
        r#"{"groups":[]}"#,
        r#"{"groups":[{"spans":0,"ln_period":-3.0,"scores":[0,0,0,0,0,0]}]}"#,
        r#"{"groups":[{"spans":3,"ln_period":-3.0,"scores":[0,0,0,0,0]}]}"#,
        r#"{"groups":[{"spans":3,"ln_period":-3.0,"scores":[0,0,0,0,0,0],"more":1}]}"#,
    ] {
        assert!(
            serde_json::from_str::<TimingReference>(damaged).is_err(),
            "{damaged}"
        );
    }
}

#[test]
fn too_few_stamps_and_stamps_that_stand_still_say_nothing() {
    assert!(Cadence::of(&[]).is_none());
    assert!(Cadence::of(&stamps(1, 32, 0.0)).is_none());
    assert!(Cadence::of(&stamps(1, 33, 0.0)).is_some());
    assert!(Cadence::of(&[7; 100]).is_none());
    let backward: Vec<i64> = (0..100).rev().collect();
    assert!(Cadence::of(&backward).is_none());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn any_stamps_have_a_chance(
        log in prop::collection::vec(any::<i64>(), 0..300),
        steps in prop::collection::vec(-1_000_000_i64..1_000_000_000, 33..300),
    ) {
        let reference = trusted(0.5e-3);
        let walk: Vec<i64> = steps
            .iter()
            .scan(0_i64, |stamp, step| { *stamp += step; Some(*stamp) })
            .collect();
        for log in [log, walk] {
            if let Some(cadence) = Cadence::of(&log) {
                let verdict = reference.judge(&cadence, 0.005);
                prop_assert!((0.0..=1.0).contains(&verdict.chance));
                prop_assert!(verdict.findings.iter().all(|f| f.value.is_finite() && f.trusted.is_finite()));
                prop_assert_eq!(verdict.events.is_empty(), verdict.chance > 0.005);
            }
        }
    }
}

#[test]
fn stamps_that_scatter_are_not_poses_that_are_missing() {
    // 20 ms of jitter on 50 ms: one step in five is longer than 75 ms.
    let reference = trusted(0.0005);
    let log = stamps(9, 3000, 0.02);
    let said = words(&reference, &log).join("; ");
    assert!(
        said.contains("irregular") && !said.contains("missing"),
        "{said}"
    );
    // Poses that are missing are named beside such jitter too.
    let said = words(&reference, &lossy(&log, 3)).join("; ");
    assert!(
        said.contains("irregular") && chance(&reference, &lossy(&log, 3)) < 1e-3,
        "{said}"
    );
    let steady = words(&reference, &lossy(&stamps(9, 3000, 0.0005), 3)).join("; ");
    assert!(steady.contains("missing"), "{steady}");
}

#[test]
fn rows_that_were_left_out_as_repetitions_count() {
    let reference = trusted(0.0005);
    let log = stamps(9, 3000, 0.0005);
    let repeated: Vec<i64> = (400..600).step_by(5).map(|i| log[i]).collect();
    let cadence = Cadence::of(&log).unwrap();
    assert!(reference.judge(&cadence, 0.005).events.is_empty());
    let verdict = reference.judge(&cadence.with_repeated(&repeated), 0.005);
    assert_eq!(verdict.decided, Symptom::Crowded);
    let [TimingEvent::Crowded { poses, share, .. }] = &verdict.events[..] else {
        panic!("{:?}", verdict.events);
    };
    // From the step into pose 400 to the step into pose 595.
    assert_eq!(*poses, 399..596);
    assert!((share - 40.0 / 236.0).abs() < 1e-12, "{share}");
}
