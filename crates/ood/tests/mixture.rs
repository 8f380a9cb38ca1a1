//! Fitting Gaussian mixtures: known mixtures, degenerate data, determinism.

use dose3_ood::density::{Components, CovarianceKind, GaussianMixtureParams, Shrinkage};
use dose3_ood::{Density, DensityConfig, DensityModel, Error};
use linfa::prelude::{DatasetBase, Fit};
use ndarray::{Array1, Array2};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(StandardNormal)
}

/// Three Gaussians in the plane: weights 0.5, 0.3, 0.2.
fn three_blobs(count: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count)
        .map(|i| {
            let (a, b) = (normal(&mut rng), normal(&mut rng));
            match i % 10 {
                0..5 => vec![a, b],
                5..8 => vec![10.0 + a, 0.5 * b + 0.8 * a],
                _ => vec![3.0 + 0.3 * a, 8.0 + 2.0 * b],
            }
        })
        .collect()
}

fn true_log_density(x: &[f64]) -> f64 {
    let normal = |u: f64, sigma: f64| {
        (-0.5 * (u / sigma).powi(2)).exp() / (sigma * std::f64::consts::TAU.sqrt())
    };
    let first = normal(x[0], 1.0) * normal(x[1], 1.0);
    let second = normal(x[0] - 10.0, 1.0) * normal(x[1] - 0.8 * (x[0] - 10.0), 0.5);
    let third = normal(x[0] - 3.0, 0.3) * normal(x[1] - 8.0, 2.0);
    (0.5 * first + 0.3 * second + 0.2 * third).ln()
}

fn params(components: usize) -> GaussianMixtureParams {
    GaussianMixtureParams {
        components: Components::Fixed(components),
        ..GaussianMixtureParams::default()
    }
}

fn fit(rows: &[Vec<f64>], params: GaussianMixtureParams) -> Result<DensityModel, Error> {
    DensityModel::fit(rows, &vec![0; rows.len()], &DensityConfig::Mixture(params))
}

fn component_count(model: &DensityModel) -> usize {
    match model {
        DensityModel::Mixture(mixture) => mixture.components().len(),
        other => panic!("asked for a mixture, got {other:?}"),
    }
}

#[test]
fn a_known_mixture_is_recovered() {
    let rows = three_blobs(3000, 1);
    let sharp = GaussianMixtureParams {
        shrinkage: Shrinkage::None,
        variance_floor: 1e-6,
        ..params(3)
    };
    let model = fit(&rows, sharp).unwrap();
    let DensityModel::Mixture(mixture) = &model else {
        panic!("asked for a mixture")
    };
    let mut weights: Vec<f64> = mixture.components().iter().map(|c| c.weight).collect();
    weights.sort_by(f64::total_cmp);
    for (weight, expected) in weights.iter().zip([0.2, 0.3, 0.5]) {
        assert!((weight - expected).abs() < 0.01, "{weights:?}");
    }
    // Held-out rows: the mean log-density comes close to that of the truth, which nothing beats.
    let test = three_blobs(3000, 2);
    let mean = |f: &dyn Fn(&[f64]) -> f64| test.iter().map(|x| f(x)).sum::<f64>() / 3000.0;
    let (found, truth) = (mean(&|x| model.log_density(x)), mean(&true_log_density));
    assert!(
        found <= truth + 1e-9 && found > truth - 0.02,
        "{found} {truth}"
    );
}

#[test]
fn one_component_is_the_gaussian_of_the_sample() {
    let rows = vec![
        vec![0.0, 1.0],
        vec![2.0, 3.0],
        vec![4.0, 1.0],
        vec![2.0, -1.0],
    ];
    let plain = GaussianMixtureParams {
        shrinkage: Shrinkage::None,
        variance_floor: 1e-12,
        ..params(1)
    };
    let model = fit(&rows, plain).unwrap();
    // Mean (2, 1), covariance 2 I.
    let expected = |x: &[f64]| {
        let squared = (x[0] - 2.0).powi(2) + (x[1] - 1.0).powi(2);
        -std::f64::consts::TAU.ln() - 2.0_f64.ln() - 0.25 * squared
    };
    for x in [[2.0, 1.0], [0.0, 0.0], [5.0, -7.0]] {
        assert!((model.log_density(&x) - expected(&x)).abs() < 1e-9);
    }
}

