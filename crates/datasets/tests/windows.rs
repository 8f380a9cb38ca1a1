//! Windows, stretches, resampling and splits.

mod common;
#[path = "../../ood/src/property_cases.rs"]
mod property_cases;

use std::collections::HashSet;

use dose3_datasets::synthetic::{Platform, suite};
use dose3_datasets::{
    Error, Format, Frame, LoadOptions, RowKind, StampUnit, Trajectory, Window, folds, group_logs,
    leave_one_out, load, resample, split_by_log, stretches, windows,
};
use dose3_lie::{Pose, so3};
use property_cases::cases;
use proptest::prelude::*;

/// A log whose steps are so many milliseconds each.
fn log_with_steps(milliseconds: &[i64]) -> Trajectory {
    let mut stamps = vec![0];
    for step in milliseconds {
        stamps.push(stamps[stamps.len() - 1] + step * 1_000_000);
    }
    let poses = vec![Pose::identity(); stamps.len()];
    Trajectory::new("log", Format::Tum, Frame::Sensor, stamps, poses)
}

#[test]
fn a_pause_ends_a_stretch_and_a_lost_frame_does_not() {
    let mut steps = vec![100; 20];
    steps[5] = 200;
    steps[9] = 1001;
    let mut log = log_with_steps(&steps);
    assert_eq!(stretches(&log, None), [0..10, 10..21]);
    assert_eq!(stretches(&log, Some(0.15)), [0..6, 6..10, 10..21]);
    assert_eq!(stretches(&log, Some(f64::INFINITY)), vec![0..21]);
    log.breaks = vec![3];
    assert_eq!(stretches(&log, None), [0..3, 3..10, 10..21]);
    log.breaks.clear();
    let starts = |length, stride| -> Vec<usize> {
        windows(std::slice::from_ref(&log), length, stride)
            .iter()
            .map(|window| window.start)
            .collect()
    };
    assert_eq!(starts(5, 3), [0, 3, 10, 13, 16]);
    assert_eq!(starts(10, 1), [0, 10, 11]);
    assert_eq!(starts(11, 1), [10]);
    assert!(starts(12, 1).is_empty() && starts(0, 1).is_empty() && starts(1, 0).is_empty());
}

#[test]
fn fast_logs_may_miss_half_a_second() {
    let mut steps = vec![5; 300];
    steps[100] = 500;
    assert_eq!(stretches(&log_with_steps(&steps), None).len(), 1);
    steps[100] = 501;
    assert_eq!(stretches(&log_with_steps(&steps), None).len(), 2);
}

#[test]
fn a_gap_after_the_first_pose_leaves_two_stretches_of_one() {
    let mut log = log_with_steps(&[5_000]);
    log.max_gap = Some(1.0);
    let logs = [log];
    assert_eq!(windows(&logs, 2, 1), []);
    assert_eq!(windows(&logs, 1, 1).len(), 2);
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn windows_lie_within_one_stretch_and_start_at_the_stride(
        steps in prop::collection::vec(prop_oneof![9 => 90..110_i64, 1 => 5_000..6_000_i64], 1..200),
        length in 1..40_usize,
        stride in 1..50_usize,
    ) {
        let mut logs = [log_with_steps(&steps), log_with_steps(&steps[..1])];
        logs.iter_mut().for_each(|log| log.max_gap = Some(1.0));
        let cut = windows(&logs, length, stride);
        let mut expected = 0;
        for log in &logs {
            for stretch in stretches(log, log.max_gap) {
                expected += if stretch.len() >= length { (stretch.len() - length) / stride + 1 } else { 0 };
            }
        }
        prop_assert_eq!(cut.len(), expected);
        prop_assert_eq!(cut.iter().collect::<HashSet<_>>().len(), expected);
        for window in &cut {
            let log = &logs[window.trajectory];
            let stamps = &log.stamps[window.start..window.start + length];
            prop_assert!(stamps.windows(2).all(|pair| pair[1] - pair[0] < 1_000_000_000));
            prop_assert_eq!(window.poses(&logs).unwrap().len(), length);
            let stretch = stretches(log, log.max_gap).into_iter().find(|range| range.contains(&window.start)).unwrap();
            prop_assert_eq!((window.start - stretch.start) % stride, 0);
        }
    }

    #[test]
    fn resampling_keeps_a_steady_motion(rate in 1.0..50.0_f64, spin in -3.0..3.0_f64) {
        let poses = (0..500).map(|index| {
            let t = f64::from(index) * 0.02;
            dose3_lie::Pose {
                rotation: so3::exp(&dose3_lie::Vector::new(0.0, 0.0, spin * t)),
                translation: dose3_lie::Vector::new(2.0 * t, 5e6, -t),
            }
        });
        let stamps = (0..500).map(|index| 7 + index * 20_000_000).collect();
        let log = Trajectory::new("log", Format::Tum, Frame::Sensor, stamps, poses.collect());
        let slow = resample(&log, rate).unwrap();
        prop_assert_eq!(slow.len(), (9.98 * rate + 1e-9).floor() as usize + 1);
        for (stamp, pose) in slow.stamps.iter().zip(&slow.poses) {
            let t = (*stamp - 7) as f64 * 1e-9;
            prop_assert!((pose.translation.x - 2.0 * t).abs() < 1e-8);
            let expected = so3::exp(&dose3_lie::Vector::new(0.0, 0.0, spin * t));
            prop_assert!(so3::distance(&pose.rotation, &expected) < 1e-8);
        }
        prop_assert_eq!(slow.rate.hertz, rate);
    }
}

