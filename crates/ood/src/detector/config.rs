//! Settings of a detector's statistical part.

use crate::calibration::{Combination, Duration};
use crate::density::DensityConfig;
use crate::error::{Error, expect_len};
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
    /// How the groups of a test become one score.
    pub combination: Combination,
    /// Share of alpha of each test, in (0, 1]; they sum to 1. None: equal shares.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shares: Option<Vec<f64>>,
    /// Lengths of the runs of windows that are judged; none: those of the overlap,
    /// [`Duration::of_overlap`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub durations: Option<Vec<Duration>>,
    /// Whether trusted groups that are unlike the others stay in the reference; they are named all the
    /// same.
    #[serde(default)]
    pub keep_all: bool,
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
            shares: None,
            durations: None,
            keep_all: false,
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
        if self.combination == Combination::Joint && self.statistics.tests() > 1 {
            return Err(Error::Parameter {
                name: "combination",
                value: self.combination.to_string(),
                expected: "several tests have no joint density: fisher, harmonic-mean or maximum",
            });
        }
        check_shares(&self.shares(), self.statistics.tests())?;
        Duration::check(&self.durations())
    }

    /// The share of alpha of each test.
    #[must_use]
    pub fn shares(&self) -> Vec<f64> {
        let tests = self.statistics.tests();
        let equal = || vec![1.0 / tests as f64; tests];
        self.shares.clone().unwrap_or_else(equal)
    }

    /// Lengths of the runs of windows that are judged.
    #[must_use]
    pub fn durations(&self) -> Vec<Duration> {
        let usual = || Duration::of_overlap(self.overlap);
        self.durations.clone().unwrap_or_else(usual)
    }
}

fn check_shares(shares: &[f64], tests: usize) -> Result<(), Error> {
    expect_len("shares of alpha of the tests", tests, shares.len())?;
    // Written so that NaN fails as well.
    let positive = shares.iter().all(|&share| share > 0.0);
    if positive && (shares.iter().sum::<f64>() - 1.0).abs() < 1e-9 {
        return Ok(());
    }
    Err(Error::Parameter {
        name: "shares",
        value: format!("{shares:?}"),
        expected: "shares of alpha must be positive and sum to 1",
    })
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
