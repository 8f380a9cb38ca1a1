//! One quantity of a stretch against its trusted range.

use crate::report::{Place, Reason, ReasonAxis, ReasonKind};
use crate::series::{Part, Quantity, TrustedRange, WindowSummary, inner};
use dose3_ood::ranges::Quantiles;
use std::ops::Range;

/// The share of trusted windows on either side that the trusted range leaves out.
const OUTSIDE: f64 = 0.01;
/// A quantity that hardly varies in trusted logs varies by at least this share of its size.
const LEAST_SPREAD: f64 = 0.02;

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

/// A quantity that leaves its range.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Deviation {
    pub quantity: Quantity,
    pub side: Side,
    pub amount: f64,
    pub trusted: [f64; 2],
    /// Distance from the trusted median over the distance of the end of the range from it.
    pub strength: f64,
    /// Those that deviate.
    pub poses: Range<usize>,
}

impl Deviation {
    /// How `column` leaves `range`, if it does, in its strongest way. `poses` are those to look at, `windows` the
    /// detector's windows among them.
    pub fn of(
        quantity: Quantity,
        column: &[Option<f64>],
        poses: &Range<usize>,
        windows: &[Range<usize>],
        range: &TrustedRange,
    ) -> Option<Self> {
        let whole = WindowSummary::of(&column[inner(poses)])?;
        let medians: Vec<f64> = windows
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
            let strength = strength(side, amount, quantiles);
            (amount.is_finite() && strength > 1.0).then_some((side, amount, strength))
        });
        let (side, amount, strength) = found.max_by(|a, b| a.2.total_cmp(&b.2))?;
        let trusted = match side {
            Side::High | Side::Low => [
                range.window_low.at(OUTSIDE),
                range.window_high.at(1.0 - OUTSIDE),
            ],
            Side::Above | Side::Below => [
                range.window_median.at(OUTSIDE),
                range.window_median.at(1.0 - OUTSIDE),
            ],
        };
        let beyond = |value: f64| match side {
            Side::High | Side::Above => value > trusted[1],
            Side::Low | Side::Below => value < trusted[0],
        };
        let is_beyond = |pose: &usize| column[*pose].is_some_and(beyond);
        let mut deviating = inner(poses).filter(is_beyond);
        let first = deviating.next()?;
        let last = deviating.next_back().unwrap_or(first);
        Some(Self {
            quantity,
            side,
            amount,
            trusted,
            strength,
            poses: first..last + 1,
        })
    }

    pub fn same_axis(&self, other: &Self) -> bool {
        self.quantity.axis().is_some() && self.quantity.axis() == other.quantity.axis()
    }

    /// What it says, at its place in the user's file.
    pub fn reason(self, place: Place, named_axes: bool) -> Reason {
        let axis = match self.quantity {
            Quantity::Repeats(Part::Position) | Quantity::Speed => ReasonAxis::Position,
            Quantity::Repeats(Part::Attitude) | Quantity::Turning => ReasonAxis::Attitude,
            Quantity::Sideslip => ReasonAxis::Left,
            Quantity::Climb => ReasonAxis::Up,
            other => other.axis().map_or(ReasonAxis::Pose, ReasonAxis::from),
        };
        let kind = match self.quantity {
            Quantity::Velocity(_) | Quantity::Speed | Quantity::Turning => ReasonKind::Velocity,
            Quantity::Acceleration(_) => ReasonKind::Acceleration,
            Quantity::Noise(_) => ReasonKind::Noise,
            Quantity::Unexplained(_) => ReasonKind::Coupling,
            Quantity::Sideslip | Quantity::Climb => ReasonKind::Direction,
            Quantity::Repeats(_) => ReasonKind::Repeats,
            Quantity::Steady => ReasonKind::Interpolated,
            Quantity::Frozen(_) => ReasonKind::Frozen,
        };
        Reason {
            sentence: super::words::sentence(&self, named_axes),
            kind,
            axis,
            amount: self.amount,
            trusted: Some(self.trusted),
            unit: self.quantity.unit(),
            strength: self.strength,
            place,
        }
    }
}

fn strength(side: Side, amount: f64, trusted: &Quantiles) -> f64 {
    let median = trusted.median();
    let (end, away) = match side {
        Side::High | Side::Above => (trusted.at(1.0 - OUTSIDE), amount - median),
        Side::Low | Side::Below => (trusted.at(OUTSIDE), median - amount),
    };
    let least = (LEAST_SPREAD * median.abs()).max(1e-6);
    away / (end - median).abs().max(least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::series::Axis;

    fn range(values: [f64; 11]) -> TrustedRange {
        let quantiles = Quantiles { count: 99, values };
        TrustedRange {
            poses: quantiles,
            window_low: quantiles,
            window_median: quantiles,
            window_high: quantiles,
        }
    }

    #[test]
    fn a_value_beyond_the_range_is_found_where_it_is() {
        let trusted = range([-3., -2., -2., -1., -1., 0., 1., 1., 2., 2., 3.]);
        let speed = Quantity::Velocity(Axis::Left);
        let mut column = vec![Some(0.5); 40];
        column[0] = None;
        let of = |column: &[Option<f64>]| {
            Deviation::of(speed, column, &(0..40), &[0..20, 20..40], &trusted)
        };
        assert_eq!(of(&column), None);
        column[10] = Some(-6.0);
        column[12] = Some(-4.0);
        let found = of(&column).unwrap();
        assert_eq!(
            (found.side, found.amount, found.strength),
            (Side::Low, -6.0, 3.0)
        );
        assert_eq!((found.trusted, found.poses), ([-2.0, 2.0], 10..13));
        assert_eq!(of(&vec![None; 40]), None);
    }
}
