//! Metrics: hand-computed cases, properties, intervals.

use dose3_ood::metrics::{
    Bootstrap, Grouped, Interval, Metric, aupr_in, aupr_out, auroc, detection_rate, estimate,
    estimate_all, fpr_at_95tpr, roc,
};
use dose3_ood::{Error, Score};
use proptest::prelude::*;

#[path = "../src/property_cases.rs"]
mod property_cases;

use property_cases::cases;

fn scores(values: &[f64]) -> Vec<Score> {
    values.iter().map(|&v| Score::new(v)).collect()
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
}

#[test]
fn auroc_by_hand() {
    // Of four pairs OOD wins 2-1, 3-1, 3-2 and ties 2-2.
    near(
        auroc(&scores(&[1.0, 2.0]), &scores(&[2.0, 3.0])).unwrap(),
        3.5 / 4.0,
    );
    near(
        auroc(&scores(&[0.1, 0.4, 0.35]), &scores(&[0.8, 0.3])).unwrap(),
        4.0 / 6.0,
    );
    near(auroc(&scores(&[1.0; 5]), &scores(&[1.0; 3])).unwrap(), 0.5);
    near(auroc(&scores(&[1.0, 2.0]), &scores(&[3.0])).unwrap(), 1.0);
    near(
        auroc(&scores(&[3.0, 4.0]), &scores(&[2.0, 1.0])).unwrap(),
        0.0,
    );
}

#[test]
fn roc_by_hand_and_its_area() {
    let (id, ood) = (scores(&[1.0, 2.0]), scores(&[2.0, 3.0]));
    let curve = roc(&id, &ood).unwrap();
    assert_eq!(curve, [(0.0, 0.0), (0.0, 0.5), (0.5, 1.0), (1.0, 1.0)]);
    let trapezoids = curve
        .windows(2)
        .map(|p| (p[1].0 - p[0].0) * (p[0].1 + p[1].1) / 2.0);
    near(trapezoids.sum(), auroc(&id, &ood).unwrap());
    assert!(roc(&id, &[]).is_err());
}

#[test]
fn average_precision_by_hand() {
    // Descending: 0.8 OOD, 0.4 ID, 0.35 OOD, 0.1 ID (the example of scikit-learn): 0.8333.
    let (id, ood) = (scores(&[0.1, 0.4]), scores(&[0.35, 0.8]));
    near(aupr_out(&id, &ood).unwrap(), 0.5 + 0.5 * 2.0 / 3.0);
    // Ascending, ID positive: 0.1 ID, 0.35 OOD, 0.4 ID.
    near(aupr_in(&id, &ood).unwrap(), 0.5 + 0.5 * 2.0 / 3.0);
    // All tied: the share of positives.
    near(
        aupr_out(&scores(&[1.0; 6]), &scores(&[1.0; 2])).unwrap(),
        0.25,
    );
    near(
        aupr_in(&scores(&[1.0; 6]), &scores(&[1.0; 2])).unwrap(),
        0.75,
    );
    // A tie between classes counts as one step: 3 OOD, then 2 with one of each.
    near(
        aupr_out(&scores(&[2.0]), &scores(&[3.0, 2.0])).unwrap(),
        0.5 + 0.5 * 2.0 / 3.0,
    );
    near(
        aupr_out(&scores(&[1.0]), &scores(&[2.0, 3.0])).unwrap(),
        1.0,
    );
}

#[test]
fn fpr_at_95tpr_by_hand() {
    // 20 OOD scores 1..=20; 95 % are the 19 from 2 up. ID at 0.5, 1.5, 2, 30.
    let ood = scores(&(1..=20).map(f64::from).collect::<Vec<_>>());
    near(
        fpr_at_95tpr(&scores(&[0.5, 1.5, 2.0, 30.0]), &ood).unwrap(),
        0.5,
    );
    near(fpr_at_95tpr(&scores(&[0.0, -1.0]), &ood).unwrap(), 0.0);
    near(fpr_at_95tpr(&scores(&[50.0, 60.0]), &ood).unwrap(), 1.0);
    near(
        fpr_at_95tpr(&scores(&[1.0; 4]), &scores(&[1.0; 4])).unwrap(),
        1.0,
    );
}

#[test]
fn rates_at_a_threshold_by_hand() {
    let s = scores(&[1.0, 2.0, 2.0, 3.0]);
    // Beyond means above: a score at the threshold is not.
    near(detection_rate(&s, Score::new(2.0)).unwrap(), 0.25);
    near(detection_rate(&s, Score::new(0.0)).unwrap(), 1.0);
    let at = Score::new(1.5);
    near(
        Metric::FalseAlarmAt(at).of(&s, &scores(&[9.0])).unwrap(),
        0.75,
    );
    near(
        Metric::DetectionAt(at)
            .of(&s, &scores(&[9.0, 1.0]))
            .unwrap(),
        0.5,
    );
}

