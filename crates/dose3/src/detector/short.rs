//! Short windows beside the model's: what streams see sooner.
//!
//! A fault fills a window of 128 steps after 13 s only, and medians over it move when it fills half. Windows of 32
//! steps with densities and calibration of their own see it within a few seconds, by the same statistics of steps. Verdicts
//! on whole logs do not use them.

use crate::error::{Error, Result};
use crate::probe::Probe;
use dose3_datasets::{LogGroups, Trajectory, increments, stretch_numbers, windows};
use dose3_ood::{DetectorConfig, DetectorStatistics, Place, Sample, StatisticsSet, Workspace};
use serde::{Deserialize, Serialize};

/// Steps of a short window, which do not overlap in the trusted logs.
const STEPS: usize = 32;
/// Fewest steps that any statistic of steps can do with.
const FEWEST: usize = 12;

/// Densities and calibration of short windows; stored in a detector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShortReference {
    /// Poses of a window.
    pub poses: usize,
    /// Poses from the start of one trusted window to the next.
    pub stride: usize,
    /// Fitted to the statistics of trusted short windows.
    pub statistics: DetectorStatistics,
}

impl ShortReference {
    /// By the settings of the detector, where its statistics are of steps alone.
    pub(super) fn fit(
        logs: &[Trajectory],
        groups: &LogGroups,
        probe: &Probe,
        config: &DetectorConfig,
    ) -> Result<Option<Self>> {
        let set = &config.statistics;
        if set.needs_trace() || set.needs_window() || set.needs_joint() {
            return Ok(None);
        }
        let cut = windows(logs, STEPS + 1, STEPS);
        let stretches = stretch_numbers(&cut, STEPS);
        let (mut rows, mut places) = (Vec::new(), Vec::new());
        let mut work = Workspace::default();
        for (window, stretch) in cut.iter().zip(stretches) {
            let log = window.trajectory;
            let poses = window.poses(logs).ok_or(Error::OutsideWindow {
                log,
                start: window.start,
            })?;
            let linear = probe.linear_of(log);
            let steps = increments(poses, logs[log].frame);
            let sample = Sample {
                increments: Some(&steps),
                linear: linear.as_deref(),
                ..Sample::default()
            };
            let mut row = Vec::with_capacity(set.dimension());
            set.evaluate_into(&sample, &mut work, &mut row)?;
            rows.push(row);
            places.push(Place {
                group: groups.of_log[log],
                log,
                stretch,
            });
        }
        let config = DetectorConfig {
            overlap: 1,
            ..config.clone()
        };
        Ok(Some(Self {
            poses: STEPS + 1,
            stride: STEPS,
            statistics: DetectorStatistics::fit(config, &rows, &places, &groups.names)?,
        }))
    }

    /// Whether it belongs to a detector of these statistics.
    pub(super) fn check(&self, set: &StatisticsSet) -> Result<()> {
        let same = self.statistics.config().statistics == *set;
        if same && self.poses > FEWEST && self.stride > 0 {
            return Ok(());
        }
        let reason = "its short windows have other statistics, or too few poses";
        Err(Error::unsound("detector", reason))
    }
}
