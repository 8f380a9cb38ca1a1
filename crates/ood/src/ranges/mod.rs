//! What values a quantity takes in trusted logs: quantiles of as many values as there are, in bounded memory.
//!
//! ```
//! use dose3_ood::ranges::{LEVELS, Sketch};
//!
//! let mut speeds = Sketch::default();
//! for i in 0..=10_000 {
//!     speeds.push(f64::from(i) * 1e-3);
//! }
//! let range = speeds.finish().unwrap();
//! assert_eq!((range.low(), range.high(), range.count), (0.0, 10.0, 10_001));
//! // Within 1 % of the value at every level.
//! assert!((range.at(0.95) / 9.5 - 1.0).abs() < 0.01);
//! # assert_eq!(LEVELS.len(), range.values.len());
//! ```

mod sketch;

pub use sketch::Sketch;

use crate::error::{Error, expect_finite};
use serde::{Deserialize, Serialize};

/// Levels of the quantiles that are kept; 0 is the smallest value and 1 the largest.
pub const LEVELS: [f64; 11] = [
    0.0, 0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999, 1.0,
];

/// Quantiles of the values that a quantity takes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantiles {
    /// Number of values.
    pub count: u64,
    /// At [`LEVELS`], not decreasing; within 1 % of the true ones, the first and the last exact.
    pub values: [f64; 11],
}

impl Quantiles {
    /// The smallest value.
    #[must_use]
    pub fn low(&self) -> f64 {
        self.values[0]
    }

    /// The largest value.
    #[must_use]
    pub fn high(&self) -> f64 {
        self.values[LEVELS.len() - 1]
    }

    /// The value in the middle.
    #[must_use]
    pub fn median(&self) -> f64 {
        self.at(0.5)
    }

    /// The value at a level in [0, 1], straight between those that are kept.
    #[must_use]
    pub fn at(&self, level: f64) -> f64 {
        let level = level.clamp(0.0, 1.0);
        let above = LEVELS.iter().position(|known| *known >= level);
        match above {
            None | Some(0) => self.values[0],
            Some(k) => {
                let (from, to) = (LEVELS[k - 1], LEVELS[k]);
                let weight = (level - from) / (to - from);
                self.values[k - 1] + weight * (self.values[k] - self.values[k - 1])
            }
        }
    }

    /// Checks what a file may have brought in.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::Inconsistent`] for quantiles that decrease or stand for no value.
    pub fn validate(&self) -> Result<(), Error> {
        expect_finite("quantiles of a trusted range", &self.values)?;
        if self.count == 0 || self.values.windows(2).any(|pair| pair[0] > pair[1]) {
            return Err(Error::Inconsistent {
                part: "trusted ranges",
                reason: "quantiles that decrease, or of no value".to_owned(),
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_levels_and_beyond() {
        let range = Quantiles {
            count: 9,
            values: [-1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 3.0, 3.0, 3.0, 7.0],
        };
        range.validate().unwrap();
        assert_eq!(
            (range.at(-1.0), range.at(0.375), range.at(2.0)),
            (-1.0, 1.5, 7.0)
        );
        let down = Quantiles {
            values: [1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 3.0, 3.0, 3.0, 7.0],
            ..range
        };
        assert!(down.validate().is_err());
        assert!(Quantiles { count: 0, ..range }.validate().is_err());
    }
}
