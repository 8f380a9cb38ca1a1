//! How often trusted logs peak, and how high a level must be to be passed so and so often.

use crate::statistics::quantile_sorted;
use serde::{Deserialize, Serialize};

/// Beyond this quantile of the trusted values peaks are counted.
const HIGH: f64 = 0.9;

/// Clusters of exceedances of a high quantile in trusted logs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Peaks {
    /// The quantile.
    pub start: f64,
    /// Mean height of a cluster's peak above it.
    pub scale: f64,
    /// Height of the highest.
    pub highest: f64,
    /// Clusters.
    pub clusters: usize,
    /// Hours of trusted windows.
    pub hours: f64,
}

impl Peaks {
    /// Of series of values in order of time, one a stretch; exceedances more than `gap` apart are clusters of their
    /// own. `seconds` is the time from one value to the next. `None` without values.
    #[must_use]
    pub fn of(series: &[Vec<f64>], gap: usize, seconds: f64) -> Option<Self> {
        let mut all: Vec<f64> = series.concat();
        if all.is_empty() {
            return None;
        }
        let hours = all.len() as f64 * seconds / 3600.0;
        all.sort_unstable_by(f64::total_cmp);
        let start = quantile_sorted(&all, HIGH);
        let mut heights: Vec<f64> = Vec::new();
        for values in series {
            let mut before: Option<usize> = None;
            for (i, &value) in values.iter().enumerate().filter(|(_, v)| **v > start) {
                match (before, heights.last_mut()) {
                    (Some(before), Some(height)) if i - before <= gap => {
                        *height = height.max(value - start);
                    }
                    _ => heights.push(value - start),
                }
                before = Some(i);
            }
        }
        let clusters = heights.len();
        let scale = heights.iter().sum::<f64>() / clusters.max(1) as f64;
        Some(Self {
            start,
            scale: scale.max(1e-9 * start.abs().max(1.0)),
            highest: heights.iter().copied().fold(0.0, f64::max),
            clusters,
            hours,
        })
    }

    /// The level that logs like the trusted ones pass `per_hour` times an hour: peaks above the start have an
    /// exponential tail, whose scale is known from the clusters only and integrated out.
    #[must_use]
    pub fn tail(&self, per_hour: f64) -> f64 {
        // One cluster more than was seen: none in an hour does not mean none.
        let clusters = (self.clusters + 1) as f64;
        let fall = clusters / self.hours / per_hour;
        self.start + self.scale * clusters * (fall.ln().max(0.0) / clusters).exp_m1()
    }

    /// The same, but not below the highest peak: where groups of logs differ, their peaks fall off more slowly than such a
    /// tail.
    #[must_use]
    pub fn level(&self, per_hour: f64) -> f64 {
        self.tail(per_hour).max(self.start + self.highest)
    }
}

#[cfg(test)]
mod tests {
    use super::Peaks;

    #[test]
    fn clusters_and_levels_by_hand() {
        let mut values = vec![0.0; 100];
        // Two clusters, five apart and more; the 0.9 quantile is 0.
        for (at, value) in [(10, 2.0), (12, 3.0), (60, 1.0)] {
            values[at] = value;
        }
        let peaks = Peaks::of(&[values.clone()], 4, 36.0).unwrap();
        assert_eq!((peaks.start, peaks.clusters, peaks.hours), (0.0, 2, 1.0));
        assert_eq!(peaks.scale, 2.0);
        // Three an hour are passed at the start, by the tail; but none is lower than the highest.
        assert_eq!(
            (peaks.highest, peaks.tail(3.0), peaks.level(3.0)),
            (3.0, 0.0, 3.0)
        );
        let seldom = 2.0 * 3.0 * (30.0_f64.powf(1.0 / 3.0) - 1.0);
        assert!((peaks.level(0.1) - seldom).abs() < 1e-12);
        // A stretch ends a cluster.
        let cut = [values[..11].to_vec(), values[11..].to_vec()];
        assert_eq!(Peaks::of(&cut, 4, 36.0).unwrap().clusters, 3);
        assert!(Peaks::of(&[], 4, 36.0).is_none());
    }

    #[test]
    fn many_exponential_peaks_give_their_own_level() {
        // 10000 independent exponential values, 1 an hour: once in 1000 hours is ln 1000.
        let values: Vec<f64> = (0..10_000)
            .map(|i| {
                let rank = (i * 7919 % 10_000) as f64 + 0.5;
                -(rank / 10_000.0).ln()
            })
            .collect();
        let peaks = Peaks::of(&[values], 0, 3600.0).unwrap();
        let level = peaks.level(1e-5);
        assert!((level - 1e5_f64.ln()).abs() < 0.1, "{level}");
    }
}
