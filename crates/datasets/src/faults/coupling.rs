//! Faults of the coupling between position and attitude: each of both is sound, they do not belong together.
//!
//! The functions give what a log with the fault from first to last has at the poses of the range.

use std::ops::Range;

use dose3_lie::{Pose, Vector, se3, so3};

use crate::Trajectory;

pub(super) fn position_late(
    log: &Trajectory,
    stretch: &Range<usize>,
    range: &Range<usize>,
    seconds: f64,
) -> Vec<Vector> {
    late(log, stretch, range, seconds)
        .map(|pose| pose.translation)
        .collect()
}

pub(super) fn attitude_late(
    log: &Trajectory,
    stretch: &Range<usize>,
    range: &Range<usize>,
    seconds: f64,
) -> Vec<Pose> {
    let sound = &log.poses[range.clone()];
    late(log, stretch, range, seconds)
        .zip(sound)
        .map(|(late, pose)| Pose::new(late.rotation, pose.translation))
        .collect()
}

pub(super) fn lever_arm(poses: &[Pose], arm: Vector) -> Vec<Vector> {
    poses
        .iter()
        .map(|pose| pose.transform_point(&arm))
        .collect()
}

pub(super) fn extrinsic(poses: &[Pose], turn: Vector) -> Vec<Pose> {
    let turn = so3::exp(&turn);
    poses
        .iter()
        .map(|pose| Pose::new(pose.rotation * turn, pose.translation))
        .collect()
}

/// The poses of the range as they were this long before.
fn late<'a>(
    log: &'a Trajectory,
    stretch: &'a Range<usize>,
    range: &Range<usize>,
    seconds: f64,
) -> impl Iterator<Item = Pose> + 'a {
    let delay = (seconds * 1e9).round() as i64;
    range
        .clone()
        .map(move |index| pose_at(log, stretch, log.stamps[index].saturating_sub(delay)))
}

/// The pose at a time, straight between poses of the stretch; beyond its ends the one there.
pub(super) fn pose_at(log: &Trajectory, stretch: &Range<usize>, stamp: i64) -> Pose {
    let stamps = &log.stamps[stretch.clone()];
    let poses = &log.poses[stretch.clone()];
    let after = stamps.partition_point(|other| *other < stamp);
    if after == 0 {
        return poses[0];
    }
    let Some(later) = stamps.get(after) else {
        return poses[after - 1];
    };
    if *later == stamp {
        return poses[after];
    }
    let before = after - 1;
    let share = (stamp - stamps[before]) as f64 / (later - stamps[before]) as f64;
    se3::interpolate(&poses[before], &poses[after], share)
}
