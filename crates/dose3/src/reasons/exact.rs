//! What no sensor that measures ever shows: poses that repeat, lie exactly on a line, keep a coordinate, or fall on a
//! grid.

use super::candidate::{Candidate, Stretch, span};
use super::words;
use crate::report::{ReasonAxis, ReasonKind};
use crate::series::{Axis, GRID_SPAN, GRID_STEP, Part, Quantity, Unit, grid, inner};
use std::ops::Range;

/// Longer than the longest of trusted logs by this factor.
const LONGER: f64 = 2.0;
/// Shorter runs of equal steps, and of a coordinate that stays (seconds), happen.
const SHORTEST_STEADY: f64 = 0.3;
const SHORTEST_FROZEN: f64 = 0.5;
/// Smaller shares of poses half-way between their neighbours happen.
const SMALLEST_SHARE: f64 = 0.2;
/// How much more certain these are than a number beyond its range.
const CERTAIN: f64 = 10.0;
/// Most of that.
const MOST: f64 = 50.0;

pub(super) fn candidates(stretch: &Stretch<'_>) -> Vec<Candidate> {
    let frozen = Axis::ALL
        .into_iter()
        .filter_map(|axis| frozen(stretch, axis));
    let mut found: Vec<Candidate> = frozen.collect();
    found.extend(repeats(stretch));
    found.extend(steady(stretch));
    found.extend(on_a_grid(stretch));
    found
}

/// Longest run of a quantity that counts seconds, and the longest of trusted windows.
fn longest(
    stretch: &Stretch<'_>,
    column: &[Option<f64>],
    quantity: Quantity,
) -> Option<(f64, f64)> {
    let trusted = stretch.ranges.get(quantity)?.window_high.high();
    let values = column[inner(&stretch.poses)].iter().flatten();
    Some((values.copied().fold(0.0, f64::max), trusted))
}

/// The poses at which a counted quantity is above `least`, and those that it counts from on.
fn counted(stretch: &Stretch<'_>, column: &[Option<f64>], least: f64) -> Option<Range<usize>> {
    let found = span(inner(&stretch.poses), |pose| {
        column[pose].is_some_and(|v| v > least)
    })?;
    let before = (column[found.start].unwrap_or(0.0) * stretch.hertz).round() as usize;
    Some(found.start.saturating_sub(before)..found.end)
}

fn certainty(amount: f64, trusted: f64, step: f64) -> f64 {
    (CERTAIN * (amount + step) / (LONGER * trusted + 2.0 * step)).clamp(CERTAIN, MOST)
}

fn repeats(stretch: &Stretch<'_>) -> Option<Candidate> {
    let step = 1.0 / stretch.hertz;
    let of = |part: Part| {
        let quantity = Quantity::Repeats(part);
        let column = stretch.motion.column(quantity);
        let (amount, trusted) = longest(stretch, &column, quantity)?;
        if amount < 0.5 * step || amount <= LONGER * trusted {
            return None;
        }
        let poses = counted(stretch, &column, 0.0)?;
        let times = poses
            .clone()
            .filter(|p| column[*p].is_some_and(|v| v > 0.0));
        Some((part, amount, trusted, times.count(), poses))
    };
    let (position, attitude) = (of(Part::Position), of(Part::Attitude));
    let (axis, (_, amount, trusted, times, poses)) = match (position, attitude) {
        (Some(position), Some(_)) => (ReasonAxis::Pose, position),
        (Some(position), None) => (ReasonAxis::Position, position),
        (None, Some(attitude)) => (ReasonAxis::Attitude, attitude),
        (None, None) => return None,
    };
    Some(Candidate {
        kind: ReasonKind::Repeats,
        axis,
        amount,
        trusted: Some([0.0, trusted]),
        unit: Unit::Second,
        strength: certainty(amount, trusted, step),
        sentence: words::repeats(
            axis,
            amount,
            (times as f64) * step > 1.5 * amount,
            times,
            trusted,
        ),
        poses,
        peak: None,
    })
}

fn steady(stretch: &Stretch<'_>) -> Option<Candidate> {
    let column = stretch.motion.column(Quantity::Steady);
    let range = stretch.ranges.get(Quantity::Steady)?;
    let (amount, trusted) = longest(stretch, &column, Quantity::Steady)?;
    let step = 1.0 / stretch.hertz;
    let candidate = |amount, trusted, unit, strength, sentence, poses| Candidate {
        kind: ReasonKind::Interpolated,
        axis: ReasonAxis::Pose,
        amount,
        trusted: Some([0.0, trusted]),
        unit,
        strength,
        poses,
        peak: None,
        sentence,
    };
    if amount >= SHORTEST_STEADY && amount > LONGER * trusted {
        let poses = counted(stretch, &column, 0.5 * amount)?;
        let sentence = words::steady(amount, trusted);
        let strength = certainty(amount, trusted, step);
        return Some(candidate(
            amount,
            trusted,
            Unit::Second,
            strength,
            sentence,
            poses,
        ));
    }
    // Every second pose, every fifth: short runs, but many.
    let between = |pose: &usize| column[*pose].is_some_and(|v| v > 0.0);
    let most = stretch.windows.iter().map(|window| {
        let within = inner(window);
        within.clone().filter(between).count() as f64 / within.len() as f64
    });
    let (share, trusted) = (most.fold(0.0, f64::max), range.window_share.high());
    if share < SMALLEST_SHARE || share <= LONGER * trusted {
        return None;
    }
    let poses = counted(stretch, &column, 0.0)?;
    let sentence = words::between(share, trusted);
    let strength = certainty(share, trusted, 0.05);
    Some(candidate(
        share,
        trusted,
        Unit::One,
        strength,
        sentence,
        poses,
    ))
}

fn frozen(stretch: &Stretch<'_>, axis: Axis) -> Option<Candidate> {
    let quantity = Quantity::Frozen(axis);
    let column = stretch.motion.column(quantity);
    let (amount, trusted) = longest(stretch, &column, quantity)?;
    if amount < SHORTEST_FROZEN || amount <= LONGER * trusted {
        return None;
    }
    Some(Candidate {
        kind: ReasonKind::Frozen,
        axis: axis.into(),
        amount,
        trusted: Some([0.0, trusted]),
        unit: Unit::Second,
        strength: certainty(amount, trusted, 0.2),
        poses: counted(stretch, &column, 0.5 * amount)?,
        peak: None,
        sentence: words::frozen(axis, amount, trusted, stretch.named),
    })
}

fn on_a_grid(stretch: &Stretch<'_>) -> Option<Candidate> {
    let trusted = stretch.ranges.grid;
    let starts = stretch.poses.clone().step_by(GRID_STEP);
    let spans: Vec<(Range<usize>, f64)> = starts
        .map(|start| start..start + GRID_SPAN)
        .filter(|span| span.end <= stretch.poses.end)
        .map(|span| (span.clone(), grid(&stretch.all[span])))
        .filter(|(_, grid)| *grid > LONGER * trusted)
        .collect();
    let (first, last) = (spans.first()?, spans.last()?);
    let mut sizes: Vec<f64> = spans.iter().map(|(_, grid)| *grid).collect();
    sizes.sort_by(f64::total_cmp);
    let amount = sizes[sizes.len() / 2];
    Some(Candidate {
        kind: ReasonKind::Grid,
        axis: ReasonAxis::Position,
        amount,
        trusted: Some([0.0, trusted]),
        unit: Unit::Metre,
        strength: 2.0 * MOST,
        poses: first.0.start..last.0.end,
        peak: None,
        sentence: words::grid(amount, trusted),
    })
}
