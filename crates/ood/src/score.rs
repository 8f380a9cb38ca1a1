//! The one type of score.

use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// How far out of distribution something is: higher = more OOD, everywhere. For a density it is
/// minus the log-density (natural logarithm). Never NaN.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(transparent)]
pub struct Score(f64);

impl Score {
    /// The highest score there is. It is finite, so that sums over a log stay finite and JSON can
    /// hold it.
    pub const MAX: Score = Score(1e300);

    /// A score from a number of which higher means more OOD. NaN says that nothing sound came out,
    /// which counts as far out as can be; beyond +-1e300 the value is clipped.
    #[must_use]
    pub fn new(value: f64) -> Self {
        if value.is_nan() {
            Self::MAX
        } else {
            Self(value.clamp(-Self::MAX.0, Self::MAX.0))
        }
    }

    /// Minus the log-density.
    #[must_use]
    pub fn from_log_density(log_density: f64) -> Self {
        Self::new(-log_density)
    }

    /// The number; higher = more OOD.
    #[must_use]
    pub fn value(self) -> f64 {
        self.0
    }

    /// Mean of some scores; the lowest score for none.
    #[must_use]
    pub fn mean(scores: &[Score]) -> Self {
        if scores.is_empty() {
            return Self(-Self::MAX.0);
        }
        Self::new(scores.iter().map(|s| s.0).sum::<f64>() / scores.len() as f64)
    }
}

impl Eq for Score {}

impl PartialOrd for Score {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Score {
    fn cmp(&self, other: &Self) -> Ordering {
        // No NaN gets in, but -0 and 0 must tie, which total_cmp would order.
        self.0.partial_cmp(&other.0).unwrap_or(Ordering::Equal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_is_the_highest_and_everything_is_finite() {
        assert_eq!(Score::new(f64::NAN), Score::MAX);
        assert_eq!(Score::from_log_density(f64::NEG_INFINITY), Score::MAX);
        assert!(Score::from_log_density(-3.0) > Score::from_log_density(2.0));
        assert_eq!(Score::new(0.0).cmp(&Score::new(-0.0)), Ordering::Equal);
        assert!(Score::mean(&[Score::MAX; 100_000]).value().is_finite());
    }
}
