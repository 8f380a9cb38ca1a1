//! Calibration, verdicts and storage of the statistical part of a detector.

use dose3_ood::calibration::cross_fit;
use dose3_ood::density::{Components, GaussianMixtureParams};
use dose3_ood::detector::{Densities, DetectorConfig, DetectorStatistics, Rule};
use dose3_ood::{Combination, DensityConfig, Folds, Score, Statistic, Unit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Windows of one log: 24 columns that follow a slow common motion, an own offset of the log, and
/// noise. `shift` moves the columns of the last group, rotation z.
fn log(seed: u64, windows: usize, shift: f64) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || rng.sample::<f64, _>(StandardNormal);
    let offset = 0.3 * normal();
    let mut slow = normal();
    (0..windows)
        .map(|_| {
            slow = 0.9 * slow + 0.4 * normal();
            (0..24)
                .map(|column| {
                    let moved = if column >= 18 { shift } else { 0.0 };
                    slow * f64::from(column % 3) + offset + 0.5 * normal() + moved
                })
                .collect()
        })
        .collect()
}

fn trusted(logs: usize, windows: usize) -> (Vec<Vec<f64>>, Vec<usize>, Vec<String>) {
    let rows = (0..logs)
        .flat_map(|l| log(l as u64, windows, 0.0))
        .collect();
    let of = (0..logs * windows).map(|i| i / windows).collect();
    (rows, of, (0..logs).map(|l| format!("log {l}")).collect())
}

fn config(combination: Combination) -> DetectorConfig {
    DetectorConfig {
        density: DensityConfig::Mixture(GaussianMixtureParams {
            components: Components::Fixed(2),
            ..GaussianMixtureParams::default()
        }),
        combination,
        seed: 11,
        ..DetectorConfig::default()
    }
}

fn fit(config: DetectorConfig, logs: usize, windows: usize) -> DetectorStatistics {
    let (rows, of, names) = trusted(logs, windows);
    DetectorStatistics::fit(config, &rows, &of, &names).unwrap()
}

#[test]
fn a_held_out_log_passes_and_a_shifted_one_does_not() {
    for combination in Combination::ALL {
        let detector = fit(config(combination), 10, 40);
        let unseen = detector.judge(&log(100, 40, 0.0)).unwrap();
        assert!(!unseen.verdict.is_ood(), "{combination}: {unseen:?}");
        let shifted = detector.judge(&log(101, 40, 4.0)).unwrap();
        assert!(shifted.verdict.is_ood(), "{combination}: {shifted:?}");
        assert_eq!(
            shifted.contributions[0].group, "paper24.rotation_z",
            "{combination}"
        );
        assert!(shifted.contributions[0].excess > 1.0);
        assert!(shifted.contributions[0].p_value <= 1.0 / 401.0 + 1e-12);
        assert!(shifted.contributions[1].excess < shifted.contributions[0].excess);
        assert!(shifted.share_beyond > 0.9 && shifted.share_p_value < 0.05);
    }
}

#[test]
fn a_finer_alpha_than_the_logs_allow_is_said_and_decided_by_share() {
    let detector = fit(config(Combination::Joint), 10, 40);
    let verdict = detector.judge(&log(101, 40, 4.0)).unwrap();
    assert_eq!(verdict.rule, Rule::Share);
    assert_eq!(verdict.smallest_p_value, 1.0 / 11.0);
    assert_eq!(verdict.p_value, 1.0 / 11.0);
    assert!(verdict.p_value > verdict.alpha && verdict.verdict.is_ood());
    let said = verdict
        .notes
        .iter()
        .any(|n| n.contains("1/11") && n.contains("10 trusted logs"));
    assert!(said, "{:?}", verdict.notes);
    let limit = verdict.share_limit.unwrap();
    assert!(limit > 0.05 && limit < verdict.share_beyond);

    // At alpha = 0.1 the p-value can decide, and needs no note.
    let coarse = detector.judge_at(&log(101, 40, 4.0), 0.1).unwrap();
    assert_eq!((coarse.rule, coarse.verdict.is_ood()), (Rule::PValue, true));
    assert!(coarse.notes.is_empty(), "{:?}", coarse.notes);
    // A log with fewer windows than any trusted one goes by its share all the same.
    let short = detector.judge_at(&log(102, 12, 0.0), 0.1).unwrap();
    assert_eq!((short.rule, short.verdict.is_ood()), (Rule::Share, false));
    assert!(short.notes[0].contains("12 windows"), "{:?}", short.notes);
    assert!(detector.judge_at(&log(1, 5, 0.0), 0.0).is_err());
    assert!(detector.judge(&[]).is_err());
    assert!(detector.judge(&[vec![0.0; 23]]).is_err());
    assert!(detector.judge(&[vec![f64::NAN; 24]]).is_err());
}

