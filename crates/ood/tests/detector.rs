//! Calibration, verdicts and storage of the statistical part of a detector.

use dose3_ood::calibration::cross_fit;
use dose3_ood::density::{Components, GaussianMixtureParams};
use dose3_ood::detector::{Densities, DetectorConfig, DetectorStatistics, Place};
use dose3_ood::{Combination, DensityConfig, Folds, LogVerdict, Score, Statistic, Unit, Verdict};
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
    DetectorStatistics::fit(config, &rows, &Place::of_logs(&of), &names).unwrap()
}

/// The verdict on a log without gaps.
fn judge(detector: &DetectorStatistics, rows: &[Vec<f64>]) -> LogVerdict {
    detector.judge(rows, &vec![0; rows.len()]).unwrap()
}

#[test]
fn a_held_out_log_passes_and_a_shifted_one_does_not() {
    for combination in Combination::ALL {
        let detector = fit(config(combination), 10, 40);
        let unseen = judge(&detector, &log(100, 40, 0.0));
        assert!(!unseen.verdict.is_ood(), "{combination}: {unseen:?}");
        let shifted = judge(&detector, &log(101, 40, 4.0));
        assert!(shifted.verdict.is_ood(), "{combination}: {shifted:?}");
        assert_eq!(
            shifted.contributions[0].group, "paper24.rotation_z",
            "{combination}"
        );
        assert!(shifted.contributions[0].excess > 1.0);
        assert!(shifted.contributions[0].p_value <= 0.01);
        assert!(shifted.contributions[1].excess < shifted.contributions[0].excess);
        assert!(shifted.share_beyond > 0.9 && shifted.excess > 1.0);
    }
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
        beyond += judge(&detector, &log(1000 + seed, 40, 0.0)).beyond;
    }
    let share = beyond as f64 / 2400.0;
    assert!((0.02..0.08).contains(&share), "{share}");
}

#[test]
fn false_alarms_of_logs_stay_near_alpha_for_every_combination() {
    for combination in Combination::ALL {
        // Without the audit, which may drop the most extreme of twelve logs that do differ.
        let config = DetectorConfig {
            keep_all: true,
            ..config(combination)
        };
        let detector = fit(config, 12, 40);
        let alarm = |seed: u64| {
            usize::from(
                judge(&detector, &log(1000 + seed, 40, 0.0))
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
        let verdict = judge(&detector, &rows);
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
        ("/calibration/windows", serde_json::json!([1.0]), "add up"),
        (
            "/calibration/tests/0/0/scores",
            serde_json::json!([1.0]),
            "stretches",
        ),
        (
            "/calibration/tests",
            serde_json::json!([[], []]),
            "tests of the settings",
        ),
        (
            "/calibration/units/1/left_out",
            serde_json::json!(true),
            "add up",
        ),
        ("/config/shares", serde_json::json!([0.5, 0.5]), "shares"),
        (
            "/config/durations",
            serde_json::json!([{"windows": 0, "weight": 1.0}]),
            "durations",
        ),
        (
            "/densities",
            serde_json::json!({"per-group": []}),
            "combination",
        ),
    ] {
        let mut bad = good.clone();
        match bad.pointer_mut(pointer) {
            Some(place) => *place = value,
            None => bad["config"][pointer.trim_start_matches("/config/")] = value,
        }
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
        DetectorStatistics::fit(config, &rows, &Place::of_logs(&of), &names).map(|_| ())
    };
    assert!(with(&|_| {}).is_ok());
    assert!(with(&|c| c.alpha = 0.0).is_err());
    assert!(with(&|c| c.window_alpha = f64::NAN).is_err());
    assert!(with(&|c| c.overlap = 0).is_err());
    assert!(with(&|c| c.draws = 0).is_err());
    assert!(with(&|c| c.folds = Folds::K(1)).is_err());
    assert!(with(&|c| c.shares = Some(vec![0.9])).is_err());
    assert!(with(&|c| c.shares = Some(vec![f64::NAN])).is_err());
    assert!(with(&|c| c.durations = Some(vec![])).is_err());
    assert!(with(&|c| c.statistics = Statistic::Paper12.into()).is_err());
    assert!(with(&|c| c.density = "mixture:0".parse().unwrap()).is_err());
    let config = config(Combination::Joint);
    assert!(
        DetectorStatistics::fit(config.clone(), &rows, &Place::of_logs(&of[1..]), &names).is_err()
    );
    assert!(
        DetectorStatistics::fit(config.clone(), &rows, &Place::of_logs(&of), &names[..3]).is_err()
    );
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
                judge(&detector, &log(101, 30, 8.0)).verdict.is_ood(),
                "{density} {combination}"
            );
            assert!(
                !judge(&detector, &log(100, 30, 0.0)).verdict.is_ood(),
                "{density} {combination}"
            );
        }
    }
}

/// One trusted log, so short that a density fitted without one of its blocks knows next to nothing:
/// held out, its windows score far worse than new windows under the density of all of them.
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
            DetectorStatistics::fit(config, &trusted, &Place::of_logs(&[0; 52]), &["log".into()])
                .unwrap();
        let inside = detector.window_scores(&of(windows(2, 52, 0.0))).unwrap();
        let outside = detector.window_scores(&of(windows(3, 52, 0.5))).unwrap();
        if combination != Combination::Joint {
            let of_log = |seed, shift| judge(&detector, &of(windows(seed, 52, shift))).verdict;
            assert_eq!(of_log(2, 0.0), Verdict::Like);
            assert_eq!(of_log(3, 1.0), Verdict::Unlike);
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
