//! Single steps that go elsewhere than the steps around them.

use super::candidate::{Candidate, Stretch};
use super::deviation::{OUTSIDE, times};
use super::words;
use crate::report::{ReasonAxis, ReasonKind};
use crate::series::{Part, Quantity, Unit, inner};

/// Poses on both sides that a jump stands out of.
const AROUND: usize = 32;
/// It is this many times what nine of ten of these do; else all is rough, which is noise.
const ISOLATED: f64 = 5.0;
/// Smaller jumps (metres, radians) are none.
const SMALLEST: f64 = 1e-3;

pub(super) fn candidates(stretch: &Stretch<'_>) -> Vec<Candidate> {
    let parts = [Part::Position, Part::Attitude];
    parts
        .into_iter()
        .filter_map(|part| candidate(stretch, part))
        .collect()
}

fn candidate(stretch: &Stretch<'_>, part: Part) -> Option<Candidate> {
    let quantity = Quantity::Jump(part);
    let range = stretch.ranges.get(quantity)?;
    let column = stretch.motion.column(quantity);
    let size = |pose: usize| column[pose].unwrap_or(0.0);
    let peak = inner(&stretch.poses).max_by(|a, b| size(*a).total_cmp(&size(*b)))?;
    let amount = size(peak);
    if amount < SMALLEST {
        return None;
    }
    let near = peak.saturating_sub(AROUND)..(peak + AROUND + 1).min(column.len());
    let mut around: Vec<f64> = column[near].iter().flatten().copied().collect();
    around.sort_by(f64::total_cmp);
    let usual = around[(around.len() * 9 / 10).min(around.len() - 1)];
    let trusted = range.window_high.at(1.0 - OUTSIDE);
    if amount <= trusted || amount < ISOLATED * usual {
        return None;
    }
    let strength = times(amount / trusted.max(SMALLEST));
    let (axis, unit) = match part {
        Part::Position => (ReasonAxis::Position, Unit::Metre),
        Part::Attitude => (ReasonAxis::Attitude, Unit::Radian),
    };
    Some(Candidate {
        kind: ReasonKind::Jump,
        axis,
        amount,
        trusted: Some([0.0, trusted]),
        unit,
        strength: strength.max(1.0),
        poses: peak - 1..peak + 1,
        peak: Some(peak),
        sentence: words::jump(part, amount, 1.0 / stretch.hertz, trusted),
    })
}
