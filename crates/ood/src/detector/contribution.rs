//! Which groups of statistics drove a verdict.

use super::DetectorStatistics;
use super::scored::Scored;
use crate::calibration::Reference;
use crate::score::Score;
use crate::statistics::quantile_sorted;
use serde::{Deserialize, Serialize};

/// What one group of statistics says of the windows that decided: of the run that sets the log apart where
/// it is, else of those beyond the threshold where there are any, else of all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Contribution {
    /// Name of the group.
    pub group: String,
    /// p-value of the windows' median score under this group's density, among held-out trusted
    /// windows.
    pub p_value: f64,
    /// Where that median lies between the trusted median (0) and the group's own threshold (1);
    /// above 1 it is beyond.
    pub excess: f64,
    /// Share of all windows of the log beyond the group's own threshold.
    pub share_beyond: f64,
}

/// Of every group, the strongest first; `deciding` are the windows to look at, not empty.
pub(super) fn contributions(
    detector: &DetectorStatistics,
    scored: &[Scored],
    deciding: &[usize],
) -> Vec<Contribution> {
    let mut contributions: Vec<Contribution> = detector
        .groups
        .iter()
        .zip(&detector.calibration.groups)
        .enumerate()
        .map(|(index, (group, reference))| {
            let looked_at = deciding.iter().map(|&w| scored[w].groups[index].value());
            let mut values: Vec<f64> = looked_at.collect();
            values.sort_by(f64::total_cmp);
            let median = quantile_sorted(&values, 0.5);
            let own = reference.threshold(detector.config.window_alpha);
            let over = scored.iter().filter(|s| s.groups[index] > own).count();
            Contribution {
                group: group.name.clone(),
                p_value: reference.p_value(Score::new(median)),
                excess: excess(reference, own, median),
                share_beyond: over as f64 / scored.len() as f64,
            }
        })
        .collect();
    contributions.sort_by(|a, b| b.excess.total_cmp(&a.excess));
    contributions
}

fn excess(reference: &Reference, threshold: Score, score: f64) -> f64 {
    let median = reference.quantile(0.5);
    let spread = threshold.value() - median;
    (score - median) / spread.max(1e-9 * median.abs().max(1.0))
}
