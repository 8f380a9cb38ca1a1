//! Counts of values in buckets that are 2 % wide: quantiles to 1 % whatever the number of values, and the same bytes
//! in whatever order they come (Masson, Rim and Lee, DDSketch, VLDB 2019).

use super::{LEVELS, Quantiles};
use std::collections::BTreeMap;

/// From a bucket to the next; its middle is within 1 % of all its values.
const WIDTH: f64 = 1.02;
/// Values closer to zero than this count as zero. Buckets up to `LARGEST` are then at most 3257 of either sign.
const SMALLEST: f64 = 1e-12;
const LARGEST: f64 = 1e16;

/// Collects values. Numbers that are not finite are passed over.
#[derive(Clone, Debug, PartialEq)]
pub struct Sketch {
    /// By sign and logarithm of the size, from the most negative value up; 0 is the bucket of zero.
    buckets: BTreeMap<i32, u64>,
    count: u64,
    low: f64,
    high: f64,
}

impl Default for Sketch {
    fn default() -> Self {
        Self {
            buckets: BTreeMap::new(),
            count: 0,
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
        }
    }
}

impl Sketch {
    /// Adds a value.
    pub fn push(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        let value = value.clamp(-LARGEST, LARGEST) + 0.0;
        *self.buckets.entry(bucket(value)).or_default() += 1;
        self.count += 1;
        self.low = self.low.min(value);
        self.high = self.high.max(value);
    }

    /// The quantiles; none where nothing was added.
    #[must_use]
    pub fn finish(&self) -> Option<Quantiles> {
        if self.count == 0 {
            return None;
        }
        let mut values = [self.low; LEVELS.len()];
        for (value, level) in values.iter_mut().zip(LEVELS).skip(1) {
            let rank = (level * (self.count - 1) as f64).round() as u64;
            let mut below = 0;
            let of_rank = self.buckets.iter().find(|(_, count)| {
                below += **count;
                below > rank
            });
            let middle = of_rank.map_or(self.high, |(bucket, _)| middle(*bucket));
            *value = middle.clamp(self.low, self.high);
        }
        values[LEVELS.len() - 1] = self.high;
        Some(Quantiles {
            count: self.count,
            values,
        })
    }
}

fn bucket(value: f64) -> i32 {
    let size = value.abs();
    if size < SMALLEST {
        return 0;
    }
    let steps = ((size / SMALLEST).ln() / WIDTH.ln()).floor() as i32 + 1;
    if value < 0.0 { -steps } else { steps }
}

fn middle(bucket: i32) -> f64 {
    if bucket == 0 {
        return 0.0;
    }
    let steps = f64::from(bucket.abs()) - 0.5;
    f64::from(bucket.signum()) * SMALLEST * WIDTH.powf(steps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::quantile_sorted;
    use rand::{RngExt, SeedableRng, seq::SliceRandom};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn quantiles_of_any_size_and_sign_are_within_a_percent() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut values: Vec<f64> = (0..20_000)
            .map(|_| {
                let size = 10_f64.powf(rng.random_range(-6.0..4.0));
                if rng.random_bool(0.3) { -size } else { size }
            })
            .collect();
        let sketch = |values: &[f64]| {
            let mut sketch = Sketch::default();
            values.iter().for_each(|v| sketch.push(*v));
            sketch
        };
        let range = sketch(&values).finish().unwrap();
        let in_order = sketch(&values);
        values.shuffle(&mut rng);
        assert_eq!(in_order, sketch(&values));
        assert!(
            in_order.buckets.len() < 2 * 1300,
            "{}",
            in_order.buckets.len()
        );
        values.sort_by(f64::total_cmp);
        for (level, found) in LEVELS.iter().zip(range.values) {
            let near = |l: f64| quantile_sorted(&values, l);
            let (low, high) = (near(level - 1e-4), near(level + 1e-4));
            let slack = 0.011 * low.abs().max(high.abs());
            assert!(
                (low - slack..=high + slack).contains(&found),
                "{level}: {found}"
            );
        }
        assert_eq!((range.low(), range.high()), (values[0], values[19_999]));
    }

    #[test]
    fn zeros_nan_and_nothing() {
        let mut sketch = Sketch::default();
        assert!(sketch.finish().is_none());
        sketch.push(f64::NAN);
        sketch.push(f64::INFINITY);
        assert!(sketch.finish().is_none());
        sketch.push(-0.0);
        sketch.push(0.0);
        let range = sketch.finish().unwrap();
        assert_eq!((range.count, range.values), (2, [0.0; 11]));
        assert!(range.values[0].is_sign_positive());
    }
}
