use super::*;
use proptest::prelude::*;

fn scores(values: &[f64]) -> Vec<Score> {
    values.iter().map(|&v| Score::new(v)).collect()
}

fn stretch(group: usize, values: &[f64]) -> Stretch {
    Stretch {
        group,
        scores: scores(values),
    }
}

fn one(windows: usize) -> Vec<Duration> {
    vec![Duration {
        windows,
        weight: 1.0,
    }]
}

/// 0, 2, ..., 100 and 1, 3, ..., 99: the highest ten are two clusters.
fn ramps() -> RunReference {
    let of = |first: u32| {
        let values: Vec<f64> = (first..=100).step_by(2).map(f64::from).collect();
        stretch(0, &values)
    };
    RunReference::new(&[of(0), of(1)], 12, 4).unwrap()
}

#[test]
fn extremal_index_by_hand() {
    let with = |high: &[usize]| {
        let values: Vec<f64> = (0..100)
            .map(|i| f64::from(u8::from(high.contains(&i))))
            .collect();
        RunReference::new(&[stretch(0, &values)], 1, 4)
            .unwrap()
            .extremal_index(1)
    };
    // Of 100 windows three are beyond the 0.97 quantile; 10 and 14 are near each other, 19 and 25 not.
    assert_eq!(with(&[10, 14, 25]), 3.0 / 4.0);
    assert_eq!(with(&[10, 14, 19]), 3.0 / 4.0);
    assert_eq!(with(&[10, 15, 25]), 1.0);
    assert_eq!(with(&[40, 41, 42]), 2.0 / 4.0);
    // No score is above a quantile of equal ones.
    assert_eq!(with(&[]), 1.0);
    // A cluster ends with its stretch.
    let two = [
        stretch(0, &[0.0, 0.0, 0.0, 1.0]),
        stretch(0, &[1.0, 0.0, 0.0, 0.0]),
    ];
    let rest = stretch(1, &[0.0; 20]);
    let all = [two[0].clone(), two[1].clone(), rest];
    assert_eq!(
        RunReference::new(&all, 1, 4).unwrap().extremal_index(1),
        1.0
    );
}

