//! Held-out trusted scores and what follows from them.

use super::config::DetectorConfig;
use super::densities::{Densities, RawScores, Resolved};
use crate::calibration::{Reference, SharePrediction, held_out, thin};
use crate::error::{Error, expect_len};
use crate::folds::{FoldPlan, Unit};
use crate::score::Score;
use crate::statistics::Group;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What trusted windows and logs score that the densities have not seen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Scores beyond this are beyond the window threshold: the bottom `window_alpha` of the
    /// held-out likelihoods.
    pub threshold: Score,
    /// Held-out window scores.
    pub windows: Reference,
    /// Held-out window scores of each group of statistics.
    pub groups: Vec<Reference>,
    /// Whether logs or blocks of logs were held out.
    pub unit: Unit,
    /// Number of trusted logs.
    pub logs: usize,
    /// What each held-out log (or block) showed.
    pub units: Vec<UnitCalibration>,
}

/// A trusted log, or a block of one, when it was held out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnitCalibration {
    /// Name of the log, and of the block where it was cut.
    pub name: String,
    /// Its windows.
    pub windows: usize,
    /// Of them, those beyond the threshold that the *other* units set, as it will be for a new log.
    pub beyond: usize,
    /// Mean window score.
    pub mean_score: Score,
}

/// Cross-fits, calibrates, and fits to all rows.
pub(super) fn calibrate(
    config: &DetectorConfig,
    groups: &[Group],
    rows: &[Vec<f64>],
    logs: &[usize],
    log_names: &[String],
) -> Result<(Calibration, Densities), Error> {
    let plan = FoldPlan::new(logs, config.folds, config.overlap)?;
    let density = config.density.clone().with_seed(config.seed);
    let resolved = Resolved::new(&density, config.combination, groups, rows, logs)?;
    let raw = held_out(
        rows,
        logs,
        &plan,
        |rows, logs| {
            let densities = resolved.fit(groups, rows, logs)?;
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
    let references = group_references(&raw, groups.len(), |_| true)?;
    let scores = combined(config, &plan, &raw, groups.len())?;
    let units = units(config, &plan, &scores, logs, log_names)?;
    let windows = Reference::new(scores)?;
    let calibration = Calibration {
        threshold: windows.threshold(config.window_alpha),
        windows,
        groups: references,
        unit: plan.unit(),
        logs: plan.logs(),
        units,
    };
    Ok((calibration, resolved.fit(groups, rows, logs)?))
}

/// Per group, the scores of the rows that `keep` names.
fn group_references(
    raw: &[RawScores],
    groups: usize,
    keep: impl Fn(usize) -> bool,
) -> Result<Vec<Reference>, Error> {
    (0..groups)
        .map(|group| {
            let kept = raw.iter().enumerate().filter(|(row, _)| keep(*row));
            Reference::new(kept.map(|(_, scores)| scores.groups[group]).collect())
        })
        .collect()
}

/// The score of every held-out window. Its groups' p-values are taken from the other units only, as
/// those of a new log will be from the trusted ones.
fn combined(
    config: &DetectorConfig,
    plan: &FoldPlan,
    raw: &[RawScores],
    groups: usize,
) -> Result<Vec<Score>, Error> {
    if raw.iter().all(|scores| scores.joint.is_some()) {
        return Ok(raw
            .iter()
            .map(|s| s.combine(config.combination, &[]))
            .collect());
    }
    let per_unit: Result<Vec<Vec<Reference>>, Error> = (0..plan.units())
        .into_par_iter()
        .map(|unit| group_references(raw, groups, |row| plan.unit_of()[row] != unit))
        .collect();
    let per_unit = per_unit?;
    Ok(raw
        .iter()
        .zip(plan.unit_of())
        .map(|(scores, &unit)| scores.combine(config.combination, &per_unit[unit]))
        .collect())
}

fn units(
    config: &DetectorConfig,
    plan: &FoldPlan,
    scores: &[Score],
    logs: &[usize],
    log_names: &[String],
) -> Result<Vec<UnitCalibration>, Error> {
    let mut blocks_before = vec![0_usize; log_names.len()];
    (0..plan.units())
        .map(|unit| {
            let of_unit = |row: &usize| plan.unit_of()[*row] == unit;
            let mine: Vec<usize> = (0..scores.len()).filter(of_unit).collect();
            let others = (0..scores.len()).filter(|row| !of_unit(row));
            let threshold = Reference::new(others.map(|row| scores[row]).collect())?
                .threshold(config.window_alpha);
            let own: Vec<Score> = mine.iter().map(|&row| scores[row]).collect();
            let log = logs[mine[0]];
            blocks_before[log] += 1;
            let name = match plan.unit() {
                Unit::Log => log_names[log].clone(),
                Unit::Block => format!("{}, block {}", log_names[log], blocks_before[log]),
            };
            Ok(UnitCalibration {
                name,
                windows: own.len(),
                beyond: own.iter().filter(|&&s| s > threshold).count(),
                mean_score: Score::mean(&own),
            })
        })
        .collect()
}

impl Calibration {
    /// Mean scores of the held-out logs (or blocks).
    pub(super) fn log_scores(&self) -> Result<Reference, Error> {
        Reference::new(self.units.iter().map(|u| u.mean_score).collect())
    }

    /// The smallest p-value that a log can get: with blocks of n logs there still are only n logs.
    #[must_use]
    pub fn smallest_p_value(&self) -> f64 {
        1.0 / (self.logs + 1) as f64
    }

    /// What the held-out logs say of the number of windows beyond the threshold.
    pub(super) fn share_prediction(
        &self,
        config: &DetectorConfig,
    ) -> Result<SharePrediction, Error> {
        let seen: Vec<(usize, usize)> = self
            .units
            .iter()
            .map(|u| thin(u.beyond, u.windows, config.overlap))
            .collect();
        SharePrediction::new(&seen, config.window_alpha)
    }

    pub(super) fn validate(&self, config: &DetectorConfig, groups: usize) -> Result<(), Error> {
        let wrong = |reason: &str| {
            Err(Error::Inconsistent {
                part: "calibration",
                reason: reason.to_owned(),
            })
        };
        expect_len("groups of the calibration", groups, self.groups.len())?;
        let windows = self.windows.len();
        if self.groups.iter().any(|g| g.len() != windows) {
            return wrong("groups and windows differ in number");
        }
        if self.units.iter().map(|u| u.windows).sum::<usize>() != windows {
            return wrong("the logs' windows do not add up");
        }
        if self
            .units
            .iter()
            .any(|u| u.beyond > u.windows || u.windows == 0)
        {
            return wrong("a log has no windows, or more beyond the threshold than it has");
        }
        if self.logs == 0 || (self.unit == Unit::Log && self.logs != self.units.len()) {
            return wrong("the number of logs is not that of what was held out");
        }
        if self.threshold != self.windows.threshold(config.window_alpha) {
            return wrong("the threshold is not that of its scores");
        }
        Ok(())
    }
}
