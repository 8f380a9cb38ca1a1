//! Faults of the motion: steps within the range change, what follows is carried along.

use std::ops::Range;

use dose3_lie::{Matrix, Pose, Rotation, Vector, so3};
use nalgebra::UnitQuaternion;
use rand_chacha::ChaCha8Rng;

use super::{Axis, direction, from_forward_left_up, side};
use crate::{Frame, Trajectory};

pub(super) fn jump(log: &mut Trajectory, range: &Range<usize>, metres: f64, rng: &mut ChaCha8Rng) {
    let first = log.poses[range.start];
    let jump = first.rotation * direction(log.frame, rng) * metres;
    displace(log, range, |step| {
        if step.index == range.start + 1 {
            jump
        } else {
            Vector::zeros()
        }
    });
}

pub(super) fn drift_position(
    log: &mut Trajectory,
    range: &Range<usize>,
    metres_per_second: f64,
    rng: &mut ChaCha8Rng,
) {
    let first = log.poses[range.start];
    let velocity = first.rotation * direction(log.frame, rng) * metres_per_second;
    displace(log, range, |step| velocity * step.seconds);
}

/// `factor` takes the seconds since the start of the range.
pub(super) fn scale(log: &mut Trajectory, range: &Range<usize>, factor: impl Fn(f64) -> f64) {
    displace(log, range, |step| {
        (step.after.translation - step.before.translation) * (factor(step.since_start) - 1.0)
    });
}

pub(super) fn slip(log: &mut Trajectory, range: &Range<usize>, metres_per_second: f64) {
    let left = from_forward_left_up(log.frame, Vector::y());
    displace(log, range, |step| {
        step.before.rotation * left * (metres_per_second * step.seconds)
    });
}

pub(super) fn mirror_positions(log: &mut Trajectory, range: &Range<usize>, axis: Axis) {
    let change = reflection(log.frame, axis) - Matrix::identity();
    displace(log, range, |step| {
        change * (step.after.translation - step.before.translation)
    });
}

pub(super) fn drift_yaw(
    log: &mut Trajectory,
    range: &Range<usize>,
    radians_per_second: f64,
    rng: &mut ChaCha8Rng,
) {
    let rate = from_forward_left_up(log.frame, Vector::z()) * (side(rng) * radians_per_second);
    rewrite(log, range, |step| {
        let mut motion = step.before.relative(&step.after);
        motion.rotation *= so3::exp(&(rate * step.seconds));
        motion
    });
}

pub(super) fn reverse(log: &mut Trajectory, range: &Range<usize>) {
    let poses = log.poses[range.clone()].to_vec();
    rewrite(log, range, |step| {
        let from = range.end - step.index;
        poses[from].relative(&poses[from - 1])
    });
}

pub(super) fn mirror(log: &mut Trajectory, range: &Range<usize>, axis: Axis) {
    let mirror = reflection(log.frame, axis);
    rewrite(log, range, |step| {
        let motion = step.before.relative(&step.after);
        let rotation = mirror * motion.rotation.matrix() * mirror;
        Pose::new(
            // Two reflections: the product is as proper as the rotation between them.
            Rotation::from_matrix_unchecked(rotation),
            mirror * motion.translation,
        )
    });
}

/// The matrix that turns one axis around, in the frame's own axes.
fn reflection(frame: Frame, axis: Axis) -> Matrix {
    let normal = axis.direction(frame);
    Matrix::identity() - normal * normal.transpose() * 2.0
}

