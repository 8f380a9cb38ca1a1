//! Scores of one window at a time, for whoever judges while a log is recorded.

use super::DetectorStatistics;
use super::densities::{Densities, RawScores};
use super::held_out::overall;
use crate::calibration::RunReference;
use crate::density::{DensityModel, DensityWorkspace};
use crate::error::{Error, expect_finite, expect_len};
use crate::score::Score;
use std::ops::Range;

/// Buffers and the fixed parts of a detector that scoring needs; after the first window mixtures are scored without
/// an allocation. Holds nothing of earlier windows.
#[derive(Clone, Debug)]
pub struct SingleWorkspace {
    tests: Vec<Range<usize>>,
    shares: Vec<f64>,
    /// Densities of the groups of a joint one.
    marginals: Vec<DensityModel>,
    columns: Vec<f64>,
    density: DensityWorkspace,
    raw: RawScores,
    ln_p: Vec<f64>,
    of_tests: Vec<Score>,
}

/// The scores of one window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingleScores<'w> {
    /// Over all tests: what [`DetectorStatistics::window_scores`] says.
    pub score: Score,
    /// By each test.
    pub tests: &'w [Score],
    /// By each group of statistics.
    pub groups: &'w [Score],
}

impl DetectorStatistics {
    /// What [`score_window`](Self::score_window) works in.
    ///
    /// # Errors
    /// A joint density without marginals.
    pub fn single_workspace(&self) -> Result<SingleWorkspace, Error> {
        let marginals = match &self.densities {
            Densities::Joint(model) => {
                let each = self.groups.iter().map(|g| model.marginal_model(&g.columns));
                each.collect::<Result<_, _>>()?
            }
            Densities::PerGroup(_) => Vec::new(),
        };
        Ok(SingleWorkspace {
            tests: self.config.statistics.test_groups(),
            shares: self.config.shares(),
            marginals,
            columns: Vec::new(),
            density: DensityWorkspace::default(),
            raw: RawScores::default(),
            ln_p: Vec::new(),
            of_tests: Vec::new(),
        })
    }

    /// Scores one row of statistics; the numbers are those of [`window_scores`](Self::window_scores) and of a verdict.
    ///
    /// # Errors
    /// [`Error::Shape`] and [`Error::NotFinite`] for a bad row.
    pub fn score_window<'w>(
        &self,
        row: &[f64],
        work: &'w mut SingleWorkspace,
    ) -> Result<SingleScores<'w>, Error> {
        expect_len("statistics of a window", self.names.len(), row.len())?;
        expect_finite("statistics of a window", row)?;
        let (models, joint) = match &self.densities {
            Densities::Joint(model) => (&work.marginals, Some(model)),
            Densities::PerGroup(models) => (models, None),
        };
        let density = &mut work.density;
        work.raw.joint = match joint {
            Some(model) => Some(model.score_with(row, density)?),
            None => None,
        };
        work.raw.groups.clear();
        for (group, model) in self.groups.iter().zip(models) {
            work.columns.clear();
            work.columns.extend(group.columns.iter().map(|&c| row[c]));
            let score = model.score_with(&work.columns, density)?;
            work.raw.groups.push(score);
        }
        work.raw.combine_into(
            self.config.combination,
            &work.tests,
            &self.calibration.groups,
            &mut work.ln_p,
            &mut work.of_tests,
        );
        let windows = self.runs.iter().map(RunReference::windows);
        Ok(SingleScores {
            score: overall(&work.of_tests, &work.shares, windows),
            tests: &work.of_tests,
            groups: &work.raw.groups,
        })
    }
}
