//! Each fault of the stamps does what it says, measured on a synthetic log.

mod common;

use common::faults::{RANGE, drive, faulty, near};
use dose3_datasets::Trajectory;
use dose3_lie::so3;

/// Between stamps of the sound log, nanoseconds.
const STEP: i64 = 100_000_000;

fn steps(log: &Trajectory) -> Vec<i64> {
    log.stamps
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .collect()
}

#[test]
fn a_stall_is_a_step_without_poses() {
    let sound = drive();
    let stalled = faulty("stall:1.0s", &sound, 1);
    assert_eq!(stalled.len(), sound.len() - 9);
    assert_eq!(steps(&stalled)[RANGE.start], 10 * STEP);
    assert_eq!(stalled.poses[..=RANGE.start], sound.poses[..=RANGE.start]);
    assert_eq!(
        stalled.poses[RANGE.start + 1..],
        sound.poses[RANGE.start + 10..]
    );
    assert_eq!(
        stalled.stamps[RANGE.start + 1..],
        sound.stamps[RANGE.start + 10..]
    );
    // At most to the last pose of the range.
    let long = faulty("stall:1000.0s", &sound, 1);
    assert_eq!(long.poses[RANGE.start + 1..], sound.poses[RANGE.end - 1..]);
}

#[test]
fn a_burst_comes_late_and_together() {
    let sound = drive();
    let burst = faulty("burst:1.0s", &sound, 1);
    assert_eq!(burst.poses, sound.poses);
    let steps = steps(&burst);
    assert_eq!(steps[RANGE.start], 10 * STEP - 9_000_000);
    assert_eq!(steps[RANGE.start + 1..RANGE.start + 10], [1_000_000; 9]);
    assert_eq!(
        burst.stamps[RANGE.start + 10..],
        sound.stamps[RANGE.start + 10..]
    );
}

#[test]
fn jitter_of_the_stamps_keeps_their_order() {
    let sound = drive();
    // Small enough that hardly any two change places.
    let shaken = faulty("stamp-jitter:0.02s", &sound, 1);
    assert_eq!(shaken.poses, sound.poses);
    let noise: Vec<f64> = RANGE
        .map(|pose| (shaken.stamps[pose] - sound.stamps[pose]) as f64 * 1e-9)
        .collect();
    let mean = noise.iter().sum::<f64>() / noise.len() as f64;
    let variance = noise.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / noise.len() as f64;
    near(mean, 0.0, 0.004);
    near(variance.sqrt(), 0.02, 0.003);
    assert_eq!(shaken.stamps[..=RANGE.start], sound.stamps[..=RANGE.start]);
    assert_eq!(
        shaken.stamps[RANGE.end - 1..],
        sound.stamps[RANGE.end - 1..]
    );
    // Far more noise than a step: still strictly in order, within the range.
    let wild = faulty("stamp-jitter:100.0s", &sound, 1);
    assert!(wild.stamps.windows(2).all(|pair| pair[0] < pair[1]));
}

#[test]
fn doubled_poses_follow_a_millisecond_later() {
    let sound = drive();
    let mut copies = 0;
    for seed in 0..10 {
        let doubled = faulty("doubled:0.2", &sound, seed);
        copies += doubled.len() - sound.len();
        for (index, step) in steps(&doubled).into_iter().enumerate() {
            let same = doubled.poses[index + 1] == doubled.poses[index];
            assert_eq!(step == 1_000_000, same);
        }
    }
    // 3990 draws: a standard deviation of 25.
    near(copies as f64, 0.2 * 3990.0, 100.0);
}

#[test]
fn an_uneven_rate_is_stamped_rightly() {
    let sound = drive();
    let uneven = faulty("uneven:0.5", &sound, 1);
    let within = &steps(&uneven)[RANGE.start..RANGE.end - 1];
    assert!(
        within
            .iter()
            .all(|step| (STEP / 2..=3 * STEP / 2).contains(step))
    );
    assert!(within.iter().min().unwrap() < &(7 * STEP / 10));
    assert!(within.iter().max().unwrap() > &(13 * STEP / 10));
    // Each pose lies on the course at its stamp.
    for pose in RANGE.start + 1..RANGE.end - 1 {
        let stamp = uneven.stamps[pose];
        let before = sound.stamps.partition_point(|other| *other <= stamp) - 1;
        let share = (stamp - sound.stamps[before]) as f64 / STEP as f64;
        let (a, b) = (&sound.poses[before], &sound.poses[before + 1]);
        let expected = a.translation.lerp(&b.translation, share);
        near(
            (uneven.poses[pose].translation - expected).norm(),
            0.0,
            1e-9,
        );
        let turned = so3::distance(&a.rotation, &uneven.poses[pose].rotation);
        near(
            turned,
            share * so3::distance(&a.rotation, &b.rotation),
            1e-9,
        );
    }
}

#[test]
fn a_thinned_rate_keeps_stamps_and_poses() {
    let sound = drive();
    let thin = faulty("thinned:2.0x", &sound, 1);
    assert_eq!(thin.len(), 700 - 200);
    for index in 0..200 {
        assert_eq!(
            thin.poses[RANGE.start + index],
            sound.poses[RANGE.start + 2 * index]
        );
        assert_eq!(
            thin.stamps[RANGE.start + index],
            sound.stamps[RANGE.start + 2 * index]
        );
    }
    assert_eq!(thin.poses[300..], sound.poses[500..]);
    assert_eq!(thin.stamps[300..], sound.stamps[500..]);
}

#[test]
fn stamps_under_a_header_of_euroc_are_nanoseconds_where_these_make_a_rate() {
    let header = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []";
    let read = |start: i64, step: i64| {
        let rows = (0..9).map(|index| format!("{},{index},0,0,1,0,0,0\n", start + step * index));
        let text = format!("{header}\n{}", rows.collect::<String>());
        dose3_datasets::load_bytes(
            "a.csv",
            text.as_bytes(),
            &dose3_datasets::LoadOptions::default(),
        )
        .unwrap()
    };
    // A clock that runs since 28 hours, whose microseconds would be 1973.
    let log = read(100_000_001_000_000, 1_000_000);
    assert_eq!(
        (log.stamps[1], log.rate.hertz),
        (100_000_002_000_000, 1000.0)
    );
    assert!(
        log.report
            .remarks
            .iter()
            .any(|remark| remark.text.contains("as EuRoC has them"))
    );
    // Microseconds of 2020 at 10 Hz, which as nanoseconds would be 10 kHz.
    let log = read(1_600_000_000_000_000, 100_000);
    assert_eq!(
        (log.stamps[0], log.rate.hertz),
        (1_600_000_000_000_000_000, 10.0)
    );
}
