//! Where the scores of a reference end, and how their p-value goes on from there.

use crate::statistics::quantile_sorted;

/// Beyond this quantile the upper tail is taken as exponential.
const UPPER: f64 = 0.9;
/// The scores below this quantile say how fast the lower tail falls.
const LOWER: f64 = 0.1;

/// Both ends of a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tails {
    /// `p(s) = p(start) exp(-(s - start) / scale)`, with the mean excess of the reference over `start`,
    /// its 0.9 quantile, or over the median or the lowest score where the highest are all equal.
    pub upper: Tail,
    /// `1 - p(s) = (1 - p(start)) / (1 + (start - s) / scale)`, from the lowest score down, with the mean
    /// shortfall of the reference under its 0.1 quantile. Only the scale is fitted: the shape is a
    /// Pareto tail of index 1, because an exponential one leaves f64 a few hundred scales below.
    pub lower: Tail,
}

/// Where a tail starts, and how far it reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tail {
    pub start: f64,
    pub scale: f64,
}

impl Tails {
    /// Of scores in ascending order, not empty.
    pub fn of(sorted: &[f64]) -> Self {
        let start = quantile_sorted(sorted, UPPER);
        // Over any start an exponential tail has the same mean excess: where ties leave nothing beyond this one, a lower one
        // tells it.
        let starts = [start, quantile_sorted(sorted, 0.5), sorted[0]];
        let highest = sorted[sorted.len() - 1];
        let from = starts.into_iter().find(|from| *from < highest);
        let from = from.unwrap_or(start);
        let upper = Tail {
            start,
            ..Tail::new(from, sorted.iter().map(|v| v - from))
        };
        let quantile = quantile_sorted(sorted, LOWER);
        let under = sorted.iter().map(|v| quantile - v);
        Self {
            upper,
            lower: Tail::new(sorted[0], under),
        }
    }
}

impl Tail {
    /// With the mean of the positive ones among `distances` as scale.
    fn new(start: f64, distances: impl Iterator<Item = f64>) -> Self {
        let beyond: Vec<f64> = distances.filter(|&d| d > 0.0).collect();
        let mean = beyond.iter().sum::<f64>() / beyond.len().max(1) as f64;
        Self {
            start,
            scale: mean.max(1e-9 * start.abs().max(1.0)),
        }
    }
}
