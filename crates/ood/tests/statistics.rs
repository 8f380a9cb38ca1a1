//! Sets of statistics: names, groups, unions, hand-computed values.

use dose3_ood::statistics::{AXES, BANDS, CHANNELS, LinearPredictor};
use dose3_ood::{Error, PoseWindow, Sample, Statistic, StatisticsSet, Trace, TraceSummary};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::HashSet;

#[path = "../src/property_cases.rs"]
mod property_cases;

use property_cases::cases;

const STEPS: usize = 12;
const LENGTH: usize = 16;

fn noise(seed: u64, count: usize) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| rng.random_range(-1.0..1.0)).collect()
}

fn set(text: &str) -> StatisticsSet {
    text.parse().unwrap()
}

fn value(set: &StatisticsSet, values: &[f64], name: &str) -> f64 {
    let index = set.names().iter().position(|n| n == name);
    values[index.unwrap_or_else(|| panic!("no column {name}"))]
}

#[test]
fn every_statistic_has_as_many_names_as_values_and_they_differ() {
    let eps_hat = noise(1, STEPS * LENGTH * CHANNELS);
    let eps = noise(2, LENGTH * CHANNELS);
    let summary = TraceSummary::of(&Trace {
        steps: STEPS,
        length: LENGTH,
        eps_hat: &eps_hat,
        eps: &eps,
    })
    .unwrap();
    let (translation, tangent) = (noise(3, LENGTH * 3), noise(4, LENGTH * 3));
    let increments: Vec<f64> = noise(5, LENGTH * 6).iter().map(|&v| f64::from(v)).collect();
    let predictor = LinearPredictor::fit(&[&increments]).unwrap();
    let sample = Sample {
        traces: &[summary],
        window: Some(PoseWindow {
            translation: &translation,
            tangent: &tangent,
        }),
        increments: Some(&increments),
        linear: Some(&predictor),
        joint: None,
    };
    let sizes = [24, 12, 6, 6, 1, 36, 72, 36, 36, 24, 36, 36, 36, 28];
    // Those of the joint network have a test of their own.
    let alone: Vec<Statistic> = Statistic::ALL
        .into_iter()
        .filter(|statistic| !StatisticsSet::from(*statistic).needs_joint())
        .collect();
    assert_eq!(alone.len(), sizes.len());
    for (statistic, size) in alone.into_iter().zip(sizes) {
        let set = StatisticsSet::from(statistic);
        let values = set.evaluate(&sample).unwrap();
        assert_eq!(
            (set.dimension(), values.len(), set.names().len()),
            (size, size, size)
        );
        let distinct: HashSet<String> = set.names().into_iter().collect();
        assert_eq!(distinct.len(), size);
        let mut columns: Vec<usize> = set.groups().into_iter().flat_map(|g| g.columns).collect();
        columns.sort_unstable();
        assert_eq!(columns, (0..size).collect::<Vec<_>>());
        assert_eq!(statistic.name().parse::<Statistic>().unwrap(), statistic);
        let text = serde_json::to_string(&statistic).unwrap();
        assert_eq!(text, format!("\"{}\"", statistic.name()));
    }
    assert_eq!(
        set("kinematic+residual+change")
            .evaluate(&sample)
            .unwrap()
            .len(),
        108
    );
}

