//! Poses that are not measured but made from others: means, interpolation, repetition.

use std::ops::Range;

use dose3_lie::{Pose, Vector, se3, so3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::Trajectory;

/// Running means of the poses of the range. Towards the ends of the stretch they are as long as both sides of a pose
/// can be.
pub(super) fn smooth(
    log: &Trajectory,
    stretch: &Range<usize>,
    range: &Range<usize>,
    seconds: f64,
) -> Vec<Pose> {
    let stamps = &log.stamps[stretch.clone()];
    let poses = &log.poses[stretch.clone()];
    let half = (seconds * 0.5e9).round() as i64;
    let (first, last) = (stamps[0], stamps[stamps.len() - 1]);
    let mean = |index: usize| {
        let stamp = stamps[index];
        let half = half.min(stamp - first).min(last - stamp);
        let from = stamps.partition_point(|other| *other < stamp - half);
        let to = stamps.partition_point(|other| *other <= stamp + half);
        let middle = &poses[index];
        let (mut place, mut turn) = (Vector::zeros(), Vector::zeros());
        for pose in &poses[from..to] {
            place += pose.translation - middle.translation;
            turn += so3::log(&(middle.rotation.inverse() * pose.rotation));
        }
        let share = 1.0 / (to - from) as f64;
        Pose::new(
            middle.rotation * so3::exp(&(turn * share)),
            middle.translation + place * share,
        )
    };
    range
        .clone()
        .map(|index| mean(index - stretch.start))
        .collect()
}

/// Gives the affected poses, as the functions below do.
pub(super) fn bridge(log: &mut Trajectory, range: &Range<usize>, seconds: f64) -> Range<usize> {
    let start = range.start + 1;
    let limit = log.stamps[range.start].saturating_add((seconds * 1e9).round() as i64);
    let last = start + log.stamps[start..range.end - 1].partition_point(|stamp| *stamp < limit);
    if last == start {
        return start..start;
    }
    between(log, range.start, last);
    start..last + 1
}

pub(super) fn interpolate(log: &mut Trajectory, range: &Range<usize>, factor: f64) -> Range<usize> {
    let start = range.start + 1;
    let measured = (0..).map(|step| range.start + (f64::from(step) * factor).round() as usize);
    let last = range.end - 1;
    let mut before = range.start;
    let mut changed = false;
    for after in measured.skip(1).map(|index| index.min(last)) {
        between(log, before, after);
        changed |= after - before > 1;
        before = after;
        if after == last {
            break;
        }
    }
    if changed {
        start..range.end
    } else {
        start..start
    }
}

/// Poses between two of them lie on the straight way from one to the other.
fn between(log: &mut Trajectory, before: usize, after: usize) {
    let (first, last) = (log.poses[before], log.poses[after]);
    let (from, to) = (log.stamps[before], log.stamps[after]);
    for index in before + 1..after {
        let share = (log.stamps[index] - from) as f64 / (to - from) as f64;
        log.poses[index] = se3::interpolate(&first, &last, share);
    }
}

pub(super) fn stale(
    log: &mut Trajectory,
    range: &Range<usize>,
    share: f64,
    rng: &mut ChaCha8Rng,
) -> Range<usize> {
    let start = range.start + 1;
    let mut changed = false;
    for index in start..range.end {
        if rng.random_bool(share) {
            log.poses[index] = log.poses[index - 1];
            changed = true;
        }
    }
    if changed {
        start..(range.end + 1).min(log.len())
    } else {
        start..start
    }
}