#[test]
fn one_window_is_judged_by_its_p_value() {
    let detector = fit(config(Combination::Joint), 10, 40);
    let inside = detector.judge(&log(200, 1, 0.0)).unwrap();
    assert_eq!(
        (inside.rule, inside.verdict.is_ood(), inside.windows),
        (Rule::Window, false, 1)
    );
    let outside = detector.judge(&log(201, 1, 6.0)).unwrap();
    assert_eq!(
        (outside.rule, outside.verdict.is_ood()),
        (Rule::Window, true)
    );
    assert_eq!(outside.window_p_values, [1.0 / 401.0]);
    // Four windows overlap into one; one of them in range is enough to pass.
    let mut mixed = log(202, 3, 6.0);
    mixed.extend(log(200, 1, 0.0));
    let mixed = detector.judge(&mixed).unwrap();
    assert_eq!((mixed.rule, mixed.verdict.is_ood()), (Rule::Window, false));
    // Finer than the windows allow: said, and nothing is called OOD.
    let fine = detector.judge_at(&log(201, 1, 6.0), 1e-4).unwrap();
    assert!(
        !fine.verdict.is_ood() && fine.notes.iter().any(|n| n.contains("0.0025")),
        "{:?}",
        fine.notes
    );
}

#[test]
fn where_no_share_is_rare_enough_each_window_has_to_be() {
    // Six trusted logs, one of them unlike the rest: held out, all its windows are beyond, so eight
    // windows (two without overlap) beyond are no rarity at alpha = 0.05.
    let (mut rows, of, names) = trusted(6, 30);
    rows.splice(150.., log(5, 30, 5.0));
    let detector = DetectorStatistics::fit(config(Combination::Joint), &rows, &of, &names).unwrap();
    assert_eq!(detector.calibration().units[5].beyond, 30);
    let mut faulty = log(300, 8, -30.0);
    let verdict = detector.judge_at(&faulty, 0.02).unwrap();
    assert_eq!((verdict.rule, verdict.share_limit), (Rule::Window, None));
    assert!(
        verdict.verdict.is_ood() && verdict.beyond == 8,
        "{verdict:?}"
    );
    assert!(
        verdict
            .notes
            .iter()
            .any(|n| n.contains("no share of 8 windows")),
        "{:?}",
        verdict.notes
    );
    faulty[3] = log(301, 1, 0.0).remove(0);
    assert!(!detector.judge_at(&faulty, 0.02).unwrap().verdict.is_ood());
}

#[test]
fn one_far_window_rejects_a_long_log() {
    let detector = fit(config(Combination::Joint), 10, 40);
    let mut log = log(100, 40, 0.0);
    let sound = detector.judge(&log).unwrap();
    assert!(
        !sound.verdict.is_ood() && sound.worst_p_value > 0.025,
        "{sound:?}"
    );
    // Neither the mean over 40 windows nor a share of one in 40 would show it.
    log[17] = crate::log(101, 1, 30.0).remove(0);
    let verdict = detector.judge(&log).unwrap();
    assert_eq!(
        (verdict.rule, verdict.verdict.is_ood()),
        (Rule::Worst, true)
    );
    assert!(verdict.worst_p_value <= Rule::WORST_SHARE * 0.05 && verdict.share_p_value > 0.05);
}

#[test]
fn one_or_two_trusted_logs_are_cut_and_it_is_said() {
    for logs in [1, 2] {
        let detector = fit(config(Combination::Joint), logs, 120 / logs);
        let calibration = detector.calibration();
        assert_eq!((calibration.unit, calibration.logs), (Unit::Block, logs));
        assert_eq!(calibration.units.len(), 6);
        assert_eq!(calibration.units[1].name, "log 0, block 2");
        let shifted = detector.judge(&log(101, 40, 6.0)).unwrap();
        assert!(
            shifted.verdict.is_ood() && shifted.rule == Rule::Share,
            "{shifted:?}"
        );
        assert_eq!(shifted.p_value, 1.0 / (logs + 1) as f64);
        assert!(
            shifted
                .notes
                .iter()
                .any(|n| n.contains("6 contiguous blocks"))
        );
        // The data that were trusted are trusted.
        assert!(
            !detector
                .judge(&trusted(logs, 120 / logs).0)
                .unwrap()
                .verdict
                .is_ood()
        );
        // One log cannot support any alpha, and says so.
        let fine = detector.judge_at(&log(101, 40, 6.0), 1e-4).unwrap();
        assert!(!fine.verdict.is_ood() && fine.share_limit.is_none());
        assert!(
            fine.notes
                .iter()
                .any(|n| n.contains("nothing can be called OOD")),
            "{:?}",
            fine.notes
        );
    }
    let (rows, of, names) = trusted(1, 5);
    assert!(DetectorStatistics::fit(config(Combination::Joint), &rows, &of, &names).is_err());
}

