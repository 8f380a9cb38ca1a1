//! Quantities that leave the range of trusted windows.

use super::candidate::{Candidate, Stretch, span};
use super::words;
use crate::report::{ReasonAxis, ReasonKind};
use crate::series::{Axis, Quantity, TrustedRange, WindowSummary, inner};
use dose3_ood::ranges::Quantiles;

/// The share of trusted windows on either side that the trusted range leaves out.
pub(super) const OUTSIDE: f64 = 0.01;
/// A quantity that hardly varies in trusted logs varies by at least this share of its size.
const LEAST_SPREAD: f64 = 0.02;
/// Noise below this (m/s, rad/s) counts as this.
const SMALLEST_NOISE: f64 = 1e-5;
/// What is seen in single poses tells less than what holds for a window.
const OF_SINGLE_POSES: f64 = 0.8;
/// A change of speed follows from something else; where that has a name of its own it goes first.
const OF_ACCELERATION: f64 = 0.5;
/// So does what the other axes do not explain.
const OF_COUPLING: f64 = 0.7;
/// A speed says less than the axis that it is along.
const OF_ALL_AXES: f64 = 0.7;
/// Going backward says more than going slowly.
const OF_BACKWARDS: f64 = 1.5;
/// Trusted logs of a body that goes forward do so in this share of their poses.
const FORWARD_SHARE: f64 = 0.8;

/// Which number of a window is beyond the trusted range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Its largest value is too high.
    High,
    /// Its smallest value is too low.
    Low,
    /// The value in the middle is too high.
    Above,
    /// The value in the middle is too low.
    Below,
}

impl Side {
    pub fn is_up(self) -> bool {
        matches!(self, Self::High | Self::Above)
    }

    pub fn is_of_window(self) -> bool {
        matches!(self, Self::Above | Self::Below)
    }
}

/// A number beyond its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Beyond {
    pub side: Side,
    pub amount: f64,
    pub trusted: [f64; 2],
    pub strength: f64,
}

/// All quantities that leave their range, each in its strongest way.
pub(super) fn candidates(stretch: &Stretch<'_>) -> Vec<Candidate> {
    let compared = |quantity: &Quantity| {
        !matches!(
            quantity,
            Quantity::Jump(_) | Quantity::Repeats(_) | Quantity::Steady | Quantity::Frozen(_)
        )
    };
    let all = Quantity::all().filter(compared);
    all.filter_map(|quantity| candidate(stretch, quantity))
        .collect()
}

fn candidate(stretch: &Stretch<'_>, quantity: Quantity) -> Option<Candidate> {
    let range = stretch.ranges.get(quantity)?;
    let column = stretch.motion.compared(quantity);
    let beyond = beyond(stretch, quantity, &column, range)?;
    let (side, trusted) = (beyond.side, beyond.trusted);
    let deviates = |pose: usize| {
        column[pose].is_some_and(|value| match side.is_up() {
            true => value > trusted[1],
            false => value < trusted[0],
        })
    };
    let poses = span(inner(&stretch.poses), deviates)?;
    let peak = (!side.is_of_window()).then(|| {
        let mut known = poses.clone().filter(|pose| column[*pose].is_some());
        known.find(|pose| column[*pose] == Some(beyond.amount))
    });
    let (kind, axis) = names(stretch, quantity, &beyond);
    Some(Candidate {
        kind,
        axis,
        amount: beyond.amount,
        trusted: Some(trusted),
        unit: quantity.unit(),
        strength: beyond.strength
            * weight(kind, axis)
            * if side.is_of_window() {
                1.0
            } else {
                OF_SINGLE_POSES
            },
        sentence: words::deviation(stretch, quantity, kind, &beyond, &poses),
        poses,
        peak: peak.flatten(),
    })
}

fn weight(kind: ReasonKind, axis: ReasonAxis) -> f64 {
    match kind {
        _ if matches!(axis, ReasonAxis::Position | ReasonAxis::Attitude) => OF_ALL_AXES,
        ReasonKind::Acceleration => OF_ACCELERATION,
        ReasonKind::Coupling => OF_COUPLING,
        ReasonKind::Backwards => OF_BACKWARDS,
        _ => 1.0,
    }
}