#[test]
fn resampling_invents_nothing_across_a_gap() {
    let mut steps = vec![50; 200];
    steps[99] = 30_000;
    let log = log_with_steps(&steps);
    let slow = resample(&log, 2.0).unwrap();
    assert_eq!(stretches(&slow, slow.max_gap), [0..10, 10..21]);
    assert_eq!(slow.stamps[10], log.stamps[100]);
    assert_eq!(slow.report.resampled_from, Some(20.0));
    // A short gap, once resampled slowly, is still one.
    let mut steps = vec![50; 200];
    steps[99] = 600;
    let slow = resample(&log_with_steps(&steps), 1.0).unwrap();
    assert_eq!(stretches(&slow, slow.max_gap).len(), 2);
}

#[test]
fn resampling_to_the_same_rate_changes_nothing() {
    let log = dose3_datasets::synthetic::trajectory(Platform::Vehicle, 1, 300, 30.0);
    let same = resample(&log, 30.0).unwrap();
    assert_eq!(same, log);
}

#[test]
fn resampling_refuses_what_it_cannot_do() {
    let log = log_with_steps(&[100; 50]);
    assert!(matches!(
        resample(&log, 11.0),
        Err(Error::Upsampling { .. })
    ));
    // Nominal 10 Hz against a measured 9.65 is the same rate.
    assert!(resample(&log, 10.4).is_ok());
    for hertz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
        assert!(
            matches!(resample(&log, hertz), Err(Error::Parameter { .. })),
            "{hertz}"
        );
    }
    let mut hole = log_with_steps(&[100, 100, 100, 4_000_000_000, 100, 100]);
    hole.max_gap = Some(1e9);
    assert!(matches!(
        resample(&hole, 10.0),
        Err(Error::Parameter { .. })
    ));
}

#[test]
fn breaks_in_odometry_end_a_stretch() {
    let mut lines: Vec<String> = common::vo(30).lines().map(str::to_owned).collect();
    lines.remove(10);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("vo.csv");
    std::fs::write(&path, lines.join("\n") + "\n").unwrap();
    let log = load(&path, &LoadOptions::default()).unwrap();
    assert_eq!(
        (log.report.chain_breaks, log.report.gaps, log.len()),
        (1, 0, 30)
    );
    assert_eq!(stretches(&log, log.max_gap), [0..10, 10..30]);
}

#[test]
fn splits_hold_out_whole_groups() {
    let mut logs = suite(Platform::Handheld, 9, 3);
    logs[4].group = logs[1].group.clone();
    for fraction in [0.01, 0.3, 0.5, 0.9, 0.99] {
        for seed in 0..20 {
            let split = split_by_log(&logs, fraction, seed).unwrap();
            assert!(!split.fit.is_empty() && !split.held_out.is_empty());
            let mut all = [split.fit.clone(), split.held_out.clone()].concat();
            all.sort_unstable();
            assert_eq!(all, (0..9).collect::<Vec<_>>());
            assert_eq!(split.fit.contains(&4), split.fit.contains(&1));
            assert_eq!(split, split_by_log(&logs, fraction, seed).unwrap());
        }
    }
    // The order of the logs does not matter, the seed does.
    let name = |logs: &[Trajectory], indices: &[usize]| -> HashSet<String> {
        indices
            .iter()
            .map(|index| logs[*index].name.clone())
            .collect()
    };
    let chosen = name(&logs, &split_by_log(&logs, 0.4, 1).unwrap().held_out);
    let mut reversed = logs.clone();
    reversed.reverse();
    assert_eq!(
        chosen,
        name(
            &reversed,
            &split_by_log(&reversed, 0.4, 1).unwrap().held_out
        )
    );
    assert!(
        (2..10)
            .any(|seed| name(&logs, &split_by_log(&logs, 0.4, seed).unwrap().held_out) != chosen)
    );
    let poses: usize = logs.iter().map(Trajectory::len).sum();
    let held: usize = split_by_log(&logs, 0.4, 1)
        .unwrap()
        .held_out
        .iter()
        .map(|index| logs[*index].len())
        .sum();
    assert!((held as f64 / poses as f64 - 0.4).abs() < 0.12);
}

