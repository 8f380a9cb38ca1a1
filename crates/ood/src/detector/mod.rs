//! The statistical part of a detector: what was fitted, how it was calibrated, and how it judges.

mod calibrate;
mod config;
mod densities;
mod verdict;

pub use calibrate::{Calibration, UnitCalibration};
pub use config::DetectorConfig;
pub use densities::Densities;
pub use verdict::{Contribution, LogVerdict, Rule};

use crate::error::{Error, expect_finite, expect_len, expect_table};
use crate::score::Score;
use crate::statistics::Group;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Densities over a set of statistics with their calibration. Reading one from a file
/// [validates](Self::validate) it; floats survive JSON bit by bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct DetectorStatistics {
    config: DetectorConfig,
    names: Vec<String>,
    groups: Vec<Group>,
    densities: Densities,
    calibration: Calibration,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    config: DetectorConfig,
    /// Names of the columns, so that a reader need not trust that a set means what it meant.
    names: Vec<String>,
    groups: Vec<Group>,
    densities: Densities,
    calibration: Calibration,
}

impl DetectorStatistics {
    /// Fits to the statistics of trusted windows. `rows[i]` are the statistics of a window of log
    /// `logs[i]`, an index into `log_names`; the windows of one log come in order of time.
    ///
    /// The calibration scores are those of logs that the fit has not seen (see [`crate::folds`]);
    /// the densities kept are then fitted to all trusted rows.
    ///
    /// # Errors
    /// [`Error::Parameter`] for bad settings; [`Error::Shape`], [`Error::NotFinite`],
    /// [`Error::TooFew`] for bad or too few rows.
    pub fn fit(
        config: DetectorConfig,
        rows: &[Vec<f64>],
        logs: &[usize],
        log_names: &[String],
    ) -> Result<Self, Error> {
        config.check()?;
        let names = config.statistics.names();
        expect_len(
            "columns of the trusted rows",
            names.len(),
            expect_table("trusted rows", rows)?,
        )?;
        expect_len("logs of the trusted rows", rows.len(), logs.len())?;
        if let Some(&log) = logs.iter().find(|&&log| log >= log_names.len()) {
            return Err(Error::Shape {
                what: "names of trusted logs (at least)",
                expected: log + 1,
                found: log_names.len(),
            });
        }
        let groups = config.statistics.groups();
        let (calibration, densities) =
            calibrate::calibrate(&config, &groups, rows, logs, log_names)?;
        let detector = Self {
            config,
            names,
            groups,
            densities,
            calibration,
        };
        detector.validate()?;
        Ok(detector)
    }

    /// The settings it was fitted with.
    #[must_use]
    pub fn config(&self) -> &DetectorConfig {
        &self.config
    }

    /// Names of the columns it takes.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The groups of columns.
    #[must_use]
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// The fitted densities.
    #[must_use]
    pub fn densities(&self) -> &Densities {
        &self.densities
    }

    /// The held-out trusted scores and what follows from them.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Scores of windows, one per row of statistics; higher = more OOD.
    ///
    /// # Errors
    /// [`Error::Shape`] and [`Error::NotFinite`] for bad rows.
    pub fn window_scores(&self, rows: &[Vec<f64>]) -> Result<Vec<Score>, Error> {
        Ok(self.score_rows(rows)?.into_iter().map(|s| s.0).collect())
    }

    /// The verdict on a log from the statistics of its windows, at the alpha of the settings.
    ///
    /// # Errors
    /// As [`judge_at`](Self::judge_at).
    pub fn judge(&self, rows: &[Vec<f64>]) -> Result<LogVerdict, Error> {
        self.judge_at(rows, self.config.alpha)
    }

    /// The verdict at another alpha in (0, 1).
    ///
    /// # Errors
    /// [`Error::TooFew`] for no windows, [`Error::Parameter`] for a bad alpha, [`Error::Shape`] and
    /// [`Error::NotFinite`] for bad rows.
    pub fn judge_at(&self, rows: &[Vec<f64>], alpha: f64) -> Result<LogVerdict, Error> {
        config::check_alpha("alpha", alpha)?;
        if rows.is_empty() {
            return Err(Error::TooFew {
                what: "windows of the log",
                needed: 1,
                found: 0,
                hint: "the log must be at least as long as a window",
            });
        }
        verdict::judge(self, &self.score_rows(rows)?, alpha)
    }

    /// Per row: the window's score and the scores of its groups.
    fn score_rows(&self, rows: &[Vec<f64>]) -> Result<Vec<(Score, Vec<Score>)>, Error> {
        let models = self.densities.group_models(&self.groups)?;
        let references = &self.calibration.groups;
        rows.par_iter()
            .map(|row| {
                expect_len("statistics of a window", self.names.len(), row.len())?;
                expect_finite("statistics of a window", row)?;
                let raw = self.densities.score(&models, &self.groups, row)?;
                let combined = raw.combine(self.config.combination, references);
                Ok((combined, raw.groups))
            })
            .collect()
    }

    /// Checks that all parts belong together.
    ///
    /// # Errors
    /// [`Error::Inconsistent`] with the part and the reason; [`Error::Parameter`] for settings.
    pub fn validate(&self) -> Result<(), Error> {
        self.config.check()?;
        let wrong = |part: &'static str, reason: &str| {
            Err(Error::Inconsistent {
                part,
                reason: reason.to_owned(),
            })
        };
        if self.names != self.config.statistics.names() {
            return wrong(
                "names",
                "this version computes other columns for the set of statistics",
            );
        }
        if self.groups != self.config.statistics.groups() {
            return wrong("groups", "this version groups the columns in another way");
        }
        self.densities
            .validate(self.config.combination, &self.groups)?;
        self.calibration.validate(&self.config, self.groups.len())
    }
}

impl TryFrom<Stored> for DetectorStatistics {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        let detector = Self {
            config: stored.config,
            names: stored.names,
            groups: stored.groups,
            densities: stored.densities,
            calibration: stored.calibration,
        };
        detector.validate()?;
        Ok(detector)
    }
}

impl From<DetectorStatistics> for Stored {
    fn from(detector: DetectorStatistics) -> Self {
        Self {
            config: detector.config,
            names: detector.names,
            groups: detector.groups,
            densities: detector.densities,
            calibration: detector.calibration,
        }
    }
}