fn names(stretch: &Stretch<'_>, quantity: Quantity, beyond: &Beyond) -> (ReasonKind, ReasonAxis) {
    let axis = match quantity {
        Quantity::Speed => ReasonAxis::Position,
        Quantity::Turning => ReasonAxis::Attitude,
        Quantity::Sideslip => ReasonAxis::Left,
        Quantity::Climb => ReasonAxis::Up,
        other => other.axis().map_or(ReasonAxis::Pose, ReasonAxis::from),
    };
    let kind = match quantity {
        Quantity::Velocity(Axis::Forward) if backwards(stretch, beyond) => ReasonKind::Backwards,
        Quantity::Acceleration(_) => ReasonKind::Acceleration,
        Quantity::Noise(_) if beyond.side.is_up() => ReasonKind::Noise,
        Quantity::Noise(_) => ReasonKind::Smooth,
        Quantity::Unexplained(_) => ReasonKind::Coupling,
        Quantity::Sideslip | Quantity::Climb => ReasonKind::Direction,
        _ => ReasonKind::Velocity,
    };
    (kind, axis)
}

/// Whether a body that goes forward in trusted logs goes backward.
fn backwards(stretch: &Stretch<'_>, beyond: &Beyond) -> bool {
    let range = stretch.ranges.get(Quantity::Velocity(Axis::Forward));
    let forward = range.is_some_and(|r| r.window_share.median() >= FORWARD_SHARE);
    stretch.named && forward && !beyond.side.is_up() && beyond.amount < 0.0
}

fn beyond(
    stretch: &Stretch<'_>,
    quantity: Quantity,
    column: &[Option<f64>],
    range: &TrustedRange,
) -> Option<Beyond> {
    let whole = WindowSummary::of(&column[inner(&stretch.poses)])?;
    let medians: Vec<f64> = stretch
        .windows
        .iter()
        .filter_map(|w| Some(WindowSummary::of(&column[inner(w)])?.median))
        .collect();
    let most = medians.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = medians.iter().copied().fold(f64::INFINITY, f64::min);
    let sides = [
        (Side::High, whole.high, &range.window_high),
        (Side::Low, whole.low, &range.window_low),
        (Side::Above, most, &range.window_median),
        (Side::Below, least, &range.window_median),
    ];
    let found = sides.into_iter().filter_map(|(side, amount, quantiles)| {
        let strength = strength(quantity, side, amount, quantiles);
        let trusted = match side.is_of_window() {
            true => [quantiles.at(OUTSIDE), quantiles.at(1.0 - OUTSIDE)],
            false => [
                range.window_low.at(OUTSIDE),
                range.window_high.at(1.0 - OUTSIDE),
            ],
        };
        let beyond = Beyond {
            side,
            amount,
            trusted,
            strength,
        };
        (amount.is_finite() && strength > 1.0).then_some(beyond)
    });
    found.max_by(|a, b| a.strength.total_cmp(&b.strength))
}

/// 1 at the end of the trusted range, and more by the logarithm of how many times as far it is: from zero for a level
/// of noise, which has none below, else from the trusted median.
fn strength(quantity: Quantity, side: Side, amount: f64, trusted: &Quantiles) -> f64 {
    let end = match side.is_up() {
        true => trusted.at(1.0 - OUTSIDE),
        false => trusted.at(OUTSIDE),
    };
    if let Quantity::Noise(_) = quantity {
        let level = |x: f64| x.max(SMALLEST_NOISE);
        return match side.is_up() {
            true => times(level(amount) / level(end)),
            false => times(level(end) / level(amount)),
        };
    }
    let median = trusted.median();
    let away = match side.is_up() {
        true => amount - median,
        false => median - amount,
    };
    let least = (LEAST_SPREAD * median.abs()).max(1e-6);
    times(away / (end - median).abs().max(least))
}

/// The strength of what is so many times as far out as trusted.
pub(super) fn times(ratio: f64) -> f64 {
    1.0 + ratio.max(1e-3).ln()
}
