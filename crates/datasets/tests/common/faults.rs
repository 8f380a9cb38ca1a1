//! Logs that faults are put into, and what changes.

use std::ops::Range;

use dose3_datasets::faults::Fault;
use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::{Format, Frame, Trajectory};
use dose3_lie::{Pose, Rotation, Vector};

pub const RANGE: Range<usize> = 100..500;
pub const HERTZ: f64 = 10.0;
/// Seconds from the first to the last pose of the range.
pub const SECONDS: f64 = 39.9;
pub const SPEED: f64 = 8.0;

/// A car that drives, with all its bends and bumps.
pub fn drive() -> Trajectory {
    trajectory(Platform::Vehicle, 3, 700, HERTZ)
}

/// A car on a straight road at constant speed, not along an axis of the world.
pub fn straight() -> Trajectory {
    let heading = Rotation::from_euler_angles(0.02, -0.03, 0.7);
    let poses = (0..700).map(|index| {
        let ahead = Vector::x() * (SPEED / HERTZ * f64::from(index));
        Pose::new(heading, heading * ahead + Vector::new(50.0, -20.0, 3.0))
    });
    let stamps = (0..700).map(|index| 1_000 + index * 100_000_000).collect();
    Trajectory::new(
        "straight",
        Format::Tum,
        Frame::BodyFlu,
        stamps,
        poses.collect(),
    )
}

pub fn faulty(name: &str, log: &Trajectory, seed: u64) -> Trajectory {
    name.parse::<Fault>()
        .unwrap()
        .apply(log, RANGE, seed)
        .unwrap()
}

pub fn step(log: &Trajectory, pose: usize) -> Pose {
    log.poses[pose - 1].relative(&log.poses[pose])
}

/// From the sound pose to the faulty one, world axes.
pub fn offset(faulty: &Trajectory, sound: &Trajectory, pose: usize) -> Vector {
    faulty.poses[pose].translation - sound.poses[pose].translation
}

#[track_caller]
pub fn near(value: f64, expected: f64, tolerance: f64) {
    assert!(
        (value - expected).abs() < tolerance,
        "{value}, expected {expected}"
    );
}
