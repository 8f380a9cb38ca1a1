//! One density over all columns, or one for each group.

use crate::calibration::{Combination, Reference};
use crate::density::{Density, DensityConfig, DensityModel, Start};
use crate::error::{Error, expect_len};
use crate::score::Score;
use crate::statistics::Group;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::ops::Range;

/// The fitted densities of a detector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Densities {
    /// One over all columns; groups are its marginals.
    Joint(Box<DensityModel>),
    /// One for each group, in the order of the groups.
    PerGroup(Vec<DensityModel>),
}

/// Scores of one window before they are combined.
#[derive(Clone, Debug, Default)]
pub(super) struct RawScores {
    pub joint: Option<Score>,
    pub groups: Vec<Score>,
}

/// Density settings with everything that the data choose settled: one entry for a joint density,
/// else one per group.
pub(super) struct Resolved {
    configs: Vec<DensityConfig>,
    joint: bool,
}

impl Resolved {
    pub fn new(
        config: &DensityConfig,
        combination: Combination,
        groups: &[Group],
        rows: &[Vec<f64>],
        logs: &[usize],
    ) -> Result<Self, Error> {
        let joint = combination == Combination::Joint;
        let configs = if joint {
            vec![config.resolve(rows, logs)?]
        } else {
            let each = groups
                .iter()
                .map(|g| config.resolve(&select_all(rows, g), logs));
            each.collect::<Result<_, _>>()?
        };
        Ok(Self { configs, joint })
    }

    /// Fits to all rows; the starts are those of its densities.
    pub fn fit(
        &self,
        groups: &[Group],
        rows: &[Vec<f64>],
        logs: &[usize],
    ) -> Result<(Densities, Vec<Start>), Error> {
        let starts = vec![Start::default(); self.configs.len()];
        self.fit_from(groups, rows, logs, &starts)
    }

    /// Fits, each density from its start where there is one.
    pub fn fit_from(
        &self,
        groups: &[Group],
        rows: &[Vec<f64>],
        logs: &[usize],
        starts: &[Start],
    ) -> Result<(Densities, Vec<Start>), Error> {
        if self.joint {
            let (model, start) = self.configs[0].fit_from(rows, logs, &starts[0])?;
            return Ok((Densities::Joint(Box::new(model)), vec![start]));
        }
        let each = groups.par_iter().zip(&self.configs).zip(starts);
        let fitted: Result<Vec<_>, Error> = each
            .map(|((group, config), start)| config.fit_from(&select_all(rows, group), logs, start))
            .collect();
        let (models, starts) = fitted?.into_iter().unzip();
        Ok((Densities::PerGroup(models), starts))
    }
}

impl Densities {
    /// The density of each group: marginals of a joint one.
    pub(super) fn group_models(
        &self,
        groups: &[Group],
    ) -> Result<Vec<Cow<'_, DensityModel>>, Error> {
        match self {
            Self::Joint(model) => groups
                .iter()
                .map(|group| Ok(Cow::Owned(model.marginal_model(&group.columns)?)))
                .collect(),
            Self::PerGroup(models) => Ok(models.iter().map(Cow::Borrowed).collect()),
        }
    }

    /// `models` are those of [`group_models`](Self::group_models).
    pub(super) fn score(
        &self,
        models: &[Cow<'_, DensityModel>],
        groups: &[Group],
        row: &[f64],
    ) -> Result<RawScores, Error> {
        let scores = groups
            .iter()
            .zip(models)
            .map(|(group, model)| model.score(&select(row, group)));
        Ok(RawScores {
            joint: match self {
                Self::Joint(model) => Some(model.score(row)?),
                Self::PerGroup(_) => None,
            },
            groups: scores.collect::<Result<_, _>>()?,
        })
    }

    pub(super) fn validate(&self, combination: Combination, groups: &[Group]) -> Result<(), Error> {
        match self {
            Self::Joint(model) if combination == Combination::Joint => {
                let columns = groups.iter().map(|g| g.columns.len()).sum();
                expect_len("columns of the density", columns, model.dimension())
            }
            Self::PerGroup(models) if combination != Combination::Joint => {
                expect_len("densities of the groups", groups.len(), models.len())?;
                for (group, model) in groups.iter().zip(models) {
                    expect_len(
                        "columns of a group's density",
                        group.columns.len(),
                        model.dimension(),
                    )?;
                }
                Ok(())
            }
            _ => Err(Error::Inconsistent {
                part: "densities",
                reason: format!("they do not belong to the combination `{combination}`"),
            }),
        }
    }
}

impl RawScores {
    /// The score of each test: the joint one, else that of its groups' p-values.
    pub fn combine(
        &self,
        combination: Combination,
        tests: &[Range<usize>],
        references: &[Reference],
    ) -> Vec<Score> {
        let (mut ln_p, mut scores) = (Vec::new(), Vec::new());
        self.combine_into(combination, tests, references, &mut ln_p, &mut scores);
        scores
    }

    /// As [`combine`](Self::combine), in the place of what `scores` held; `ln_p` is scratch.
    pub fn combine_into(
        &self,
        combination: Combination,
        tests: &[Range<usize>],
        references: &[Reference],
        ln_p: &mut Vec<f64>,
        scores: &mut Vec<Score>,
    ) {
        scores.clear();
        if let Some(joint) = self.joint {
            return scores.push(joint);
        }
        let compared = self.groups.iter().zip(references);
        ln_p.clear();
        ln_p.extend(compared.map(|(&score, reference)| reference.ln_p(score)));
        // A test of one group needs no common measure: its density's own score tells windows apart best.
        let score = |test: &Range<usize>| match test.len() {
            1 => self.groups[test.start],
            _ => combination.score(&ln_p[test.clone()]),
        };
        scores.extend(tests.iter().map(score));
    }
}

fn select(row: &[f64], group: &Group) -> Vec<f64> {
    group.columns.iter().map(|&c| row[c]).collect()
}

fn select_all(rows: &[Vec<f64>], group: &Group) -> Vec<Vec<f64>> {
    rows.iter().map(|row| select(row, group)).collect()
}