#[test]
fn empty_input_is_an_error() {
    let some = scores(&[1.0]);
    for metric in [auroc, aupr_in, aupr_out, fpr_at_95tpr] {
        assert!(matches!(metric(&[], &some), Err(Error::TooFew { .. })));
        assert!(matches!(metric(&some, &[]), Err(Error::TooFew { .. })));
    }
    assert!(detection_rate(&[], Score::new(0.0)).is_err());
}

fn grouped<'a>(scores: &'a [Score], logs: &'a [usize]) -> Grouped<'a> {
    Grouped { scores, logs }
}

#[test]
fn intervals_come_from_logs() {
    // Four ID logs at levels 0, 1, 2, 3 with 50 windows each; OOD at 1.5.
    let logs: Vec<usize> = (0..200).map(|i| 7 * (i / 50)).collect();
    let id = scores(&logs.iter().map(|&l| l as f64 / 7.0).collect::<Vec<_>>());
    let (ood, one) = (scores(&[1.5; 30]), vec![3; 30]);
    let found = estimate(
        Metric::Auroc,
        grouped(&id, &logs),
        grouped(&ood, &one),
        Bootstrap::default(),
    )
    .unwrap();
    near(found.value, 0.5);
    assert_eq!((found.id_logs, found.ood_logs), (4, 1));
    let interval = found.interval.unwrap();
    // A draw of 4 logs has 0 to 4 of the two low ones: 0 and 1 with chance 1/16 each.
    near(interval.lower, 0.0);
    near(interval.upper, 1.0);
    let narrow = Bootstrap {
        confidence: 0.5,
        ..Bootstrap::default()
    };
    let metrics = [Metric::Auroc, Metric::FalseAlarmAt(Score::new(1.5))];
    let both = estimate_all(&metrics, grouped(&id, &logs), grouped(&ood, &one), narrow).unwrap();
    near(both[0].interval.unwrap().lower, 0.25);
    near(both[0].interval.unwrap().upper, 0.75);
    near(both[1].value, 0.5);
}

#[test]
fn intervals_repeat_for_a_seed_and_any_number_of_threads() {
    let id = scores(&(0..90).map(|i| f64::from(i * 37 % 50)).collect::<Vec<_>>());
    let ood = scores(
        &(0..60)
            .map(|i| f64::from(i * 29 % 50) + 10.0)
            .collect::<Vec<_>>(),
    );
    let id_logs: Vec<usize> = (0..90).map(|i| i / 10).collect();
    let ood_logs: Vec<usize> = (0..60).map(|i| i / 10).collect();
    let run = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let bootstrap = Bootstrap {
            resamples: 200,
            seed,
            ..Bootstrap::default()
        };
        pool.install(|| {
            estimate_all(
                &RANKED,
                grouped(&id, &id_logs),
                grouped(&ood, &ood_logs),
                bootstrap,
            )
        })
        .unwrap()
    };
    assert_eq!(run(1, 4), run(3, 4));
    assert_ne!(run(1, 4), run(1, 5));
    for found in run(1, 4) {
        let interval = found.interval.unwrap();
        assert!(interval.lower <= found.value && found.value <= interval.upper);
        assert!(interval.lower < interval.upper);
    }
}

#[test]
fn bad_bootstraps_are_errors_and_two_single_logs_have_no_interval() {
    let (s, logs) = (scores(&[1.0, 2.0]), [5, 5]);
    let side = grouped(&s, &logs);
    let with = |resamples, confidence| {
        let bootstrap = Bootstrap {
            resamples,
            confidence,
            seed: 0,
        };
        estimate(Metric::Auroc, side, side, bootstrap)
    };
    assert_eq!(with(10, 0.9).unwrap().interval, None);
    near(with(10, 0.9).unwrap().value, 0.5);
    assert!(with(0, 0.9).is_err());
    assert!(with(10, 1.0).is_err());
    assert!(with(10, f64::NAN).is_err());
    let short = grouped(&s, &logs[..1]);
    assert!(estimate(Metric::Auroc, short, side, Bootstrap::default()).is_err());
    let empty = grouped(&[], &[]);
    assert!(estimate(Metric::Auroc, empty, side, Bootstrap::default()).is_err());
}

