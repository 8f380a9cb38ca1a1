//! Faults of the stamps: poses are there at other times than a sound sensor would send them.

use std::ops::Range;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::coupling::pose_at;
use super::timing::replace;
use crate::Trajectory;

/// Between poses that come together, nanoseconds.
const TOGETHER: i64 = 1_000_000;
/// Between stamps that would be equal or in the wrong order, nanoseconds.
const APART: i64 = 1_000;

/// Gives the affected poses, as the others do that change their number.
pub(super) fn stall(log: &mut Trajectory, range: &Range<usize>, seconds: f64) -> Range<usize> {
    let start = range.start + 1;
    let end = first_after(log, range, seconds);
    if end == start {
        return start..start;
    }
    replace(log, start..end, &[], Vec::new());
    start..start + 1
}

pub(super) fn burst(log: &mut Trajectory, range: &Range<usize>, seconds: f64) -> Range<usize> {
    let start = range.start + 1;
    let end = first_after(log, range, seconds);
    let (first, last) = (log.stamps[range.start], log.stamps[end]);
    let waiting = (end - start) as i64;
    if waiting == 0 {
        return start..start;
    }
    let apart = TOGETHER.min((last - first) / (waiting + 1));
    for (late, stamp) in log.stamps[start..end].iter_mut().rev().enumerate() {
        *stamp = last - (late as i64 + 1) * apart;
    }
    start..end + 1
}

/// The first pose of the range that comes this long after its first one, or its last.
fn first_after(log: &Trajectory, range: &Range<usize>, seconds: f64) -> usize {
    let start = range.start + 1;
    let limit = log.stamps[range.start].saturating_add((seconds * 1e9).round() as i64);
    start + log.stamps[start..range.end - 1].partition_point(|stamp| *stamp < limit)
}

pub(super) fn jitter(
    log: &mut Trajectory,
    range: &Range<usize>,
    seconds: f64,
    rng: &mut ChaCha8Rng,
) {
    if seconds == 0.0 {
        return;
    }
    let (first, last) = (log.stamps[range.start], log.stamps[range.end - 1]);
    let inner = &mut log.stamps[range.start + 1..range.end - 1];
    for stamp in inner.iter_mut() {
        let noise: f64 = rng.sample(StandardNormal);
        *stamp = stamp.saturating_add((noise * seconds * 1e9).round() as i64);
    }
    inner.sort_unstable();
    let count = inner.len() as i64;
    let apart = APART.min((last - first) / (count + 1));
    let mut before = first;
    for (index, stamp) in inner.iter_mut().enumerate() {
        let latest = last - (count - index as i64) * apart;
        *stamp = (*stamp).min(latest).max(before + apart);
        before = *stamp;
    }
}

pub(super) fn double(
    log: &mut Trajectory,
    range: &Range<usize>,
    share: f64,
    rng: &mut ChaCha8Rng,
) -> Range<usize> {
    let start = range.start + 1;
    let mut sources = Vec::new();
    let mut stamps = Vec::new();
    for index in range.clone() {
        let stamp = log.stamps[index];
        sources.push(index);
        stamps.push(stamp);
        if index + 1 == range.end || !rng.random_bool(share) {
            continue;
        }
        // Between neighbours a nanosecond apart there is no room for a copy.
        let later = TOGETHER.min((log.stamps[index + 1] - stamp) / 2);
        if later > 0 {
            sources.push(index);
            stamps.push(stamp + later);
        }
    }
    if sources.len() == range.len() {
        return start..start;
    }
    let end = range.start + sources.len();
    replace(log, range.clone(), &sources, stamps);
    start..end
}

pub(super) fn uneven(log: &mut Trajectory, range: &Range<usize>, depth: f64, rng: &mut ChaCha8Rng) {
    let sound = log.clone();
    for index in range.start + 1..range.end - 1 {
        let share: f64 = rng.random_range(-1.0..1.0) * depth / 2.0;
        let step = if share < 0.0 {
            sound.stamps[index] - sound.stamps[index - 1]
        } else {
            sound.stamps[index + 1] - sound.stamps[index]
        };
        // Towards zero: two neighbours that come together stay in order.
        let stamp = sound.stamps[index] + (share * step as f64) as i64;
        log.stamps[index] = stamp;
        log.poses[index] = pose_at(&sound, range, stamp);
    }
}

pub(super) fn thin(log: &mut Trajectory, range: &Range<usize>, factor: f64) -> Range<usize> {
    let start = range.start + 1;
    let sources: Vec<usize> = (0..)
        .map(|step| range.start + (f64::from(step) * factor) as usize)
        .take_while(|source| *source < range.end)
        .collect();
    if sources.len() == range.len() {
        return start..start;
    }
    let last_is_skipped = sources.last() != Some(&(range.end - 1));
    let stamps = sources.iter().map(|index| log.stamps[*index]).collect();
    let end = range.start + sources.len() + usize::from(last_is_skipped);
    replace(log, range.clone(), &sources, stamps);
    start..end.min(log.len())
}
