//! The statistical part of a detector: what was fitted, how it was calibrated, and how it judges.

mod audit;
mod basis;
mod calibrate;
mod config;
mod contribution;
mod densities;
mod held_out;
mod place;
mod scored;
mod single;
mod test;
mod verdict;

pub use audit::AuditFinding;
pub use basis::{Basis, MeasuredAlarms};
pub use calibrate::{Calibration, UnitCalibration};
pub use config::DetectorConfig;
pub use contribution::Contribution;
pub use densities::Densities;
pub use place::Place;
pub use single::{SingleScores, SingleWorkspace};
pub use test::{Evidence, ExternalTest, TestVerdict};
pub use verdict::LogVerdict;

use crate::calibration::RunReference;
use crate::error::{Error, expect_len, expect_table};
use crate::score::Score;
use crate::statistics::Group;
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
    /// Trusted runs of windows of each test; follow from the rest.
    runs: Vec<RunReference>,
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
    /// Fits to the statistics of trusted windows. `rows[i]` are the statistics of the window at
    /// `places[i]`, whose group is an index into `group_names`; the windows of one stretch come in order of
    /// time.
    ///
    /// The calibration scores are those of groups that the fit has not seen (see [`crate::folds`]), and
    /// groups unlike the others are left out of them ([`AuditFinding`]); the densities kept are then fitted
    /// to all trusted rows.
    ///
    /// # Errors
    /// [`Error::Parameter`] for bad settings; [`Error::Shape`], [`Error::NotFinite`],
    /// [`Error::TooFew`] for bad or too few rows.
    pub fn fit(
        config: DetectorConfig,
        rows: &[Vec<f64>],
        places: &[Place],
        group_names: &[String],
    ) -> Result<Self, Error> {
        config.check()?;
        let names = config.statistics.names();
        expect_len(
            "columns of the trusted rows",
            names.len(),
            expect_table("trusted rows", rows)?,
        )?;
        expect_len("places of the trusted rows", rows.len(), places.len())?;
        if let Some(place) = places.iter().find(|p| p.group >= group_names.len()) {
            return Err(Error::Shape {
                what: "names of trusted groups (at least)",
                expected: place.group + 1,
                found: group_names.len(),
            });
        }
        let groups = config.statistics.groups();
        let (calibration, densities) =
            calibrate::calibrate(&config, &groups, rows, places, group_names)?;
        Self::try_from(Stored {
            config,
            names,
            groups,
            densities,
            calibration,
        })
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

    /// Trusted runs of windows of each test.
    #[must_use]
    pub(crate) fn runs(&self) -> &[RunReference] {
        &self.runs
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
        let scored = scored::score_rows(self, rows)?;
        Ok(scored.into_iter().map(|s| s.score).collect())
    }

    /// The verdict on a log from the statistics of its windows, in order of time, at the alpha of the
    /// settings. `stretches[i]` is the number of the gap-free stretch that window `i` lies in.
    ///
    /// # Errors
    /// As [`judge_with`](Self::judge_with).
    pub fn judge(&self, rows: &[Vec<f64>], stretches: &[usize]) -> Result<LogVerdict, Error> {
        self.judge_with(rows, stretches, &[], self.config.alpha)
    }

    /// The verdict at an alpha in (0, 1), joined with tests from outside, whose shares the detector's own
    /// tests give up in proportion to theirs.
    ///
    /// # Errors
    /// [`Error::TooFew`] for no windows, [`Error::Parameter`] for a bad alpha and for bad tests from
    /// outside, [`Error::Shape`] and [`Error::NotFinite`] for bad rows.
    pub fn judge_with(
        &self,
        rows: &[Vec<f64>],
        stretches: &[usize],
        external: &[ExternalTest],
        alpha: f64,
    ) -> Result<LogVerdict, Error> {
        config::check_alpha("alpha", alpha)?;
        expect_len("stretches of the windows", rows.len(), stretches.len())?;
        if rows.is_empty() {
            return Err(Error::TooFew {
                what: "windows of the log",
                needed: 1,
                found: 0,
                hint: "the log must be at least as long as a window",
            });
        }
        let scored = scored::score_rows(self, rows)?;
        let stretches = place::gather(stretches.iter());
        verdict::judge(self, &scored, &stretches, external, alpha)
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
        let mut detector = Self {
            config: stored.config,
            names: stored.names,
            groups: stored.groups,
            densities: stored.densities,
            calibration: stored.calibration,
            runs: Vec::new(),
        };
        detector.validate()?;
        detector.runs = detector.calibration.runs(&detector.config)?;
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