/// Gives the affected poses.
pub(super) fn closure(
    log: &mut Trajectory,
    range: &Range<usize>,
    metres: f64,
    seconds: f64,
    rng: &mut ChaCha8Rng,
) -> Range<usize> {
    let start = range.start + 1;
    if metres == 0.0 {
        return start..start;
    }
    let first = log.stamps[range.start];
    let limit = first.saturating_add((seconds * 1e9).round() as i64);
    // At least one step and at most all of them.
    let last = log.stamps[start..range.end - 1].partition_point(|stamp| *stamp < limit) + start;
    let end = limit.clamp(log.stamps[start], log.stamps[last]);
    let way = log.poses[range.start].rotation * direction(log.frame, rng) * metres;
    let stamps = log.stamps.clone();
    let done = |index: usize| (stamps[index].min(end) - first) as f64 / (end - first) as f64;
    displace(log, range, |step| {
        way * (done(step.index) - done(step.index - 1))
    });
    start..last + 1
}

/// The steps within the range become those between `faulty`, one pose for each of the range.
pub(super) fn take_steps(log: &mut Trajectory, range: &Range<usize>, faulty: &[Pose]) {
    rewrite(log, range, |step| {
        let index = step.index - range.start;
        faulty[index - 1].relative(&faulty[index])
    });
}

/// Positions within the range move as `faulty` does, one position for each pose of the range; rotations stay.
pub(super) fn take_positions(log: &mut Trajectory, range: &Range<usize>, faulty: &[Vector]) {
    displace(log, range, |step| {
        let index = step.index - range.start;
        let sound = step.after.translation - step.before.translation;
        (faulty[index] - faulty[index - 1]) - sound
    });
}

/// A step of the sound log, into pose `index`.
struct Step {
    index: usize,
    before: Pose,
    after: Pose,
    /// Length of the step by the stamps.
    seconds: f64,
    /// From the first stamp of the range to the end of the step.
    since_start: f64,
}

impl Step {
    fn new(stamps: &[i64], range: &Range<usize>, index: usize, before: Pose, after: Pose) -> Self {
        let seconds = |from: usize| (stamps[index] - stamps[from]) as f64 * 1e-9;
        Self {
            index,
            before,
            after,
            seconds: seconds(index - 1),
            since_start: seconds(range.start),
        }
    }
}

/// Adds a vector (world axes) to each step within the range; rotations stay as they are, to the last bit.
fn displace(log: &mut Trajectory, range: &Range<usize>, mut extra: impl FnMut(&Step) -> Vector) {
    let mut before = log.poses[range.start];
    let mut offset = Vector::zeros();
    for index in range.start + 1..range.end {
        let after = log.poses[index];
        offset += extra(&Step::new(&log.stamps, range, index, before, after));
        log.poses[index].translation += offset;
        before = after;
    }
    for pose in &mut log.poses[range.end..] {
        pose.translation += offset;
    }
}

/// Replaces each body-frame step within the range and chains them from its first pose on.
fn rewrite(log: &mut Trajectory, range: &Range<usize>, mut motion: impl FnMut(&Step) -> Pose) {
    let origin = log.poses[range.start];
    let mut before = origin;
    // Chained from zero and moved to the origin afterwards: UTM coordinates would cost seven digits at every step.
    let mut chained = Pose::new(origin.rotation, Vector::zeros());
    for index in range.start + 1..range.end {
        let after = log.poses[index];
        let step = Step::new(&log.stamps, range, index, before, after);
        chained = chained.compose(&motion(&step));
        chained.rotation = orthonormal(&chained.rotation);
        log.poses[index] = Pose::new(chained.rotation, origin.translation + chained.translation);
        before = after;
    }
    let last = log.poses[range.end - 1];
    let turn = last.rotation * before.rotation.inverse();
    for pose in &mut log.poses[range.end..] {
        *pose = Pose::new(
            orthonormal(&(turn * pose.rotation)),
            last.translation + turn * (pose.translation - before.translation),
        );
    }
}

/// The rotation without what long products have added to it by rounding.
fn orthonormal(rotation: &Rotation) -> Rotation {
    let quaternion = UnitQuaternion::from_rotation_matrix(rotation);
    UnitQuaternion::new_normalize(*quaternion.quaternion()).to_rotation_matrix()
}
