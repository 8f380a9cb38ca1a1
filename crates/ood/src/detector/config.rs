//! Settings of a detector's statistical part.

use crate::calibration::Combination;
use crate::density::DensityConfig;
use crate::error::Error;
use crate::folds::Folds;
use crate::statistics::{Statistic, StatisticsSet};
use serde::{Deserialize, Serialize};

/// What is fitted and how it judges; written into every detector and result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectorConfig {
    /// The statistics.
    pub statistics: StatisticsSet,
    /// The density: of all columns for [`Combination::Joint`], else of each group.
    pub density: DensityConfig,
    /// How groups become one score.
    pub combination: Combination,
    /// How trusted logs are held out.
    pub folds: Folds,
    /// Windows of one log that share poses with a given one on one side, plus itself: window length
    /// over stride, rounded up. Overlapping windows are one piece of evidence, not several.
    pub overlap: usize,
    /// Share of trusted logs that may be called OOD, in (0, 1).
    pub alpha: f64,
    /// Share of held-out trusted windows beyond the window threshold, in (0, 1); the paper: 0.05.
    pub window_alpha: f64,
    /// Noise draws averaged per window. Only recorded here: whoever runs the estimator draws.
    pub draws: usize,
    /// Seed of the noise draws and of the density's fit. The draws are only recorded here.
    pub seed: u64,
}

impl Default for DetectorConfig {
    fn default() -> Self {
        Self {
            statistics: Statistic::Paper24.into(),
            density: DensityConfig::default(),
            combination: Combination::Joint,
            folds: Folds::Auto,
            overlap: 4,
            alpha: 0.05,
            window_alpha: 0.05,
            draws: 1,
            seed: 0,
        }
    }
}

impl DetectorConfig {
    /// Checks every setting but those of the density, which its fit checks.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming the setting and its range.
    pub fn check(&self) -> Result<(), Error> {
        check_alpha("alpha", self.alpha)?;
        check_alpha("window_alpha", self.window_alpha)?;
        for (name, value) in [("overlap", self.overlap), ("draws", self.draws)] {
            if value == 0 {
                return Err(Error::Parameter {
                    name,
                    value: value.to_string(),
                    expected: "must be at least 1",
                });
            }
        }
        if let Folds::K(k @ (0 | 1)) = self.folds {
            return Err(Error::Parameter {
                name: "folds",
                value: k.to_string(),
                expected: "must be at least 2",
            });
        }
        Ok(())
    }
}

pub(super) fn check_alpha(name: &'static str, alpha: f64) -> Result<(), Error> {
    if alpha > 0.0 && alpha < 1.0 {
        return Ok(());
    }
    Err(Error::Parameter {
        name,
        value: alpha.to_string(),
        expected: "must lie in (0, 1)",
    })
}