#[test]
fn held_out_scores_are_those_of_a_fit_without_the_log() {
    let (rows, of, _) = trusted(4, 30);
    let density = config(Combination::Joint).density;
    let found = cross_fit(&rows, &of, &density, Folds::LeaveOneLogOut, 4).unwrap();
    let without_last = dose3_ood::DensityModel::fit(&rows[..90], &of[..90], &density).unwrap();
    for (row, score) in rows[90..].iter().zip(&found.scores[90..]) {
        assert_eq!(without_last.score(row).unwrap(), *score);
    }
    // Scores of rows that the fit has seen are lower: that is why they are held out.
    let seen = dose3_ood::DensityModel::fit(&rows, &of, &density).unwrap();
    let seen = Score::mean(&seen.scores(&rows).unwrap());
    assert!(seen < Score::mean(&found.scores));
    // A log's blocks: no row is missing.
    let blocks = cross_fit(&rows[..30], &of[..30], &density, Folds::Auto, 2).unwrap();
    assert_eq!((blocks.scores.len(), blocks.plan.unit()), (30, Unit::Block));
}

#[test]
fn false_alarms_of_windows_stay_near_their_alpha() {
    let detector = fit(config(Combination::Joint), 12, 40);
    let mut beyond = 0;
    for seed in 0..60 {
        beyond += detector.judge(&log(1000 + seed, 40, 0.0)).unwrap().beyond;
    }
    let share = beyond as f64 / 2400.0;
    assert!((0.02..0.08).contains(&share), "{share}");
}

#[test]
fn false_alarms_of_logs_stay_near_alpha_for_every_combination() {
    for combination in Combination::ALL {
        let detector = fit(config(combination), 12, 40);
        let alarm = |seed: u64| {
            usize::from(
                detector
                    .judge(&log(1000 + seed, 40, 0.0))
                    .unwrap()
                    .verdict
                    .is_ood(),
            )
        };
        let alarms: usize = (0..100).map(alarm).sum();
        assert!(alarms <= 12, "{combination}: {alarms} of 100");
    }
}

#[test]
fn json_round_trips_bit_by_bit() {
    for combination in Combination::ALL {
        let detector = fit(config(combination), 5, 20);
        let text = serde_json::to_string(&detector).unwrap();
        let read: DetectorStatistics = serde_json::from_str(&text).unwrap();
        assert_eq!(read, detector);
        assert_eq!(serde_json::to_string(&read).unwrap(), text);
        let rows = log(7, 10, 1.0 / 3.0);
        let bits = |d: &DetectorStatistics| -> Vec<u64> {
            let scores = d.window_scores(&rows).unwrap();
            scores.iter().map(|s| s.value().to_bits()).collect()
        };
        assert_eq!(bits(&read), bits(&detector));
        let verdict = detector.judge(&rows).unwrap();
        let text = serde_json::to_string(&verdict).unwrap();
        assert_eq!(
            serde_json::from_str::<dose3_ood::LogVerdict>(&text).unwrap(),
            verdict
        );
    }
}

#[test]
fn the_same_for_any_number_of_threads() {
    for combination in [Combination::Joint, Combination::Fisher] {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            let detector = pool.install(|| fit(config(combination), 6, 30));
            serde_json::to_string(&detector).unwrap()
        };
        assert_eq!(with(1), with(4));
    }
}

#[test]
fn a_broken_file_is_an_error_that_names_the_part() {
    let good = serde_json::to_value(fit(config(Combination::Joint), 5, 20)).unwrap();
    assert!(serde_json::from_value::<DetectorStatistics>(good.clone()).is_ok());
    for (pointer, value, part) in [
        ("/config/alpha", serde_json::json!(2.0), "alpha"),
        ("/config/draws", serde_json::json!(0), "draws"),
        ("/config/statistics", serde_json::json!("paper12"), "names"),
        (
            "/config/statistics",
            serde_json::json!("nothing"),
            "unknown statistic",
        ),
        (
            "/config/combination",
            serde_json::json!("fisher"),
            "densities",
        ),
        ("/names/3", serde_json::json!("x"), "names"),
        ("/groups/0/columns", serde_json::json!([0]), "groups"),
        (
            "/calibration/threshold",
            serde_json::json!(1.0),
            "threshold",
        ),
        ("/calibration/logs", serde_json::json!(4), "number of logs"),
        (
            "/calibration/units/0/windows",
            serde_json::json!(3),
            "add up",
        ),
        (
            "/calibration/units/0/beyond",
            serde_json::json!(30),
            "beyond",
        ),
        ("/calibration/windows/0", serde_json::json!(null), "null"),
        (
            "/calibration/windows",
            serde_json::json!([1.0]),
            "differ in number",
        ),
        (
            "/densities",
            serde_json::json!({"per-group": []}),
            "combination",
        ),
    ] {
        let mut bad = good.clone();
        *bad.pointer_mut(pointer).unwrap() = value;
        let error = serde_json::from_value::<DetectorStatistics>(bad).unwrap_err();
        assert!(error.to_string().contains(part), "{pointer}: {error}");
    }
}

