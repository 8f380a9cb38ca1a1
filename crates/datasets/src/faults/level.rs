//! Faults that take a degree of freedom of a vehicle from somewhere else.
//!
//! The functions give what a log with the fault from first to last has at the poses of the range.

use std::ops::Range;

use dose3_lie::{Pose, Vector};

use super::from_forward_left_up;
use crate::read::euler_rotation;
use crate::write::euler_angles;
use crate::{Frame, Trajectory};

/// Below this speed a course says nothing, metres a second.
const SLOWEST: f64 = 0.3;

pub(super) fn frozen_height(poses: &[Pose], frame: Frame) -> Vec<Vector> {
    let up = from_forward_left_up(frame, Vector::z());
    let first = poses
        .first()
        .map_or(Vector::zeros(), |pose| pose.translation);
    let climbed = |place: Vector| up * up.dot(&(place - first));
    poses
        .iter()
        .map(|pose| pose.translation - climbed(pose.translation))
        .collect()
}

pub(super) fn level(poses: &[Pose], frame: Frame) -> Vec<Pose> {
    let with_angles = |pose: &Pose| change_angles(pose, frame, |[_, _, yaw]| [0.0, 0.0, yaw]);
    poses.iter().map(with_angles).collect()
}

pub(super) fn heading_from_course(
    log: &Trajectory,
    stretch: &Range<usize>,
    range: &Range<usize>,
) -> Vec<Pose> {
    let axes = log.frame.to_forward_left_up();
    let mut course = None;
    range
        .clone()
        .map(|index| {
            if index > stretch.start {
                let step = log.poses[index].translation - log.poses[index - 1].translation;
                let step = axes * step;
                let seconds = (log.stamps[index] - log.stamps[index - 1]) as f64 * 1e-9;
                if step.xy().norm() >= SLOWEST * seconds {
                    course = Some(step.y.atan2(step.x));
                }
            }
            change_angles(&log.poses[index], log.frame, |[roll, pitch, yaw]| {
                [roll, pitch, *course.get_or_insert(yaw)]
            })
        })
        .collect()
}

/// Roll, pitch and yaw of forward-left-up body against world axes of the same convention, changed.
fn change_angles(pose: &Pose, frame: Frame, change: impl FnOnce([f64; 3]) -> [f64; 3]) -> Pose {
    let axes = frame.to_forward_left_up();
    let [roll, pitch, yaw] = change(euler_angles(&(axes * pose.rotation * axes.inverse())));
    let rotation = axes.inverse() * euler_rotation(roll, pitch, yaw) * axes;
    Pose::new(rotation, pose.translation)
}
