//! Gap-free stretches of a log.

use std::ops::Range;

use crate::Trajectory;

/// Median step between stamps in seconds; `None` with fewer than two stamps.
pub(crate) fn median_step(stamps: &[i64]) -> Option<f64> {
    let mut steps: Vec<i64> = stamps
        .windows(2)
        .map(|pair| pair[1].saturating_sub(pair[0]))
        .collect();
    if steps.is_empty() {
        return None;
    }
    let middle = steps.len() / 2;
    let (_, median, _) = steps.select_nth_unstable(middle);
    Some((*median).max(1) as f64 * 1e-9)
}

/// The parts of a log without a gap, in order; together they cover every pose once.
///
/// A new stretch starts after a step between stamps longer than `max_gap` seconds, and at every index in
/// [`Trajectory::breaks`]. `None` is ten times the median step but at least half a second: single lost
/// frames, which every real sensor has, do not cut a log, a pause of the recording does.
pub fn stretches(trajectory: &Trajectory, max_gap: Option<f64>) -> Vec<Range<usize>> {
    let stamps = &trajectory.stamps;
    let mut ranges = Vec::new();
    if stamps.is_empty() {
        return ranges;
    }
    let limit = max_gap.unwrap_or_else(|| (10.0 * median_step(stamps).unwrap_or(0.0)).max(0.5));
    let mut start = 0;
    for index in 1..stamps.len() {
        let step = stamps[index].saturating_sub(stamps[index - 1]) as f64 * 1e-9;
        if step > limit || trajectory.breaks.binary_search(&index).is_ok() {
            ranges.push(start..index);
            start = index;
        }
    }
    ranges.push(start..stamps.len());
    ranges
}