/// Few distinct values, so that ties are common.
fn some_scores() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec((-8_i32..8).prop_map(|v| f64::from(v) * 0.5), 1..40)
}

const RANKED: [Metric; 4] = [
    Metric::Auroc,
    Metric::AuprIn,
    Metric::AuprOut,
    Metric::FprAt95Tpr,
];

/// Precision 1 times shares that add up to a little more than 1 when each is rounded.
#[test]
fn one_score_against_many_ties_stays_within_its_range() {
    let counts = [4, 4, 2, 3, 1, 1, 2, 5, 2, 1, 3, 1, 7];
    let levels = (0..).map(f64::from).zip(counts);
    let many: Vec<f64> = levels.flat_map(|(level, n)| vec![-level; n]).collect();
    let (one, many) = (scores(&[-13.0]), scores(&many));
    assert_eq!((one.len(), many.len()), (1, 36));
    let found = RANKED.map(|m| m.of(&one, &many).unwrap());
    assert_eq!(found, [1.0, 1.0, 1.0, 0.0]);
    let ten = scores(&[4.0, 4.0, 3.0, 3.0, 3.0, 3.0, 2.0, 2.0, 2.0, 1.0]);
    assert_eq!(aupr_out(&scores(&[0.0]), &ten).unwrap(), 1.0);
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn auroc_is_that_of_all_pairs(a in some_scores(), b in some_scores()) {
        let mut won = 0.0;
        for x in &a {
            for y in &b {
                won += if y > x { 1.0 } else if y == x { 0.5 } else { 0.0 };
            }
        }
        let found = auroc(&scores(&a), &scores(&b)).unwrap();
        prop_assert!((found - won / (a.len() * b.len()) as f64).abs() < 1e-12);
    }

    #[test]
    fn auroc_turns_over_with_its_sides(a in some_scores(), b in some_scores()) {
        let forward = auroc(&scores(&a), &scores(&b)).unwrap();
        let backward = auroc(&scores(&b), &scores(&a)).unwrap();
        prop_assert!((forward - (1.0 - backward)).abs() < 1e-12);
    }

    #[test]
    fn ranks_alone_decide(a in some_scores(), b in some_scores()) {
        let map = |v: &[f64]| scores(&v.iter().map(|x| (1.3 * x).exp() - 5.0).collect::<Vec<_>>());
        for metric in RANKED {
            let plain = metric.of(&scores(&a), &scores(&b)).unwrap();
            let mapped = metric.of(&map(&a), &map(&b)).unwrap();
            prop_assert!((plain - mapped).abs() < 1e-12);
            prop_assert!((0.0..=1.0).contains(&plain));
        }
    }

    #[test]
    fn the_ends_are_exact(a in some_scores(), b in some_scores()) {
        let beyond: Vec<f64> = b.iter().map(|v| v + 8.0).collect();
        let (low, high) = (scores(&a), scores(&beyond));
        let of = |id: &[Score], ood: &[Score]| RANKED.map(|m| m.of(id, ood).unwrap());
        prop_assert_eq!(of(&low, &high), [1.0, 1.0, 1.0, 0.0]);
        let [auroc, _, _, fpr] = of(&high, &low);
        prop_assert_eq!([auroc, fpr], [0.0, 1.0]);
    }

    #[test]
    fn intervals_stay_within_the_range(a in some_scores(), b in some_scores(), seed in 0_u64..99) {
        let logs = |n: usize| (0..n).map(|i| i / 3).collect::<Vec<_>>();
        let (id, ood) = (scores(&a), scores(&b));
        let bootstrap = Bootstrap { resamples: 20, seed, ..Bootstrap::default() };
        let (id_logs, ood_logs) = (logs(a.len()), logs(b.len()));
        let (id, ood) = (grouped(&id, &id_logs), grouped(&ood, &ood_logs));
        for found in estimate_all(&RANKED, id, ood, bootstrap).unwrap() {
            prop_assert!((0.0..=1.0).contains(&found.value));
            if let Some(Interval { lower, upper }) = found.interval {
                prop_assert!(0.0 <= lower && lower <= upper && upper <= 1.0);
            }
        }
    }

    #[test]
    fn precision_turns_over_with_sides_and_signs(a in some_scores(), b in some_scores()) {
        let minus = |v: &[f64]| scores(&v.iter().map(|x| -x).collect::<Vec<_>>());
        let out = aupr_out(&scores(&a), &scores(&b)).unwrap();
        let turned = aupr_in(&minus(&b), &minus(&a)).unwrap();
        prop_assert!((out - turned).abs() < 1e-12);
    }
}