#[test]
fn paper_sets_by_hand() {
    // Two steps of one pose: eps_hat = a, then b, per channel.
    let a = [1.0, 2.0, 3.0, 0.5, -1.0, 2.0];
    let b = [2.0, 2.0, 0.0, 1.5, -1.0, -2.0];
    let eps_hat: Vec<f32> = a.iter().chain(&b).map(|&v: &f64| v as f32).collect();
    let trace = Trace {
        steps: 2,
        length: 1,
        eps_hat: &eps_hat,
        eps: &[0.0; 6],
    };
    let paper = set("paper24");
    let values = paper.compute(&trace).unwrap();
    let of = |name: &str| value(&paper, &values, name);
    let near =
        |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    near(of("translation.sum_eps^1"), 6.0 / 3.0 + 4.0 / 3.0);
    near(of("translation.sum_eps^2"), 14.0 / 3.0 + 8.0 / 3.0);
    near(of("translation.sum_eps^3"), 36.0 / 3.0 + 16.0 / 3.0);
    near(of("translation.sum_deps^1"), -2.0 / 3.0);
    near(of("translation.sum_deps^2"), 10.0 / 3.0);
    near(of("translation.sum_deps^3"), -26.0 / 3.0);
    near(of("rotation_z.sum_eps^3"), 0.0);
    near(of("rotation_z.sum_deps^3"), -64.0);
    near(of("rotation_y.sum_eps^2"), 2.0);
    near(of("rotation_x.sum_eps^1"), 2.0);

    let pooled = set("paper12");
    let values = pooled.compute(&trace).unwrap();
    near(
        value(&pooled, &values, "rotation.sum_eps^1"),
        (0.5 - 1.0 + 2.0 + 1.5 - 1.0 - 2.0) / 3.0,
    );
    near(value(&pooled, &values, "rotation.sum_deps^2"), 17.0 / 3.0);
    assert_eq!(
        set("r3").compute(&trace).unwrap(),
        paper.compute(&trace).unwrap()[..6]
    );
    let all = set("diffpath6");
    let values = all.compute(&trace).unwrap();
    near(
        value(&all, &values, "pose.sum_deps^1"),
        (1.0 - 3.0 + 1.0 - 4.0) / 6.0,
    );

    let names: Vec<String> = paper.groups().into_iter().map(|g| g.name).collect();
    let expected = ["translation", "rotation_x", "rotation_y", "rotation_z"];
    assert_eq!(names, expected.map(|part| format!("paper24.{part}")));
    assert_eq!(paper.groups()[3].columns, (18..24).collect::<Vec<_>>());
}

#[test]
fn diffpath_by_hand() {
    // Three steps of two poses; channel c of pose i is t^2 (1 + i) on the first and last axis, else 1.
    let mut eps_hat = Vec::new();
    for t in 0..3_i16 {
        for i in 0..2_i16 {
            let moving = f32::from(t * t * (1 + i));
            eps_hat.extend([moving, 1.0, 1.0, 1.0, 1.0, moving]);
        }
    }
    let trace = Trace {
        steps: 3,
        length: 2,
        eps_hat: &eps_hat,
        eps: &[0.0; 12],
    };
    // Changes 1 and 3 of pose 0, 2 and 6 of pose 1, on two axes: 2 (1 + 9 + 4 + 36) = 100.
    let values = set("diffpath1").compute(&trace).unwrap();
    assert_eq!(values.len(), 1);
    assert!((values[0] - 10.0).abs() < 1e-12, "{values:?}");

    // Sums of the first three powers of eps and of its changes, divided by the 12 numbers of a step.
    let six = set("diffpath6").compute(&trace).unwrap();
    let sums = [54.0, 194.0, 1194.0, 24.0, 100.0, 504.0];
    for (value, sum) in six.iter().zip(sums) {
        assert!((value * 12.0 - sum).abs() < 1e-9, "{six:?}");
    }
    assert!(set("diffpath1").needs_rotation_trace() && !set("diffpath1").needs_noise());
    assert!(set("diffpath1,residual").needs_noise());
    assert_eq!(set("diffpath6+diffpath1").dimension(), 7);
}

