//! Verdicts: runs of windows, tests with shares of their own, groups, the audit, few trusted logs.

use dose3_ood::calibration::Stretch;
use dose3_ood::density::{Components, GaussianMixtureParams};
use dose3_ood::detector::{DetectorConfig, DetectorStatistics, Evidence, Place};
use dose3_ood::{
    Combination, DensityConfig, Error, ExternalTest, LogVerdict, StatisticsSet, Unit, Verdict,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const COLUMNS: usize = 72;

/// Windows of a log: `kinematic` and `differences` have 36 columns each. `shift(window, column)` is added.
fn log(seed: u64, windows: usize, shift: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || rng.sample::<f64, _>(StandardNormal);
    let offset = 0.05 * normal();
    // Each window shares three quarters of its poses with the next.
    let parts: Vec<Vec<f64>> = (0..windows + 3)
        .map(|_| {
            let common = 0.15 * normal();
            (0..COLUMNS).map(|_| 0.5 * normal() + common).collect()
        })
        .collect();
    (0..windows)
        .map(|window| {
            (0..COLUMNS)
                .map(|column| {
                    let shared: f64 = parts[window..window + 4].iter().map(|p| p[column]).sum();
                    shared + offset + shift(window, column)
                })
                .collect()
        })
        .collect()
}

fn sound(seed: u64, windows: usize) -> Vec<Vec<f64>> {
    log(seed, windows, |_, _| 0.0)
}

/// The columns of `kinematic`.
fn kinematic(rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    rows.into_iter().map(|row| row[..36].to_vec()).collect()
}

fn config(statistics: &str) -> DetectorConfig {
    DetectorConfig {
        statistics: statistics.parse().unwrap(),
        density: DensityConfig::Mixture(GaussianMixtureParams {
            components: Components::Fixed(1),
            ..GaussianMixtureParams::default()
        }),
        combination: Combination::Fisher,
        seed: 3,
        ..DetectorConfig::default()
    }
}

/// A detector on logs, each a group of its own and without gaps.
fn fit_logs(config: DetectorConfig, logs: &[Vec<Vec<f64>>]) -> DetectorStatistics {
    let of: Vec<usize> = logs
        .iter()
        .enumerate()
        .flat_map(|(i, log)| vec![i; log.len()])
        .collect();
    let names: Vec<String> = (0..logs.len()).map(|i| format!("log {i}")).collect();
    DetectorStatistics::fit(config, &logs.concat(), &Place::of_logs(&of), &names).unwrap()
}

fn trusted(statistics: &str, logs: u64, windows: usize) -> DetectorStatistics {
    let logs: Vec<_> = (0..logs).map(|seed| sound(seed, windows)).collect();
    fit_logs(config(statistics), &logs)
}

fn judge(detector: &DetectorStatistics, rows: &[Vec<f64>]) -> LogVerdict {
    detector.judge(rows, &vec![0; rows.len()]).unwrap()
}

fn run(verdict: &LogVerdict) -> (usize, usize) {
    match &verdict.deciding().evidence {
        Evidence::Run(run) => (run.first, run.last),
        Evidence::Finding(sentence) => panic!("{sentence}"),
    }
}

#[test]
fn three_far_windows_in_a_row_reject_a_long_log_and_one_does_not() {
    let detector = trusted("kinematic,differences", 6, 60);
    let far = |windows: std::ops::Range<usize>| {
        let rows = log(100, 60, |w, _| if windows.contains(&w) { 9.0 } else { 0.0 });
        judge(&detector, &rows)
    };
    let one = far(20..21);
    assert_eq!(
        (one.verdict, one.beyond >= 1),
        (Verdict::InDistribution, true)
    );
    let three = far(20..23);
    assert_eq!(three.verdict, Verdict::OutOfDistribution);
    assert_eq!(run(&three), (20, 22));
    assert!(three.p_value <= 0.05 && three.excess > 1.0 && three.excess > one.excess);
    assert!(three.basis.tail && !three.basis.provisional);
    assert_eq!((three.basis.groups, three.basis.windows), (6, 360));
    assert_eq!(three.basis.smallest_rank_p, 1.0 / 7.0);
    assert!(three.notes.is_empty(), "{:?}", three.notes);
    // A gap between them: no run of three shares the fault.
    let rows = log(
        100,
        60,
        |w, _| if (20..23).contains(&w) { 9.0 } else { 0.0 },
    );
    let stretches: Vec<usize> = (0..60).map(|w| usize::from(w >= 21)).collect();
    let cut = detector.judge(&rows, &stretches).unwrap();
    assert!(cut.p_value > three.p_value);
    assert!(run(&cut).1 < 21 || run(&cut).0 >= 21);
}

#[test]
fn short_logs_are_judged_as_far_as_they_go() {
    let detector = trusted("kinematic,differences", 6, 60);
    for windows in [1, 2, 3, 5, 12] {
        let passes = judge(&detector, &sound(200, windows));
        assert!(!passes.verdict.is_ood(), "{windows}: {passes:?}");
        let fails = judge(&detector, &log(201, windows, |_, _| 6.0));
        assert!(fails.verdict.is_ood(), "{windows}: {fails:?}");
        assert!(fails.p_value > 0.0 && passes.p_value <= 1.0);
    }
    assert!(detector.judge(&[], &[]).is_err());
    assert!(detector.judge(&sound(1, 3), &[0, 0]).is_err());
    assert!(
        detector
            .judge_with(&sound(1, 3), &[0; 3], &[], 0.0)
            .is_err()
    );
}

#[test]
fn tests_share_alpha_and_the_report_says_which_decided() {
    let detector = trusted("kinematic/differences", 6, 60);
    assert_eq!(detector.config().statistics.tests(), 2);
    let in_differences = |w: usize, c: usize| if c >= 36 && w >= 30 { 3.0 } else { 0.0 };
    let verdict = judge(&detector, &log(100, 60, in_differences));
    assert!(verdict.verdict.is_ood());
    assert_eq!(verdict.deciding().name, "differences");
    assert_eq!(verdict.decided_by, 1);
    let p: Vec<f64> = verdict.tests.iter().map(|t| t.p_value).collect();
    assert_eq!(verdict.p_value, (2.0 * p[0].min(p[1])).min(1.0));
    assert_eq!(verdict.contributions[0].group, "differences");
    let share = DetectorConfig {
        shares: Some(vec![0.9, 0.1]),
        ..config("kinematic/differences")
    };
    let logs: Vec<_> = (0..6).map(|seed| sound(seed, 60)).collect();
    let unequal = judge(&fit_logs(share, &logs), &log(100, 60, in_differences));
    assert!(
        (unequal.tests[1].weighted_p_value() / verdict.tests[1].weighted_p_value() - 5.0).abs()
            < 1e-6
    );
    // Held-out windows stay as rare beyond the threshold as asked.
    let beyond: usize = (0..20)
        .map(|seed| judge(&detector, &sound(300 + seed, 60)).beyond)
        .sum();
    assert!((0.01..0.1).contains(&(beyond as f64 / 1200.0)), "{beyond}");
    let joint = DetectorConfig {
        combination: Combination::Joint,
        ..config("kinematic/differences")
    };
    assert!(matches!(joint.check(), Err(Error::Parameter { .. })));
}

#[test]
fn sets_of_tests_survive_their_text() {
    for text in [
        "kinematic/differences",
        "kinematic,differences/residual+eps-mean",
        "kinematic+differences/residual",
    ] {
        let set: StatisticsSet = text.parse().unwrap();
        assert_eq!((set.to_string().as_str(), set.tests()), (text, 2));
        assert_eq!(set.test_names().join("/"), text);
    }
    let set: StatisticsSet = "kinematic,differences/residual+eps-mean".parse().unwrap();
    assert_eq!(set.test_groups(), [0..2, 2..3]);
    let plain: StatisticsSet = "paper24".parse().unwrap();
    let whole = plain.test_groups();
    assert_eq!((whole.len(), whole[0].len()), (1, plain.groups().len()));
    for bad in [
        "kinematic/",
        "/kinematic",
        "kinematic//differences",
        "kinematic/kinematic",
        "kinematic,/residual",
    ] {
        assert!(bad.parse::<StatisticsSet>().is_err(), "{bad}");
    }
}

#[test]
fn tests_from_outside_join_with_their_share() {
    let detector = trusted("kinematic,differences", 6, 60);
    let rows = sound(100, 60);
    let alone = judge(&detector, &rows);
    let timing = |share: f64, p_value: f64| ExternalTest {
        name: "timing".into(),
        share,
        p_value,
        sentence: "20 % of poses are missing".into(),
    };
    let joined = |p| {
        let all = detector.judge_with(&rows, &[0; 60], &[timing(0.2, p)], 0.05);
        all.unwrap()
    };
    let late = joined(0.001);
    assert_eq!(
        (late.verdict, late.p_value),
        (Verdict::OutOfDistribution, 0.005)
    );
    assert_eq!(
        late.deciding().evidence,
        Evidence::Finding("20 % of poses are missing".into())
    );
    assert!(late.run().is_some() && !late.basis.tail);
    let on_time = joined(0.5);
    assert!(!on_time.verdict.is_ood());
    assert!((on_time.tests[0].share - 0.8).abs() < 1e-12);
    assert_eq!(on_time.tests[0].p_value, alone.tests[0].p_value);
    assert_eq!(on_time.mean_score, alone.mean_score);
    for bad in [timing(1.0, 0.5), timing(0.1, -0.5), timing(0.1, f64::NAN)] {
        assert!(detector.judge_with(&rows, &[0; 60], &[bad], 0.05).is_err());
    }
    let text = serde_json::to_string(&late).unwrap();
    assert_eq!(serde_json::from_str::<LogVerdict>(&text).unwrap(), late);
}

#[test]
fn an_odd_trusted_log_is_named_and_left_out_of_the_reference_alone() {
    let with = |odd: &[u64], keep_all: bool, logs: u64| {
        let logs: Vec<_> = (0..logs)
            .map(|seed| {
                let shift = if odd.contains(&seed) { 4.0 } else { 0.0 };
                log(seed, 50, |w, c| {
                    if (20..30).contains(&w) && c < 9 {
                        shift
                    } else {
                        0.0
                    }
                })
            })
            .collect();
        let config = DetectorConfig {
            keep_all,
            ..config("kinematic,differences")
        };
        fit_logs(config, &logs)
    };
    let audited = with(&[7], false, 10);
    let found = &audited.calibration().audit;
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(
        (found[0].group.as_str(), found[0].log, found[0].left_out),
        ("log 7", 7, true)
    );
    // Rows 350 to 399 are its; the fault is in its windows 20 to 29.
    assert!(found[0].first >= 370 && found[0].last < 380, "{found:?}");
    assert!(found[0].p_value <= 0.005);
    assert_eq!(
        (
            audited.calibration().logs,
            audited.calibration().windows.len()
        ),
        (9, 450)
    );
    let units = &audited.calibration().units;
    assert!(units.len() == 10 && units[7].left_out && !units[6].left_out);
    // The densities are those of all logs.
    let kept = with(&[7], true, 10);
    assert_eq!(kept.densities(), audited.densities());
    assert_eq!(kept.calibration().logs, 10);
    assert!(kept.calibration().audit.iter().all(|f| !f.left_out));
    assert_eq!(kept.calibration().audit[0].group, "log 7");
    // What the odd log hid is found.
    let rows = log(100, 50, |w, c| {
        if (20..30).contains(&w) && c < 9 {
            3.0
        } else {
            0.0
        }
    });
    assert!(judge(&audited, &rows).p_value < judge(&kept, &rows).p_value);
    // One of ten at most, though two are odd.
    let two = with(&[3, 7], false, 10);
    let left_out = two
        .calibration()
        .audit
        .iter()
        .filter(|f| f.left_out)
        .count();
    assert_eq!((left_out, two.calibration().logs), (1, 9));
    // Two of twenty.
    let two = with(&[3, 7], false, 20);
    let left_out = two
        .calibration()
        .audit
        .iter()
        .filter(|f| f.left_out)
        .count();
    assert_eq!((left_out, two.calibration().logs), (2, 18));
    // Three logs cannot judge each other, and sound ones are not named.
    assert!(with(&[1], false, 3).calibration().audit.is_empty());
    assert!(with(&[], false, 10).calibration().audit.is_empty());
    // The finding is stored.
    let text = serde_json::to_string(&audited).unwrap();
    assert_eq!(
        serde_json::from_str::<DetectorStatistics>(&text).unwrap(),
        audited
    );
}

#[test]
fn groups_are_the_units_and_no_run_crosses_logs() {
    // Five runs of four sequences, two stretches in every log.
    let mut rows = Vec::new();
    let mut places = Vec::new();
    for log in 0..20 {
        rows.extend(sound(log as u64, 20));
        places.extend((0..20).map(|w| Place {
            group: log / 5,
            log,
            stretch: w / 10,
        }));
    }
    let names: Vec<String> = (0..4).map(|g| format!("sequence {g}")).collect();
    let detector =
        DetectorStatistics::fit(config("kinematic,differences"), &rows, &places, &names).unwrap();
    let calibration = detector.calibration();
    assert_eq!((calibration.unit, calibration.logs), (Unit::Log, 4));
    assert_eq!(calibration.units.len(), 4);
    assert_eq!(calibration.units[2].windows, 100);
    let lengths: Vec<usize> = calibration.tests[0]
        .iter()
        .map(|s: &Stretch| s.scores.len())
        .collect();
    assert_eq!(lengths, [10; 40]);
    assert_eq!(calibration.tests[0][39].group, 3);
    let verdict = judge(&detector, &log(100, 20, |_, _| 5.0));
    assert!(verdict.verdict.is_ood());
    assert_eq!(verdict.basis.smallest_rank_p, 0.2);
    // Rows in another order of logs are the same detector, up to the order of its stretches.
    let bad = [
        places[..399].to_vec(),
        vec![Place {
            group: 4,
            log: 19,
            stretch: 1,
        }],
    ]
    .concat();
    assert!(DetectorStatistics::fit(config("kinematic,differences"), &rows, &bad, &names).is_err());
}

#[test]
fn one_trusted_log_gives_no_verdict_on_the_distribution_and_two_a_provisional_one() {
    let far = kinematic(log(100, 40, |_, _| 6.0));
    let narrow = |logs: u64| {
        let logs: Vec<_> = (0..logs)
            .map(|seed| kinematic(sound(seed, 120 / logs as usize)))
            .collect();
        fit_logs(config("kinematic"), &logs)
    };
    let one = narrow(1);
    assert_eq!(one.calibration().unit, Unit::Block);
    assert_eq!(one.calibration().units[1].name, "log 0, block 2");
    // Blocks of a log are one stretch all the same.
    assert_eq!(one.calibration().tests[0].len(), 1);
    let unlike = judge(&one, &far);
    assert_eq!((unlike.verdict, unlike.basis.groups), (Verdict::Unlike, 1));
    assert!(unlike.notes[0].contains("6 contiguous blocks"));
    assert_eq!(unlike.basis.measured_alarms().len(), 3);
    // The trusted log itself.
    assert_eq!(
        judge(&one, &kinematic(sound(0, 120))).verdict,
        Verdict::Like
    );
    for (logs, provisional) in [(2, true), (3, false)] {
        let verdict = judge(&narrow(logs), &far);
        assert_eq!(verdict.verdict, Verdict::OutOfDistribution);
        assert_eq!(
            (verdict.basis.provisional, verdict.basis.groups),
            (provisional, logs as usize)
        );
    }
}

#[test]
fn files_without_an_order_of_windows_are_still_read() {
    let detector = trusted("kinematic,differences", 6, 40);
    let mut old = serde_json::to_value(&detector).unwrap();
    let config = old["config"].as_object_mut().unwrap();
    config.remove("keep_all");
    let calibration = old["calibration"].as_object_mut().unwrap();
    calibration.remove("tests");
    calibration.remove("audit");
    for unit in calibration["units"].as_array_mut().unwrap() {
        unit.as_object_mut().unwrap().remove("left_out");
    }
    let old: DetectorStatistics = serde_json::from_value(old).unwrap();
    let rows = log(100, 40, |w, _| if w >= 30 { 5.0 } else { 0.0 });
    let (before, now) = (judge(&old, &rows), judge(&detector, &rows));
    assert!(
        before.notes[0].contains("older version"),
        "{:?}",
        before.notes
    );
    assert!(before.verdict.is_ood() && before.p_value >= now.p_value);
    assert_eq!(before.window_scores, now.window_scores);
    assert!(!judge(&old, &sound(101, 40)).verdict.is_ood());
}

#[test]
fn the_same_for_any_number_of_threads() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let detector = trusted("kinematic/differences", 6, 30);
            let verdict = judge(&detector, &log(100, 30, |_, _| 0.5));
            serde_json::to_string(&(detector, verdict)).unwrap()
        })
    };
    assert_eq!(with(1), with(4));
}

/// Each audit may drop a sound group by chance, after which more of the sound logs are called.
#[test]
fn alarms_on_sound_logs_stay_near_alpha() {
    let mut alarms = 0;
    for statistics in ["kinematic,differences", "kinematic/differences"] {
        for seed in 0..4 {
            let logs: Vec<_> = (0..10).map(|i| sound(1000 * seed + i, 40)).collect();
            let detector = fit_logs(config(statistics), &logs);
            let of = |i: u64| judge(&detector, &sound(1000 * seed + 100 + i, 40));
            alarms += (0..50).filter(|&i| of(i).verdict.is_ood()).count();
        }
    }
    assert!(alarms <= 30, "{alarms} of 400");
}
