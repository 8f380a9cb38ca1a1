//! Small clean files of every format, to be damaged by the tests.
#![allow(dead_code)] // every test binary uses its own part

pub mod bad;
pub mod faults;

use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::{Trajectory, write};

/// A short drive.
pub fn drive(poses: usize) -> Trajectory {
    let mut log = trajectory(Platform::Vehicle, 5, poses, 10.0);
    // An epoch as real logs have it, in whole microseconds.
    log.stamps
        .iter_mut()
        .for_each(|stamp| *stamp += 1_547_215_350_000_000_000);
    log
}

fn text(write: impl Fn(&mut Vec<u8>) -> std::io::Result<()>) -> String {
    let mut bytes = Vec::new();
    write(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

pub fn kitti(poses: usize) -> String {
    text(|sink| write::kitti(sink, &drive(poses)))
}

pub fn kitti_times(poses: usize) -> String {
    text(|sink| write::kitti_times(sink, &drive(poses)))
}

pub fn tum(poses: usize) -> String {
    text(|sink| write::tum(sink, &drive(poses)))
}

pub fn euroc(poses: usize) -> String {
    text(|sink| write::euroc(sink, &drive(poses)))
}

pub fn ins(poses: usize) -> String {
    text(|sink| write::robotcar_ins(sink, &drive(poses)))
}

pub fn vo(poses: usize) -> String {
    text(|sink| write::robotcar_vo(sink, &drive(poses)))
}

pub fn npy(poses: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    write::iros20(&mut bytes, &drive(poses), write::Precision::Single).unwrap();
    bytes
}

/// The text with one line (counted from 1) replaced.
pub fn with_line(text: &str, line: usize, new: &str) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    lines[line - 1] = new;
    lines.join("\n") + "\n"
}

/// The text with one field (both counted from 1) of one line replaced.
pub fn with_field(text: &str, line: usize, field: usize, new: &str) -> String {
    let old = text.lines().nth(line - 1).unwrap();
    let separator = if old.contains(',') { "," } else { " " };
    let mut fields: Vec<&str> = old.split(separator).collect();
    fields[field - 1] = new;
    with_line(text, line, &fields.join(separator))
}

/// The text with one line (counted from 1) copied in after another.
pub fn with_copy(text: &str, line: usize, after: usize) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    lines.insert(after, lines[line - 1]);
    lines.join("\n") + "\n"
}

/// Poses that are not finite, or whose rotation is not one within a tolerance.
pub fn bad_poses(log: &Trajectory, tolerance: f64) -> usize {
    let is_bad = |pose: &&dose3_lie::Pose| {
        let r = pose.rotation.matrix();
        let error = (r.tr_mul(r) - dose3_lie::Matrix::identity()).amax();
        let good =
            pose.is_finite() && error < tolerance && (r.determinant() - 1.0).abs() < tolerance;
        !good
    };
    log.poses.iter().filter(is_bad).count()
}
