//! Faults of time: poses are repeated, lost or shifted against their stamps.

use std::f64::consts::TAU;
use std::ops::Range;

use dose3_lie::se3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::Trajectory;

/// Length of a wave of the time warp, seconds, where the range is long enough.
const WAVE: f64 = 10.0;

/// Gives the affected poses, as the others do that change their number.
pub(super) fn freeze(log: &mut Trajectory, range: &Range<usize>, seconds: f64) -> Range<usize> {
    let first = log.stamps[range.start];
    let limit = (seconds * 1e9).round() as i64;
    let held = log.stamps[range.clone()].partition_point(|stamp| stamp - first <= limit);
    let start = range.start + 1;
    // Nothing to repeat, nothing to catch up with.
    if held < 2 {
        return start..start;
    }
    let end = range.start + held;
    let pose = log.poses[range.start];
    log.poses[start..end].fill(pose);
    start..(end + 1).min(log.len())
}

pub(super) fn drop(
    log: &mut Trajectory,
    range: &Range<usize>,
    share: f64,
    rng: &mut ChaCha8Rng,
) -> Range<usize> {
    let start = range.start + 1;
    let kept: Vec<usize> = (start..range.end)
        .filter(|_| !rng.random_bool(share))
        .collect();
    if kept.len() == range.end - start {
        return start..start;
    }
    let last_is_lost = kept.last() != Some(&(range.end - 1));
    let stamps = kept.iter().map(|index| log.stamps[*index]).collect();
    replace(log, start..range.end, &kept, stamps);
    let end = start + kept.len() + usize::from(last_is_lost);
    start..end.min(log.len())
}

/// Pose `i` becomes the pose at `w(t_i)` with `w(t) = t + depth P / 2 pi (1 - cos(2 pi t / P))`, seconds from the
/// start of the range, whose duration is a multiple of `P`: speed `1 + depth sin(2 pi t / P)`.
pub(super) fn warp(log: &mut Trajectory, range: &Range<usize>, depth: f64) {
    let poses = log.poses[range.clone()].to_vec();
    let stamps = &log.stamps[range.clone()];
    let time: Vec<f64> = stamps
        .iter()
        .map(|stamp| (stamp - stamps[0]) as f64 * 1e-9)
        .collect();
    let duration = time[time.len() - 1];
    let period = duration / (duration / WAVE).round().max(1.0);
    for (index, seconds) in time.iter().enumerate() {
        let phase = TAU * seconds / period;
        let warped = seconds + depth * period / TAU * (1.0 - phase.cos());
        let after = time
            .partition_point(|time| *time < warped)
            .clamp(1, time.len() - 1);
        let before = after - 1;
        let share = (warped - time[before]) / (time[after] - time[before]);
        log.poses[range.start + index] =
            se3::interpolate(&poses[before], &poses[after], share.clamp(0.0, 1.0));
    }
}

pub(super) fn rate(log: &mut Trajectory, range: &Range<usize>, factor: f64) -> Range<usize> {
    let sources: Vec<usize> = (0..)
        .map(|index| range.start + (f64::from(index) * factor) as usize)
        .take_while(|source| *source < range.end)
        .collect();
    let step = 1e9 / log.rate.hertz;
    let first = log.stamps[range.start];
    let claimed = |index: usize| first.saturating_add((index as f64 * step).round() as i64);
    let stamps: Vec<i64> = (0..sources.len()).map(claimed).collect();
    // The log after the range goes on after the step that it had there.
    let later = claimed(sources.len() - 1) - log.stamps[range.end - 1];
    let sound = sources.iter().copied().eq(range.clone());
    let last_is_skipped = sources.last() != Some(&(range.end - 1));
    replace(log, range.clone(), &sources, stamps);
    let end = range.start + sources.len();
    for stamp in &mut log.stamps[end..] {
        *stamp = stamp.saturating_add(later);
    }
    let start = range.start + 1;
    if sound {
        return start..start;
    }
    start..(end + usize::from(last_is_skipped)).min(log.len())
}

/// Puts poses `sources` with new stamps in the place of the poses of a range without breaks inside.
pub(super) fn replace(
    log: &mut Trajectory,
    range: Range<usize>,
    sources: &[usize],
    stamps: Vec<i64>,
) {
    let poses: Vec<_> = sources.iter().map(|index| log.poses[*index]).collect();
    let rows: Vec<_> = sources.iter().map(|index| log.rows[*index]).collect();
    for index in &mut log.breaks {
        if *index >= range.end {
            *index = *index - range.len() + sources.len();
        }
    }
    log.poses.splice(range.clone(), poses);
    log.rows.splice(range.clone(), rows);
    log.stamps.splice(range, stamps);
}