#[test]
fn banded_sets_by_hand() {
    // One pose; step t of 7: eps_hat = t on every axis but rotation y, which follows the noise.
    let eps = [0.5_f32; 6];
    let mut eps_hat = Vec::new();
    for t in 0..7 {
        eps_hat.extend([t as f32, t as f32, t as f32, t as f32, 0.5, t as f32]);
    }
    let trace = Trace {
        steps: 7,
        length: 1,
        eps_hat: &eps_hat,
        eps: &eps,
    };
    // 7 steps in 6 bands: band 0 holds steps 0 and 1, then one each.
    let residual = set("residual");
    let values = residual.compute(&trace).unwrap();
    let of = |name: &str| value(&residual, &values, name);
    assert!((of("translation_x.log_residual.band_0") - 0.25_f64.ln()).abs() < 1e-12);
    assert!((of("rotation_z.log_residual.band_5") - 30.25_f64.ln()).abs() < 1e-12);
    assert!((of("rotation_y.log_residual.band_3") - 1e-12_f64.ln()).abs() < 1e-9);

    let mean = set("eps-mean");
    let values = mean.compute(&trace).unwrap();
    assert_eq!(value(&mean, &values, "translation_y.mean_eps.band_0"), 0.5);
    assert_eq!(value(&mean, &values, "translation_y.mean_eps.band_5"), 6.0);

    // 6 changes of 1, one in each band.
    let change = set("change");
    let values = change.compute(&trace).unwrap();
    for band in 0..BANDS {
        for axis in AXES {
            let expected = if axis == "rotation_y" {
                1e-12_f64.ln()
            } else {
                0.0
            };
            let name = format!("{axis}.log_change.band_{band}");
            assert!(
                (value(&change, &values, &name) - expected).abs() < 1e-9,
                "{name}"
            );
        }
    }
}

#[test]
fn one_bad_pose_moves_the_maximum_more_than_the_mean() {
    let eps = noise(7, 128 * CHANNELS);
    let mut eps_hat = Vec::new();
    for step in 0..STEPS {
        let error = noise(100 + step as u64, 128 * CHANNELS);
        eps_hat.extend(eps.iter().zip(&error).map(|(e, r)| e + 0.3 * r));
    }
    let both = set("residual+residual-quantiles");
    let of = |eps_hat: &[f32]| {
        let trace = Trace {
            steps: STEPS,
            length: 128,
            eps_hat,
            eps: &eps,
        };
        both.compute(&trace).unwrap()
    };
    let clean = of(&eps_hat);
    for step in 0..STEPS {
        eps_hat[(step * 128 + 64) * CHANNELS] += 1.0;
    }
    let faulty = of(&eps_hat);
    let moved = |name: &str| value(&both, &faulty, name) - value(&both, &clean, name);
    let mean = moved("translation_x.log_residual.band_2");
    let max = moved("translation_x.log_residual_max.band_2");
    assert!(mean > 0.0 && max > 3.0 * mean, "{mean} {max}");
    assert!(moved("translation_y.log_residual_max.band_2").abs() < 1e-12);
}

#[test]
fn draws_are_averaged_and_what_is_missing_is_named() {
    let of = |seed: u64| {
        let eps_hat = noise(seed, STEPS * LENGTH * CHANNELS);
        TraceSummary::of(&Trace {
            steps: STEPS,
            length: LENGTH,
            eps_hat: &eps_hat,
            eps: &[0.0; LENGTH * CHANNELS],
        })
        .unwrap()
    };
    let draws = [of(1), of(2), of(3)];
    let set = set("paper24+change");
    let single = |i: usize| {
        let sample = Sample {
            traces: &draws[i..=i],
            ..Sample::default()
        };
        set.evaluate(&sample).unwrap()
    };
    let all = set
        .evaluate(&Sample {
            traces: &draws,
            ..Sample::default()
        })
        .unwrap();
    for (column, value) in all.iter().enumerate() {
        let mean = (single(0)[column] + single(1)[column] + single(2)[column]) / 3.0;
        assert!((value - mean).abs() < 1e-12 * mean.abs().max(1.0));
    }
    for text in ["paper24", "moments24", "kinematic"] {
        let error = self::set(text).evaluate(&Sample::default()).unwrap_err();
        assert!(matches!(error, Error::MissingInput { .. }), "{error}");
    }
    assert!(self::set("kinematic").needs_increments());
    assert!(!self::set("kinematic").needs_trace());
    for (text, rotation) in [("r3", false), ("r3+kinematic", false), ("r3+change", true)] {
        assert_eq!(self::set(text).needs_rotation_trace(), rotation, "{text}");
    }
    assert!(self::set("residual+moments24").needs_window());
}