#[test]
fn clusters_by_hand() {
    let of = |values: &[f64], gap| clusters(&[scores(values)], 0.5, gap);
    let values = [1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    assert_eq!(of(&values, 1), (3, 4));
    assert_eq!(of(&values, 3), (2, 4));
    assert_eq!(of(&values, 4), (1, 4));
    assert_eq!(of(&[0.0], 4), (0, 0));
}

#[test]
fn the_chance_of_a_log_by_hand() {
    let reference = ramps();
    let mut log = [0.0; 8];
    log[5] = 95.5;
    let stretches = [(0..8).collect()];
    let run = reference
        .worst_run(&scores(&log), &stretches, &one(1))
        .unwrap();
    // Rank 12 of 102 at the 0.9 quantile 90, mean excess 5.5 of two clusters; beyond the 0.97 quantile
    // are 98, 99 and 100 in two clusters, so theta 3/4 of 8 windows is 6.
    let p: f64 = 12.0 / 102.0 / (1.0_f64 + 1.0 / 2.0).powi(2);
    assert!((run.p_value - (1.0 - (1.0 - p).powi(6))).abs() < 1e-12);
    assert_eq!((run.first, run.last, run.tail), (5, 5, true));
    // 1 is at p = 1/1000 of the tail, 0 at the median 50.
    let extreme = 90.0 + 5.5 * 2.0 * ((1000.0_f64 * 12.0 / 102.0).sqrt() - 1.0);
    assert!((run.excess - 45.5 / (extreme - 50.0)).abs() < 1e-12);
    // One window alone is no run of three.
    let short = Duration::of_overlap(4);
    let run = reference
        .worst_run(&scores(&log), &stretches, &short)
        .unwrap();
    assert_eq!(
        (run.score, run.p_value, run.tail),
        (Score::new(0.0), 1.0, false)
    );
    log[4..7].fill(95.5);
    let run = reference
        .worst_run(&scores(&log), &stretches, &short)
        .unwrap();
    assert_eq!((run.first, run.last, run.score), (4, 6, Score::new(95.5)));
    // A gap in the middle of it ends the run.
    let gap = [(0..6).collect(), (6..8).collect()];
    let run = reference.worst_run(&scores(&log), &gap, &one(3)).unwrap();
    assert_eq!((run.first, run.last), (0, 2));
    assert!(reference.worst_run(&[], &[], &short).is_none());
    assert!(
        reference
            .worst_run(&scores(&log), &stretches, &[])
            .is_none()
    );
}

#[test]
fn short_logs_are_compared_with_runs_of_their_length() {
    // Pairs of high windows are usual, three in a row are not.
    let values: Vec<f64> = (0..120)
        .map(|i| if i % 10 < 2 { 9.0 } else { f64::from(i % 7) })
        .collect();
    let reference = RunReference::new(&[stretch(0, &values)], 12, 4).unwrap();
    let durations = Duration::of_overlap(4);
    let two = reference
        .worst_run(&scores(&[9.0, 9.0]), &[vec![0, 1]], &durations)
        .unwrap();
    let three = reference
        .worst_run(&scores(&[9.0; 3]), &[vec![0, 1, 2]], &durations)
        .unwrap();
    assert!(
        two.p_value > 0.05 && three.p_value < 0.5 * two.p_value,
        "{two:?} {three:?}"
    );
    // Both durations are one for so few windows: no share is lost.
    let single = reference
        .worst_run(&scores(&[9.0, 9.0]), &[vec![0, 1]], &one(2))
        .unwrap();
    assert_eq!(single.p_value, two.p_value);
    let one_window = reference
        .worst_run(&scores(&[3.0]), &[vec![0]], &durations)
        .unwrap();
    assert_eq!((one_window.first, one_window.last), (0, 0));
}

#[test]
fn what_lasts_is_seen_by_the_long_run() {
    // Six high windows in a row are usual, twelve are not.
    let values: Vec<f64> = (0..400)
        .map(|i: u32| {
            let varied = f64::from(i * 7919 % 101) / 101.0;
            if i % 20 < 6 {
                8.5 + varied
            } else {
                6.0 * varied
            }
        })
        .collect();
    let reference = RunReference::new(&[stretch(0, &values)], 12, 4).unwrap();
    let mut log = vec![1.0; 40];
    log[20..32].fill(9.0);
    let stretches = [(0..40).collect()];
    let run = |durations: &[Duration]| {
        let run = reference.worst_run(&scores(&log), &stretches, durations);
        run.unwrap()
    };
    let found = run(&Duration::of_overlap(4));
    assert_eq!((found.first, found.last), (20, 31));
    assert!(found.p_value < run(&one(3)).p_value, "{found:?}");
    assert!((found.p_value - run(&one(12)).p_value / 0.2).abs() < 1e-12);
}

#[test]
fn trusted_runs_are_as_long_as_half_of_the_groups_can_tell() {
    let depth = |lengths: &[usize]| {
        let stretches: Vec<Stretch> = lengths
            .iter()
            .enumerate()
            .map(|(group, &n)| {
                let wave: Vec<f64> = (0..n)
                    .map(|i| ((i * i * 7 + group * 5) % 101) as f64)
                    .collect();
                stretch(group, &wave)
            })
            .collect();
        RunReference::new(&stretches, 12, 4).unwrap().levels.len()
    };
    assert_eq!(depth(&[5; 20]), 5);
    // Runs of five windows are known of one group in four.
    assert_eq!(depth(&[40, 4, 4, 4]), 4);
    assert_eq!(depth(&[40, 40, 4, 4]), 12);
    // Twelve windows have no two clusters, so runs are known that share poses.
    assert!((2..=4).contains(&depth(&[12])));
    assert_eq!(depth(&[1]), 1);
    assert!(RunReference::new(&[], 12, 4).is_err());
    assert!(RunReference::new(&[stretch(0, &[])], 12, 4).is_err());
}

#[test]
fn no_score_makes_a_chance_of_nothing() {
    let mut wild = vec![Score::MAX; 3];
    wild.extend(scores(&[0.0; 30]));
    let wild = Stretch {
        group: 0,
        scores: wild,
    };
    for reference in [ramps(), RunReference::new(&[wild], 12, 4).unwrap()] {
        for value in [Score::MAX, Score::new(f64::NEG_INFINITY), Score::new(0.0)] {
            let log = vec![value; 20];
            let run = reference
                .worst_run(&log, &[(0..20).collect()], &Duration::of_overlap(4))
                .unwrap();
            assert!(run.p_value > 0.0 && run.p_value <= 1.0, "{run:?}");
            assert!(run.excess.is_finite());
        }
    }
}

#[test]
fn without_an_order_chances_are_larger() {
    let values: Vec<f64> = (0..200).map(|i| f64::from(i * 37 % 101)).collect();
    let ordered = RunReference::new(&[stretch(0, &values)], 12, 4).unwrap();
    let unordered = RunReference::unordered(ordered.windows().clone());
    assert!(ordered.is_ordered() && !unordered.is_ordered());
    for value in [50.0, 91.0, 99.0, 120.0] {
        let log = scores(&[value; 20]);
        let p = |reference: &RunReference| {
            let stretches = [(0..20).collect()];
            let run = reference.worst_run(&log, &stretches, &Duration::of_overlap(4));
            run.unwrap().p_value
        };
        assert!(p(&unordered) >= p(&ordered), "{value}");
    }
    let run = unordered.worst_run(
        &scores(&[99.0, 99.0, 99.0, 1.0]),
        &[vec![0, 1, 2, 3]],
        &one(3),
    );
    assert_eq!(run.map(|r| (r.first, r.last)), Some((0, 2)));
}

proptest! {
    #![proptest_config(crate::property_cases::cases(256))]

    #[test]
    fn a_higher_window_never_raises_the_chance(
        trusted in prop::collection::vec(-9_i32..9, 12..80),
        log in prop::collection::vec(-12_i32..14, 1..30),
        at in 0_usize..30,
        by in 1_i32..9,
        cut in 0_usize..30,
    ) {
        let of = |values: &[i32]| -> Vec<Score> {
            values.iter().map(|&v| Score::new(f64::from(v))).collect()
        };
        let (first, second) = trusted.split_at(trusted.len() / 2);
        let stretches =
            [first, second].map(|s| Stretch { group: 0, scores: of(s) });
        let reference = RunReference::new(&stretches, 12, 4).unwrap();
        let cut = cut.min(log.len());
        let places = [(0..cut).collect(), (cut..log.len()).collect()];
        let p = |log: &[i32]| {
            let run = reference.worst_run(&of(log), &places, &Duration::of_overlap(4));
            run.unwrap()
        };
        let before = p(&log);
        let mut raised = log.clone();
        let at = at % log.len();
        raised[at] += by;
        let after = p(&raised);
        prop_assert!(after.p_value <= before.p_value * (1.0 + 1e-12));
        prop_assert!(after.excess >= before.excess);
        prop_assert!(before.p_value > 0.0 && before.p_value <= 1.0);
        prop_assert!(before.last < log.len() && before.first <= before.last);
        let lowest = (before.first..=before.last).map(|i| log[i]).min().unwrap();
        prop_assert_eq!(before.score, Score::new(f64::from(lowest)));
    }
}
