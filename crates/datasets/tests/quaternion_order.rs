//! The order of the quaternions of files that do not say it: found where the motion or the first row tells, never
//! turned in sound logs, and said where it is assumed.

use std::ops::Range;

use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::{LoadOptions, RemarkKind, Trajectory, load_bytes};
use dose3_lie::so3;
use nalgebra::UnitQuaternion;

const POSES: usize = 3000;

/// Rows of a log without a header.
fn text(log: &Trajectory, rows: Range<usize>, w_first: bool, separator: &str) -> String {
    rows.map(|row| {
        let pose = &log.poses[row];
        let p = pose.translation;
        let q = UnitQuaternion::from_rotation_matrix(&pose.rotation);
        let q = if w_first {
            [q.w, q.i, q.j, q.k]
        } else {
            [q.i, q.j, q.k, q.w]
        };
        let numbers = [p.x, p.y, p.z].into_iter().chain(q);
        let words: Vec<String> = numbers.map(|number| format!("{number:.7}")).collect();
        let stamp = format!("{:.3}", 1.6e9 + row as f64 / 20.0);
        format!("{stamp}{separator}{}\n", words.join(separator))
    })
    .collect()
}

fn read(text: &str) -> Trajectory {
    load_bytes("log.txt", text.as_bytes(), &LoadOptions::default()).unwrap()
}

/// What was said of the order.
fn said(log: &Trajectory) -> Option<&str> {
    let mut remarks = log.report.remarks.iter();
    let found = remarks.find(|remark| remark.kind == RemarkKind::QuaternionOrder);
    found.map(|remark| remark.text.as_str())
}

#[track_caller]
fn check(read: &Trajectory, truth: &Trajectory, rows: Range<usize>, what: &str) {
    assert_eq!(read.len(), rows.len(), "{what}");
    for (pose, truth) in read.poses.iter().zip(&truth.poses[rows]) {
        let off = so3::log(&(truth.rotation.inverse() * pose.rotation)).norm();
        assert!(off < 1e-5, "{what}: off by {off} rad, {:?}", said(read));
    }
}

#[test]
fn a_drive_with_w_first_is_read_right_from_its_start_and_from_its_middle() {
    for seed in 0..10 {
        let drive = trajectory(Platform::Vehicle, seed, POSES, 20.0);
        for separator in [" ", ","] {
            for rows in [0..POSES, 1000..2200] {
                let what = format!("seed {seed}, `{separator}`, rows {rows:?}");
                let log = read(&text(&drive, rows.clone(), true, separator));
                check(&log, &drive, rows, &what);
                assert!(said(&log).unwrap().contains("as w, x, y, z:"), "{what}");
            }
        }
    }
}

#[test]
fn a_header_is_not_overruled_by_the_motion_of_a_few_poses() {
    // A circle, with w first under a header that says last: of many poses it is found, of few the header holds.
    let of = |poses: usize| {
        let row = |i: usize| {
            let turn = i as f64 / 10.0;
            let (sin, cos) = turn.sin_cos();
            let (z, w) = (turn / 2.0).sin_cos();
            format!("{:.1} {sin} {} 0 {w} 0 0 {z}\n", 1e9 + turn, 1.0 - cos)
        };
        let rows: String = (0..poses).map(row).collect();
        read(&format!("# timestamp tx ty tz qx qy qz qw\n{rows}"))
    };
    for poses in [20, 200] {
        assert!(said(&of(poses)).unwrap().contains("as w, x, y, z:"));
    }
    for poses in [4, 10, 19] {
        assert_eq!(said(&of(poses)), None, "{poses} poses");
    }
}

#[test]
fn sound_logs_of_all_platforms_are_left_as_they_are() {
    for platform in Platform::ALL {
        for seed in 0..6 {
            let truth = trajectory(platform, seed, POSES, 20.0);
            for separator in [" ", ","] {
                for rows in [0..POSES, 1000..2200, 500..700] {
                    let what = format!("{platform} {seed}, `{separator}`, rows {rows:?}");
                    let log = read(&text(&truth, rows.clone(), false, separator));
                    check(&log, &truth, rows, &what);
                }
            }
        }
    }
}

#[test]
fn where_the_motion_does_not_tell_the_first_row_does_and_else_the_habit_is_said() {
    let standing = |first: &str, rest: &str| -> String {
        (0..60)
            .map(|row| {
                let q = if row == 0 { first } else { rest };
                format!("{}.5 1 2 3 {q}\n", 1_600_000_000 + row)
            })
            .collect()
    };
    let log = read(&standing("1 0 0 0", "0.8 0.6 0 0"));
    assert!(said(&log).unwrap().contains("begins without a rotation"));
    assert!((so3::log(&log.poses[5].rotation).norm() - 2.0 * 0.6_f64.asin()).abs() < 1e-9);
    let log = read(&standing("0 0 0 1", "0 0 0.6 0.8"));
    assert_eq!(said(&log), None);
    let log = read(&standing("0.8 0.6 0 0", "0.8 0.6 0 0"));
    assert!(said(&log).unwrap().contains("x, y, z, w, the habit"));
    assert!((so3::log(&log.poses[5].rotation).norm() - std::f64::consts::PI).abs() < 1e-9);
}

#[test]
fn packed_data_that_end_early_or_are_damaged_are_told_in_plain_words() {
    let drive = trajectory(Platform::Vehicle, 0, 400, 20.0);
    let plain = text(&drive, 0..400, false, " ");
    let level = ruzstd::encoding::CompressionLevel::Fastest;
    let packed = ruzstd::encoding::compress_to_vec(plain.as_bytes(), level);
    let fails = |bytes: &[u8]| {
        load_bytes("a.zst", bytes, &LoadOptions::default())
            .unwrap_err()
            .to_string()
    };
    for cut in [4, 5, 7, packed.len() / 2, packed.len() - 1] {
        let error = fails(&packed[..cut]);
        assert!(error.contains("found zstd data that end early"), "{error}");
        assert!(error.starts_with("a.zst"), "{error}");
    }
    // A block of the kind that is reserved.
    let mut damaged = packed[..4].to_vec();
    damaged.extend([0x00, 0x58, 0x07, 0x00, 0x00, 0x00]);
    let error = fails(&damaged);
    assert!(error.contains("found damaged zstd data"), "{error}");
    assert!(!error.contains("Error"), "{error}");
}