#[test]
fn folds_hold_out_every_log_once() {
    let mut logs = suite(Platform::Drone, 7, 3);
    logs[6].group = logs[0].group.clone();
    for splits in [
        folds(&logs, 3, 1).unwrap(),
        leave_one_out(&logs).unwrap(),
        folds(&logs, 6, 1).unwrap(),
    ] {
        let mut held: Vec<usize> = splits
            .iter()
            .flat_map(|split| split.held_out.clone())
            .collect();
        held.sort_unstable();
        assert_eq!(held, (0..7).collect::<Vec<_>>());
        assert!(
            splits
                .iter()
                .all(|split| split.fit.len() + split.held_out.len() == 7)
        );
    }
    let first = &leave_one_out(&logs).unwrap()[0];
    assert_eq!(first.held_out, [0, 6]);
    assert!(folds(&logs, 7, 1).is_err() && folds(&logs, 1, 1).is_err());
    assert!(split_by_log(&logs[..1], 0.5, 1).is_err() && leave_one_out(&[]).is_err());
    for fraction in [0.0, 1.0, f64::NAN] {
        assert!(split_by_log(&logs, fraction, 1).is_err());
    }
}

#[test]
fn equally_long_videos_are_one_group() {
    let mut logs = suite(Platform::Handheld, 4, 3);
    for (log, poses) in logs.iter_mut().zip([50, 60, 50, 50]) {
        log.format = Format::Iros20;
        log.stamps.truncate(poses);
        log.poses.truncate(poses);
    }
    logs[3].format = Format::Kitti;
    group_logs(&mut logs);
    assert_eq!(logs[0].group, logs[2].group);
    assert_ne!(logs[0].group, logs[1].group);
    assert_ne!(
        logs[0].group, logs[3].group,
        "only videos are grouped by length"
    );
}

#[test]
fn a_window_of_other_logs_has_no_poses() {
    let logs = suite(Platform::Drone, 1, 1);
    for window in [
        Window {
            trajectory: 1,
            start: 0,
            length: 5,
        },
        Window {
            trajectory: 0,
            start: usize::MAX,
            length: 5,
        },
        Window {
            trajectory: 0,
            start: logs[0].len() - 4,
            length: 5,
        },
    ] {
        assert!(window.poses(&logs).is_none());
    }
}

#[test]
fn a_resampled_log_still_names_the_rows_and_stamps_of_its_file() {
    let mut log = log_with_steps(&[50; 40]);
    log.rows = (0..41).map(|row| 3 + 2 * row).collect();
    log.row_kind = RowKind::Line;
    log.stamp_unit = Some(StampUnit::Seconds);
    let slow = resample(&log, 10.0).unwrap();
    assert_eq!(slow.rows[..3], [3, 7, 11]);
    assert_eq!(slow.source_stamps(), log.stamps);
    assert_eq!(slow.source_rows(), log.rows);
    assert_eq!(slow.place(2).as_deref(), Some("line 11"));
    assert_eq!(slow.stamp_in_file(2), log.stamp_in_file(4));
    assert_eq!(slow.place(21), None);
    // A second resampling does not forget the first log; between two recorded poses the nearer one counts.
    let slower = resample(&slow, 7.0).unwrap();
    assert_eq!(slower.source_stamps(), log.stamps);
    assert_eq!(slower.rows[..3], [3, 7, 15]);
    // A log at its own rate has the fingerprint it had.
    assert_eq!(
        resample(&log, 20.0).unwrap().fingerprint(),
        log.fingerprint()
    );
}