#[test]
fn too_few_steps_for_the_bands_is_an_error_and_the_paper_sets_still_work() {
    let eps_hat = noise(1, 5 * CHANNELS);
    let trace = Trace {
        steps: 5,
        length: 1,
        eps_hat: &eps_hat,
        eps: &[0.0; 6],
    };
    assert_eq!(set("paper24").compute(&trace).unwrap().len(), 24);
    for text in ["residual", "residual-quantiles", "eps-mean", "change"] {
        let error = set(text).compute(&trace).unwrap_err();
        assert!(
            matches!(error, Error::TooFewSteps { found: 5, .. }),
            "{error}"
        );
    }
}

#[test]
fn unions_round_trip_and_repetitions_are_refused() {
    let union = set(" residual + change+eps-mean");
    assert_eq!(union.to_string(), "residual+change+eps-mean");
    let text = serde_json::to_string(&union).unwrap();
    assert_eq!(serde_json::from_str::<StatisticsSet>(&text).unwrap(), union);
    for bad in ["paper24+r3", "residual+residual", "paper24+paper12"] {
        let error = bad.parse::<StatisticsSet>().unwrap_err();
        assert!(matches!(error, Error::Overlap { .. }), "{error}");
    }
    for bad in ["", "  ", "paper25", "residual+", "+"] {
        assert!(bad.parse::<StatisticsSet>().is_err(), "{bad}");
    }
    assert!(serde_json::from_str::<StatisticsSet>("\"nothing\"").is_err());
}

proptest! {
    #![proptest_config(cases(256))]

    /// Odd moments change their sign with the estimate, even ones and errors do not.
    #[test]
    fn signs(seed in 0_u64..1000) {
        let eps_hat = noise(seed, STEPS * 4 * CHANNELS);
        let minus: Vec<f32> = eps_hat.iter().map(|v| -v).collect();
        let set = set("paper24+residual+change");
        let of = |eps_hat: &[f32]| set.compute(&Trace {
            steps: STEPS,
            length: 4,
            eps_hat,
            eps: &[0.0; 24],
        }).unwrap();
        for ((name, a), b) in set.names().iter().zip(of(&eps_hat)).zip(of(&minus)) {
            let odd = name.ends_with("^1") || name.ends_with("^3");
            let expected = if odd { -a } else { a };
            prop_assert!((b - expected).abs() < 1e-9, "{}", name);
        }
    }
}

#[test]
fn blocks_are_the_groups_and_survive_their_text() {
    let text = "kinematic,differences,residual+eps-mean";
    let blocks = set(text);
    assert_eq!(blocks.to_string(), text);
    assert_eq!(blocks.blocks(), 3);
    let groups = blocks.groups();
    let names: Vec<&str> = groups.iter().map(|g| g.name.as_str()).collect();
    assert_eq!(names, ["kinematic", "differences", "residual+eps-mean"]);
    let sizes: Vec<usize> = groups.iter().map(|g| g.columns.len()).collect();
    assert_eq!(sizes, [36, 36, 72]);
    let columns: Vec<usize> = groups.into_iter().flat_map(|g| g.columns).collect();
    assert_eq!(columns, (0..144).collect::<Vec<_>>());
    // Without a comma the parts of the members are the groups, as ever.
    assert_eq!(set("kinematic").groups().len(), 6);
    for bad in ["kinematic,", ",kinematic", "kinematic,,r3", "r3,r3"] {
        assert!(bad.parse::<StatisticsSet>().is_err(), "{bad}");
    }
}
