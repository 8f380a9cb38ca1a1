//! Scores of trusted windows by what has not seen their group.

use super::config::DetectorConfig;
use super::densities::{RawScores, Resolved};
use super::place::Place;
use crate::calibration::{Reference, Stretch, held_out};
use crate::density::Start;
use crate::error::Error;
use crate::folds::FoldPlan;
use crate::score::Score;
use crate::statistics::Group;
use rayon::prelude::*;
use std::ops::Range;

/// Raw scores of all trusted windows, each by densities without its fold.
pub(super) struct HeldOut<'a> {
    pub config: &'a DetectorConfig,
    pub plan: FoldPlan,
    pub places: &'a [Place],
    pub tests: Vec<Range<usize>>,
    raw: Vec<RawScores>,
}

/// Whether each group of logs is among those that new logs are compared with, `[test][group]`.
pub(super) type Kept = [Vec<bool>];

/// Scores of all trusted windows, left-out ones included.
pub(super) struct Scores {
    /// Per test, one score a window.
    pub tests: Vec<Vec<Score>>,
    /// Of all tests together.
    pub windows: Vec<Score>,
}

impl<'a> HeldOut<'a> {
    /// Fits the densities of every fold from the clusters that those of all rows, `starts`, began with: only
    /// where the search begins is shared, every parameter is estimated without the fold.
    pub fn new(
        config: &'a DetectorConfig,
        resolved: &Resolved,
        starts: &[Start],
        groups: &[Group],
        rows: &[Vec<f64>],
        places: &'a [Place],
    ) -> Result<Self, Error> {
        let of_group: Vec<usize> = places.iter().map(|p| p.group).collect();
        let plan = FoldPlan::new(&of_group, config.folds, config.overlap)?;
        let raw = held_out(
            rows,
            &of_group,
            &plan,
            |rows, logs, train| {
                let starts: Vec<Start> = starts.iter().map(|s| s.select(train)).collect();
                let (densities, _) = resolved.fit_from(groups, rows, logs, &starts)?;
                let models: Vec<_> = densities
                    .group_models(groups)?
                    .into_iter()
                    .map(std::borrow::Cow::into_owned)
                    .collect();
                Ok((densities, models))
            },
            |(densities, models), row| {
                let models: Vec<_> = models.iter().map(std::borrow::Cow::Borrowed).collect();
                densities.score(&models, groups, row)
            },
        )?;
        Ok(Self {
            config,
            plan,
            places,
            tests: config.statistics.test_groups(),
            raw,
        })
    }

    pub fn windows(&self) -> usize {
        self.raw.len()
    }

    /// Per group of statistics, the raw scores of the windows that `keep` names for its test.
    pub fn references(
        &self,
        keep: impl Fn(usize, usize) -> bool + Sync,
    ) -> Result<Vec<Reference>, Error> {
        let tests = self.tests.iter().enumerate();
        tests
            .flat_map(|(test, groups)| groups.clone().map(move |group| (test, group)))
            .map(|(test, group)| {
                let all = self.raw.iter().enumerate();
                let kept = all.filter(|(row, _)| keep(test, *row));
                Reference::new(kept.map(|(_, scores)| scores.groups[group]).collect())
            })
            .collect()
    }

    /// The score of every window where the trusted groups that `kept` names are the reference. p-values are
    /// taken from the other units only, as those of a new log will be from the trusted ones.
    pub fn scores(&self, kept: &Kept) -> Result<Scores, Error> {
        let units = self.plan.unit_of();
        let others = |test: usize, row: usize, unit: usize| {
            units[row] != unit && kept[test][self.places[row].group]
        };
        let by_row = if self.raw.iter().all(|scores| scores.joint.is_some()) {
            self.combine(|_| &[])
        } else {
            let per_unit: Result<Vec<Vec<Reference>>, Error> = (0..self.plan.units())
                .into_par_iter()
                .map(|unit| self.references(|test, row| others(test, row, unit)))
                .collect();
            let per_unit = per_unit?;
            self.combine(|row| &per_unit[units[row]])
        };
        let tests: Vec<Vec<Score>> = (0..self.tests.len())
            .map(|test| by_row.iter().map(|scores| scores[test]).collect())
            .collect();
        let windows = match &tests[..] {
            [single] => single.clone(),
            _ => {
                let shares = self.config.shares();
                let per_unit: Result<Vec<Vec<Reference>>, Error> = (0..self.plan.units())
                    .into_par_iter()
                    .map(|unit| {
                        let of_test = |(test, scores): (usize, &Vec<Score>)| {
                            let rows = (0..scores.len()).filter(|&row| others(test, row, unit));
                            Reference::new(rows.map(|row| scores[row]).collect())
                        };
                        tests.iter().enumerate().map(of_test).collect()
                    })
                    .collect();
                let per_unit = per_unit?;
                let of_row = |(row, scores): (usize, &Vec<Score>)| {
                    overall(scores, &shares, per_unit[units[row]].iter())
                };
                by_row.iter().enumerate().map(of_row).collect()
            }
        };
        Ok(Scores { tests, windows })
    }

    fn combine<'r>(&self, references: impl Fn(usize) -> &'r [Reference]) -> Vec<Vec<Score>> {
        let of_row = |(row, raw): (usize, &RawScores)| {
            raw.combine(self.config.combination, &self.tests, references(row))
        };
        self.raw.iter().enumerate().map(of_row).collect()
    }

    /// The scores of one test in stretches, those of the groups that `keep` names.
    pub fn stretches(&self, test: &[Score], keep: impl Fn(usize) -> bool) -> Vec<Stretch> {
        self.stretch_rows(keep)
            .into_iter()
            .map(|rows| Stretch {
                group: self.places[rows[0]].group,
                scores: rows.into_iter().map(|row| test[row]).collect(),
            })
            .collect()
    }

    /// The windows of each stretch of the groups that `keep` names.
    pub fn stretch_rows(&self, keep: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
        let mut stretches = super::place::gather(self.places.iter());
        stretches.retain(|rows| keep(self.places[rows[0]].group));
        stretches
    }
}

/// The score of a window over several tests: `-ln min_k p_k / share_k`, with the chance `p_k` of its score
/// in test k among single trusted windows; with one test its own score.
pub(super) fn overall<'a>(
    scores: &[Score],
    shares: &[f64],
    references: impl Iterator<Item = &'a Reference>,
) -> Score {
    if let [single] = scores {
        return *single;
    }
    let each = scores.iter().zip(shares).zip(references);
    let weighted = each.map(|((&score, share), reference)| share.ln() - reference.ln_p(score));
    Score::new(weighted.fold(f64::NEG_INFINITY, f64::max))
}