#[test]
fn a_far_outlier_scores_finite_and_very_low() {
    let model = fit(&three_blobs(500, 3), params(5)).unwrap();
    let inside = model.log_density(&[0.0, 0.0]);
    let mut before = inside;
    for distance in [1e2, 1e4, 1e8, 1e16, 1e40] {
        let value = model.log_density(&[distance, -distance]);
        assert!(value.is_finite() && value < before, "{distance}: {value}");
        before = value;
    }
    assert!(model.log_density(&[1e4, -1e4]) < -1e5);
    assert!(model.log_density(&[f64::INFINITY, 0.0]).is_finite());
    assert!(model.score(&[f64::INFINITY, 0.0]).is_err());
    assert!(model.score(&[f64::NAN, 0.0]).is_err());
    assert!(model.score(&[0.0]).is_err());
}

#[test]
fn outliers_among_the_trusted_rows_do_not_break_the_fit() {
    let mut rows = three_blobs(500, 4);
    rows.push(vec![1e9, 1e9]);
    rows.push(vec![-1e12, 3.0]);
    let model = fit(&rows, params(5)).unwrap();
    assert!(rows.iter().all(|row| model.log_density(row).is_finite()));
}

#[test]
fn degenerate_rows_give_a_finite_result_or_an_error() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let random: Vec<Vec<f64>> = (0..40)
        .map(|_| (0..3).map(|_| normal(&mut rng)).collect())
        .collect();
    let constant_column = random.iter().map(|r| vec![r[0], 7.0, r[1]]).collect();
    let repeated_column = random
        .iter()
        .map(|r| vec![r[0], r[0], 1e6 * r[0]])
        .collect();
    let all_equal = vec![vec![1.0, 2.0, 3.0]; 20];
    let two_values: Vec<Vec<f64>> = (0..20).map(|i| vec![f64::from(i % 2); 3]).collect();
    let wide: Vec<Vec<f64>> = (0..6)
        .map(|_| (0..24).map(|_| normal(&mut rng)).collect())
        .collect();
    for (name, rows) in [
        ("constant column", constant_column),
        ("repeated column", repeated_column),
        ("all rows equal", all_equal),
        ("two values", two_values),
        ("fewer rows than columns", wide),
    ] {
        for covariance in [CovarianceKind::Full, CovarianceKind::Diagonal] {
            for shrinkage in [
                Shrinkage::None,
                Shrinkage::LedoitWolf,
                Shrinkage::Fixed(0.5),
            ] {
                let params = GaussianMixtureParams {
                    covariance,
                    shrinkage,
                    ..params(5)
                };
                let model = fit(&rows, params).unwrap_or_else(|e| panic!("{name}: {e}"));
                let inside = model.log_density(&rows[0]);
                let outside: Vec<f64> = rows[0].iter().map(|v| v + 100.0).collect();
                let outside = model.log_density(&outside);
                assert!(inside.is_finite() && outside.is_finite(), "{name}");
                assert!(outside < inside - 10.0, "{name}: {inside} {outside}");
            }
        }
    }
}

#[test]
fn bad_rows_are_errors() {
    let nan = vec![vec![1.0, 2.0], vec![f64::NAN, 1.0], vec![0.0, 0.0]];
    let error = fit(&nan, params(1)).unwrap_err();
    assert!(matches!(error, Error::NotFinite { .. }), "{error}");
    assert!(error.to_string().contains("row 1"), "{error}");
    assert!(fit(&[], params(1)).is_err());
    assert!(fit(&[vec![]], params(1)).is_err());
    assert!(fit(&[vec![1.0]], params(1)).is_err());
    assert!(fit(&[vec![1.0], vec![1.0, 2.0]], params(1)).is_err());
    let error = fit(&three_blobs(4, 1), params(5)).unwrap_err();
    assert!(
        matches!(
            error,
            Error::TooFew {
                needed: 5,
                found: 4,
                ..
            }
        ),
        "{error}"
    );
    let mixture = DensityConfig::default();
    assert!(DensityModel::fit(&three_blobs(40, 1), &[0; 39], &mixture).is_err());
}

#[test]
fn settings_are_checked_once() {
    let base = GaussianMixtureParams::default;
    for (name, bad) in [
        ("components", params(0)),
        (
            "restarts",
            GaussianMixtureParams {
                restarts: 0,
                ..base()
            },
        ),
        (
            "iterations",
            GaussianMixtureParams {
                max_iterations: 0,
                ..base()
            },
        ),
        (
            "floor",
            GaussianMixtureParams {
                variance_floor: 0.0,
                ..base()
            },
        ),
        (
            "floor",
            GaussianMixtureParams {
                variance_floor: f64::NAN,
                ..base()
            },
        ),
        (
            "tolerance",
            GaussianMixtureParams {
                tolerance: 0.0,
                ..base()
            },
        ),
        (
            "shrinkage",
            GaussianMixtureParams {
                shrinkage: Shrinkage::Fixed(1.1),
                ..base()
            },
        ),
    ] {
        let error = bad.check().unwrap_err();
        assert!(matches!(error, Error::Parameter { .. }), "{name}: {error}");
    }
}

