use super::super::{Sample, StatisticsSet};
use super::*;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A body that sways left by half of what it turned two steps ago, and rolls at random.
fn coupled(seed: u64, count: usize, delay: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let turn: Vec<f64> = (0..count + 8)
        .map(|_| rng.random_range(-0.1..0.1))
        .collect();
    (0..count)
        .flat_map(|i| {
            let left = 0.5 * turn[i + 8 - delay];
            [
                1.0,
                left,
                0.0,
                rng.random_range(-0.01..0.01),
                0.0,
                turn[i + 8],
            ]
        })
        .collect()
}

fn row(predictor: &LinearPredictor, increments: &[f64]) -> Result<Vec<f64>, Error> {
    StatisticsSet::from(super::super::Statistic::Lin).evaluate(&Sample {
        increments: Some(increments),
        linear: Some(predictor),
        ..Sample::default()
    })
}

#[test]
fn an_axis_that_follows_from_another_leaves_nothing_over() {
    let trusted = coupled(1, 2000, 2);
    let predictor = LinearPredictor::fit(&[&trusted]).unwrap();
    let (same, late) = (coupled(2, 128, 2), coupled(2, 128, 3));
    let names = StatisticsSet::from(super::super::Statistic::Lin).names();
    let column = |name: &str| names.iter().position(|n| n == name).unwrap();
    let left = column("translation_y.left_by_others.log_median");
    let roll = column("rotation_x.left_by_others.log_median");
    let (same, late) = (
        row(&predictor, &same).unwrap(),
        row(&predictor, &late).unwrap(),
    );
    // Turns of up to 0.1 sway 0.05: typically 0.025, of which nearly nothing is left, until they come a step late.
    assert!(same[left] < 0.002_f64.ln(), "{}", same[left].exp());
    assert!(late[left] > 0.01_f64.ln(), "{}", late[left].exp());
    // Nothing tells the roll: half of its range of 0.01 is left.
    assert!(
        (same[roll].exp() - 0.005).abs() < 0.002,
        "{}",
        same[roll].exp()
    );
    // An axis that never moves stands at the floor.
    assert_eq!(
        same[column("rotation_y.left_by_others.log_max")],
        1e-5_f64.ln()
    );
}

#[test]
fn a_deviation_has_axis_sign_and_size() {
    let predictor = LinearPredictor::fit(&[&coupled(1, 2000, 2)]).unwrap();
    let mut log = coupled(3, 60, 2);
    log[30 * CHANNELS + 2] -= 0.4;
    log[40 * CHANNELS] += 3.0;
    let deviations = predictor.deviations(&log).unwrap();
    assert_eq!(deviations.len(), 60);
    assert_eq!((deviations[30].increment, deviations[30].axis), (30, 2));
    assert!(
        (deviations[30].value + 0.4).abs() < 0.01,
        "{:?}",
        deviations[30]
    );
    assert_eq!(deviations[40].axis, 0);
    assert!(
        (deviations[40].value - 3.0).abs() < 0.1,
        "{:?}",
        deviations[40]
    );
    assert!(deviations[15].ratio < 10.0 && deviations[30].ratio > 1000.0);
}

#[test]
fn a_group_is_held_out_of_its_own_predictor() {
    let logs: Vec<Vec<f64>> = (0..4)
        .map(|i| coupled(i, 300, 1 + i as usize / 2))
        .collect();
    let stretches: Vec<&[f64]> = logs.iter().map(Vec::as_slice).collect();
    let reference = LinearReference::fit(&stretches, &[5, 5, 9, 9]).unwrap();
    let only = |keep: &[&[f64]]| LinearReference::fit(keep, &vec![0; keep.len()]).unwrap();
    let close = |a: &LinearPredictor, b: &LinearPredictor, tolerance: f64| {
        let weights = |p: &LinearPredictor| -> Vec<f64> {
            p.models.iter().flat_map(|m| m.weights.clone()).collect()
        };
        let (a, b) = (weights(a), weights(b));
        a.iter().zip(&b).all(|(a, b)| (a - b).abs() < tolerance)
    };
    // Scales come from all logs, so weights differ a little from a fit to the others alone.
    let others = only(&stretches[2..]);
    assert!(close(reference.without(5), others.all(), 0.05));
    assert!(!close(reference.without(5), reference.all(), 0.05));
    assert_ne!(reference.without(5), reference.without(9));
    assert_eq!(reference.without(77), reference.all());
    let single = only(&stretches);
    assert_eq!(single.without(0), single.all());
    assert!(close(single.all(), reference.all(), 1e-6));
    // Threads do not change a bit.
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let again = pool.install(|| LinearReference::fit(&stretches, &[5, 5, 9, 9]).unwrap());
    assert_eq!(again, reference);
}

#[test]
fn logs_that_stand_still_and_short_ones_give_numbers() {
    let still = vec![0.0; 50 * CHANNELS];
    let straight = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0].repeat(50);
    for log in [&still, &straight, &vec![1e200; 20 * CHANNELS]] {
        let predictor = LinearPredictor::fit(&[log]).unwrap();
        predictor.validate().unwrap();
        for other in [&still, &straight, &coupled(1, 40, 2)] {
            assert_eq!(row(&predictor, other).unwrap().len(), 36);
        }
    }
    assert!(LinearPredictor::fit(&[&still[..6 * CHANNELS]]).is_err());
    assert!(LinearPredictor::fit(&[]).is_err());
    assert!(LinearPredictor::fit(&[&[f64::NAN; 60]]).is_err());
    let predictor = LinearPredictor::fit(&[&still[..7 * CHANNELS], &[]]).unwrap();
    assert!(row(&predictor, &still[..6 * CHANNELS]).is_err());
    assert!(row(&predictor, &still[..7 * CHANNELS]).is_ok());
    assert!(row(&predictor, &still[..41]).is_err());
    assert!(row(&predictor, &[f64::INFINITY; 60]).is_err());
}

#[test]
fn a_stored_predictor_is_checked() {
    let predictor = LinearPredictor::fit(&[&coupled(1, 200, 2)]).unwrap();
    let text = serde_json::to_string(&predictor).unwrap();
    assert_eq!(
        serde_json::from_str::<LinearPredictor>(&text).unwrap(),
        predictor
    );
    let break_it = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut value: serde_json::Value = serde_json::from_str(&text).unwrap();
        change(&mut value);
        serde_json::from_value::<LinearPredictor>(value).is_err()
    };
    assert!(break_it(&|v| v["scale"][0] = 0.0.into()));
    assert!(break_it(&|v| v["scale"] = vec![1.0; 6].into()));
    assert!(break_it(
        &|v| v["models"][3]["weights"] = vec![1.0; 2].into()
    ));
    assert!(break_it(&|v| v["models"][3]["spread"] = (-1.0).into()));
    assert!(break_it(&|v| v["more"] = 1.into()));
}

proptest! {
    #![proptest_config(crate::property_cases::cases(24))]
    #[test]
    fn any_finite_log_gives_finite_numbers(
        exponents in prop::collection::vec(-300_i32..300, 6),
        seed in 0_u64..1000,
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut log = || -> Vec<f64> {
            (0..30 * CHANNELS)
                .map(|i| rng.random_range(-1.0..1.0) * 10_f64.powi(exponents[i % CHANNELS]))
                .collect()
        };
        let (trusted, other) = (log(), coupled(seed, 30, 1));
        let predictor = LinearPredictor::fit(&[&trusted]).unwrap();
        for log in [&trusted, &other] {
            let row = row(&predictor, log).unwrap();
            prop_assert!(row.iter().all(|x| x.is_finite()));
        }
    }
}