#[test]
fn bad_fits_are_errors() {
    let (rows, of, names) = trusted(4, 20);
    let with = |change: &dyn Fn(&mut DetectorConfig)| {
        let mut config = config(Combination::Joint);
        change(&mut config);
        DetectorStatistics::fit(config, &rows, &of, &names).map(|_| ())
    };
    assert!(with(&|_| {}).is_ok());
    assert!(with(&|c| c.alpha = 0.0).is_err());
    assert!(with(&|c| c.window_alpha = f64::NAN).is_err());
    assert!(with(&|c| c.overlap = 0).is_err());
    assert!(with(&|c| c.draws = 0).is_err());
    assert!(with(&|c| c.folds = Folds::K(1)).is_err());
    assert!(with(&|c| c.statistics = Statistic::Paper12.into()).is_err());
    assert!(with(&|c| c.density = "mixture:0".parse().unwrap()).is_err());
    let config = config(Combination::Joint);
    assert!(DetectorStatistics::fit(config.clone(), &rows, &of[1..], &names).is_err());
    assert!(DetectorStatistics::fit(config.clone(), &rows, &of, &names[..3]).is_err());
    assert!(DetectorStatistics::fit(config, &[], &[], &names).is_err());
}

#[test]
fn every_density_and_combination_makes_a_detector() {
    for density in ["mixture:auto", "mixture:2:diagonal", "kernel", "neighbours"] {
        for combination in Combination::ALL {
            let detector = fit(
                DetectorConfig {
                    density: density.parse().unwrap(),
                    ..config(combination)
                },
                5,
                30,
            );
            let joint = matches!(detector.densities(), Densities::Joint(_));
            assert_eq!(joint, combination == Combination::Joint);
            assert!(
                detector.judge(&log(101, 30, 8.0)).unwrap().verdict.is_ood(),
                "{density} {combination}"
            );
            assert!(
                !detector.judge(&log(100, 30, 0.0)).unwrap().verdict.is_ood(),
                "{density} {combination}"
            );
        }
    }
}

/// One trusted log, so short that a density fitted without one of its blocks knows next to nothing:
/// held out, its windows score thousands of times worse than any new window under the density of all
/// of them, and every p-value of a block is 1.
#[test]
fn several_blocks_tell_windows_apart_after_one_short_log() {
    let widths = [36, 36];
    let windows = |seed: u64, count: usize, shift: f64| -> Vec<Vec<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut slow = 0.0;
        (0..count)
            .map(|_| {
                // The log wanders: its first windows say little of its last ones.
                slow += 0.3;
                (0..widths.iter().sum())
                    .map(|column| {
                        let noise = rng.sample::<f64, _>(StandardNormal);
                        slow * f64::from(column % 5) + 0.02 * noise + shift
                    })
                    .collect()
            })
            .collect()
    };
    let auroc = |set: &str, combination: Combination| {
        let config = DetectorConfig {
            statistics: set.parse().unwrap(),
            combination,
            overlap: 20,
            seed: 11,
            ..DetectorConfig::default()
        };
        let columns = config.statistics.dimension();
        let of = |rows: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            rows.into_iter()
                .map(|row| row[..columns].to_vec())
                .collect()
        };
        let trusted = of(windows(1, 52, 0.0));
        let detector =
            DetectorStatistics::fit(config, &trusted, &[0; 52], &["log".into()]).unwrap();
        let inside = detector.window_scores(&of(windows(2, 52, 0.0))).unwrap();
        let outside = detector.window_scores(&of(windows(3, 52, 0.5))).unwrap();
        if combination != Combination::Joint {
            // The p-values that are reported promise no more than they did.
            let verdict = detector.judge(&of(windows(3, 52, 0.5))).unwrap();
            assert!(verdict.contributions.iter().all(|c| c.p_value == 1.0));
        }
        dose3_ood::metrics::auroc(&inside, &outside).unwrap()
    };
    assert_eq!(auroc("kinematic", Combination::Joint), 1.0);
    for combination in [
        Combination::Fisher,
        Combination::HarmonicMean,
        Combination::Maximum,
    ] {
        let found = auroc("kinematic,differences", combination);
        assert!(found > 0.99, "{combination}: {found}");
    }
}