#[test]
fn the_number_of_components_is_chosen_by_held_out_logs() {
    let rows = three_blobs(1200, 6);
    let logs: Vec<usize> = (0..1200).map(|i| i / 200).collect();
    let auto = GaussianMixtureParams {
        components: Components::HeldOut(8),
        shrinkage: Shrinkage::None,
        ..params(1)
    };
    let config = DensityConfig::Mixture(auto);
    let model = DensityModel::fit(&rows, &logs, &config).unwrap();
    assert_eq!(component_count(&model), 3);
    let resolved = config.resolve(&rows, &logs).unwrap();
    assert_eq!(DensityModel::fit(&rows, &logs, &resolved).unwrap(), model);

    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let one: Vec<Vec<f64>> = (0..600)
        .map(|_| vec![normal(&mut rng), normal(&mut rng)])
        .collect();
    let logs: Vec<usize> = (0..600).map(|i| i / 100).collect();
    assert_eq!(
        component_count(&DensityModel::fit(&one, &logs, &config).unwrap()),
        1
    );
}

#[test]
fn restarts_start_anew_and_the_best_is_kept() {
    // A uniform square has no clusters: where a fit ends hangs on where it started.
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let rows: Vec<Vec<f64>> = (0..450)
        .map(|_| vec![rng.random::<f64>(), rng.random::<f64>()])
        .collect();
    let mean = |restarts: usize, seed: u64| {
        let model = fit(
            &rows,
            GaussianMixtureParams {
                restarts,
                seed,
                ..params(9)
            },
        )
        .unwrap();
        rows.iter().map(|r| model.log_density(r)).sum::<f64>() / 450.0
    };
    let single: Vec<f64> = (0..10).map(|seed| mean(1, seed)).collect();
    let spread = single.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        - single.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(spread > 0.005, "starts differ: {single:?}");
    for (seed, &one) in single.iter().enumerate() {
        assert!(mean(10, seed as u64) >= one - 1e-12);
    }
}

#[test]
fn the_same_for_any_number_of_threads_and_through_json() {
    let rows = three_blobs(700, 9);
    let logs: Vec<usize> = (0..700).map(|i| i / 100).collect();
    for text in ["mixture", "mixture:auto", "kernel", "neighbours"] {
        let config: DensityConfig = text.parse().unwrap();
        let with_threads = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            let model = pool
                .install(|| DensityModel::fit(&rows, &logs, &config))
                .unwrap();
            serde_json::to_string(&model).unwrap()
        };
        let text = with_threads(1);
        assert_eq!(text, with_threads(3));
        let read: DensityModel = serde_json::from_str(&text).unwrap();
        let fitted = DensityModel::fit(&rows, &logs, &config).unwrap();
        assert_eq!(read, fitted);
        for x in [[0.1, 0.2], [55.0, -3.0], [1e7, 1.0 / 3.0]] {
            let (a, b) = (read.log_density(&x), fitted.log_density(&x));
            assert_eq!(a.to_bits(), b.to_bits());
        }
    }
}

#[test]
fn linfas_fit_gives_the_same_model() {
    let rows = three_blobs(300, 10);
    let table = Array2::from_shape_fn((300, 2), |(i, j)| rows[i][j]);
    let dataset = DatasetBase::new(table, Array1::from_elem(300, 0));
    let by_trait = params(3).check().unwrap().fit(&dataset).unwrap();
    assert_eq!(
        fit(&rows, params(3)).unwrap(),
        DensityModel::Mixture(by_trait)
    );
}

#[test]
fn marginals_as_trait_objects_agree_with_a_fit_of_the_columns() {
    // One unshrunk component: the marginal of the fit is the fit of the marginal.
    let rows = three_blobs(200, 11);
    let plain = GaussianMixtureParams {
        shrinkage: Shrinkage::None,
        ..params(1)
    };
    let joint = fit(&rows, plain.clone()).unwrap();
    let column: Vec<Vec<f64>> = rows.iter().map(|r| vec![r[1]]).collect();
    let direct = fit(&column, plain).unwrap();
    let marginal = joint.marginal(&[1]).unwrap();
    assert_eq!(marginal.dimension(), 1);
    for x in [-2.0, 0.0, 5.0, 80.0] {
        assert!((marginal.log_density(&[x]) - direct.log_density(&[x])).abs() < 1e-9);
    }
    assert!(joint.marginal(&[2]).is_err());
}
