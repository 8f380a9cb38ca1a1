//! Which values quantities take in trusted logs; stored in a detector.

use super::grid::{GRID_SPAN, GRID_STEP, grid};
use super::motion::Motion;
use super::quantity::Quantity;
use crate::error::{Error, Result};
use dose3_lie::Pose;
use dose3_ood::ranges::{Quantiles, Sketch};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;

/// The values of a quantity in trusted logs, by pose and by window (of the detector's length: 12.8 s at 10 Hz). Windows
/// of speeds, turn rates and directions are of running medians over seven poses, which single bad poses do not move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrustedRange {
    /// Of all poses.
    pub poses: Quantiles,
    /// The smallest value of each window.
    pub window_low: Quantiles,
    /// The median of each window.
    pub window_median: Quantiles,
    /// The largest value of each window.
    pub window_high: Quantiles,
    /// The share of the poses of each window whose value is above zero.
    pub window_share: Quantiles,
}

/// What quantities are trusted to be. Logs that the calibration leaves out ([`dose3_ood::detector::AuditFinding`])
/// are left out here too.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrustedRanges {
    quantities: BTreeMap<Quantity, TrustedRange>,
    /// The coarsest grid that 48 consecutive positions lie on, metres; 0 for none.
    pub(crate) grid: f64,
}

impl TrustedRanges {
    /// The range of a quantity; none where no trusted log has it.
    #[must_use]
    pub fn get(&self, quantity: Quantity) -> Option<&TrustedRange> {
        self.quantities.get(&quantity)
    }

    /// The coarsest grid that positions lie on, metres: files with few decimals have one; 0 for none.
    #[must_use]
    pub fn grid(&self) -> f64 {
        self.grid
    }

    /// All ranges, in the order of [`Quantity::all`].
    pub fn iter(&self) -> impl Iterator<Item = (Quantity, &TrustedRange)> {
        Quantity::all().filter_map(|quantity| Some((quantity, self.get(quantity)?)))
    }

    pub(crate) fn check(&self) -> Result<()> {
        if !(self.grid.is_finite() && self.grid >= 0.0) {
            return Err(Error::unsound(
                "detector",
                format!("a grid of {} m", self.grid),
            ));
        }
        for range in self.quantities.values() {
            let parts = [
                &range.poses,
                &range.window_low,
                &range.window_median,
                &range.window_high,
                &range.window_share,
            ];
            for part in parts {
                part.validate()?;
            }
        }
        Ok(())
    }
}

/// Collects ranges, a stretch of a trusted log at a time.
#[derive(Default)]
pub(crate) struct Collector {
    of: BTreeMap<Quantity, [Sketch; 5]>,
    grid: f64,
}

impl Collector {
    /// Adds the poses of a stretch with their motion and their windows, ranges of them.
    pub fn add(&mut self, all: &[Pose], motion: &Motion, windows: &[Range<usize>]) {
        for span in all.windows(GRID_SPAN).step_by(GRID_STEP) {
            self.grid = self.grid.max(grid(span));
        }
        for quantity in Quantity::all() {
            let column = motion.column(quantity);
            let compared = motion.compared(quantity);
            let [poses, low, median, high, share] = self.of.entry(quantity).or_default();
            column.iter().flatten().for_each(|value| poses.push(*value));
            for window in windows {
                if let Some(summary) = WindowSummary::of(&compared[inner(window)]) {
                    low.push(summary.low);
                    median.push(summary.median);
                    high.push(summary.high);
                    share.push(summary.share);
                }
            }
        }
    }

    /// The ranges of all quantities that had a value in some window.
    pub fn finish(self) -> TrustedRanges {
        let range = |[poses, low, median, high, share]: [Sketch; 5]| {
            Some(TrustedRange {
                poses: poses.finish()?,
                window_low: low.finish()?,
                window_median: median.finish()?,
                window_high: high.finish()?,
                window_share: share.finish()?,
            })
        };
        let of = self.of.into_iter();
        TrustedRanges {
            grid: self.grid,
            quantities: of
                .filter_map(|(quantity, sketches)| Some((quantity, range(sketches)?)))
                .collect(),
        }
    }
}

/// The poses of a window that a step within it leads to.
pub(crate) fn inner(window: &Range<usize>) -> Range<usize> {
    (window.start + 1).min(window.end)..window.end
}

/// A quantity over some poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WindowSummary {
    pub low: f64,
    pub median: f64,
    pub high: f64,
    /// Of those above zero.
    pub share: f64,
}

impl WindowSummary {
    /// None where no pose has a value.
    pub fn of(values: &[Option<f64>]) -> Option<Self> {
        let mut known: Vec<f64> = values.iter().flatten().copied().collect();
        known.sort_by(f64::total_cmp);
        Some(Self {
            low: *known.first()?,
            median: known[known.len() / 2],
            high: *known.last()?,
            share: known.iter().filter(|v| **v > 0.0).count() as f64 / known.len() as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::series::Axis;
    use dose3_datasets::synthetic::{Platform, trajectory};

    #[test]
    fn ranges_of_a_log_are_those_of_its_values_and_come_back_from_json() {
        let log = trajectory(Platform::Vehicle, 3, 400, 10.0);
        let motion = Motion::new(&log.poses, log.frame, 10.0, None).unwrap();
        let mut collector = Collector::default();
        let windows = [0..129, 100..229, 271..400];
        collector.add(&log.poses, &motion, &windows);
        let ranges = collector.finish();
        ranges.check().unwrap();
        let speed = Quantity::Velocity(Axis::Forward);
        let column = motion.column(speed);
        let all: Vec<f64> = column.iter().flatten().copied().collect();
        let range = ranges.get(speed).unwrap();
        let highest = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert_eq!((range.poses.high(), range.poses.count), (highest, 399));
        assert_eq!(range.window_median.count, 3);
        let compared = motion.compared(speed);
        let of_windows = windows.map(|w| WindowSummary::of(&compared[inner(&w)]).unwrap());
        let lowest = of_windows
            .iter()
            .map(|w| w.low)
            .fold(f64::INFINITY, f64::min);
        assert_eq!(range.window_low.low(), lowest);
        // There is no prediction, so nothing is left over.
        assert!(ranges.get(Quantity::Unexplained(Axis::Up)).is_none());
        let json = serde_json::to_string(&ranges).unwrap();
        assert!(json.contains("\"velocity.forward\":{"), "{json}");
        assert_eq!(
            serde_json::from_str::<TrustedRanges>(&json).unwrap(),
            ranges
        );
    }
}
