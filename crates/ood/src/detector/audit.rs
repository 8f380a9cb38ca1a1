//! Trusted groups that are unlike the other trusted ones.
//!
//! One odd trusted log sets every threshold. So each group is judged by the others as a new log would be,
//! and while the least likely one has a chance of at most [`ALPHA`], it is left out of the *reference* that
//! new logs are compared with. It stays in the densities, which only say what is likely, and the user is
//! told. No more than a tenth of the groups goes, or one: a reference that drops whatever does not fit
//! would promise too much.

use super::held_out::{HeldOut, Scores};
use crate::calibration::{Run, RunReference};
use crate::error::Error;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// With fewer groups there is nothing to judge one by.
const FEWEST_GROUPS: usize = 4;
/// A group with at most this chance is named.
pub(super) const ALPHA: f64 = 0.005;
/// Largest share of the groups that may be left out, one aside.
const LARGEST_SHARE: f64 = 0.1;

/// A trusted group that is unlike the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AuditFinding {
    /// Name of the group.
    pub group: String,
    /// Chance of so unusual a group among groups like the others.
    pub p_value: f64,
    /// Whether it was left out of the reference.
    pub left_out: bool,
    /// Name of the test that shows it.
    pub test: String,
    /// Index of the log with its most unusual run of windows, as given to the fit.
    pub log: usize,
    /// Index of the run's first window among all trusted windows, as given to the fit.
    pub first: usize,
    /// Index of its last window.
    pub last: usize,
}

/// What the audit decided.
pub(super) struct Audited {
    /// Whether each group is in the reference.
    pub kept: Vec<bool>,
    /// Scores with that reference.
    pub scores: Scores,
    /// What was found, in the order in which it was.
    pub findings: Vec<AuditFinding>,
}

/// Audits `names.len()` groups, all of which have windows or are not counted.
pub(super) fn audit(held_out: &HeldOut<'_>, names: &[String]) -> Result<Audited, Error> {
    let mut kept = vec![true; names.len()];
    let mut scores = held_out.scores(&kept)?;
    let mut findings = Vec::new();
    let groups = held_out.plan.logs();
    if groups < FEWEST_GROUPS {
        return Ok(Audited {
            kept,
            scores,
            findings,
        });
    }
    let most = match held_out.config.keep_all {
        true => 0,
        false => ((LARGEST_SHARE * groups as f64) as usize).max(1),
    };
    loop {
        let mut unlike = judged(held_out, &scores, &kept, names)?;
        unlike.retain(|finding| finding.1.p_value <= ALPHA);
        // The least likely first; the order of the groups where they tie.
        unlike.sort_by(|a, b| a.1.p_value.total_cmp(&b.1.p_value));
        let full = findings.len() == most;
        if full || unlike.is_empty() {
            findings.extend(unlike.into_iter().map(|(_, finding)| finding));
            break;
        }
        let (group, finding) = unlike.swap_remove(0);
        kept[group] = false;
        findings.push(AuditFinding {
            left_out: true,
            ..finding
        });
        scores = held_out.scores(&kept)?;
    }
    Ok(Audited {
        kept,
        scores,
        findings,
    })
}

/// Each kept group by the other kept ones.
fn judged(
    held_out: &HeldOut<'_>,
    scores: &Scores,
    kept: &[bool],
    names: &[String],
) -> Result<Vec<(usize, AuditFinding)>, Error> {
    let config = held_out.config;
    let (shares, durations) = (config.shares(), config.durations());
    let longest = durations.iter().map(|d| d.windows).max().unwrap_or(1);
    let test_names = config.statistics.test_names();
    let present = |group: &usize| held_out.places.iter().any(|p| p.group == *group);
    let groups: Vec<usize> = (0..kept.len()).filter(|g| kept[*g] && present(g)).collect();
    groups
        .into_par_iter()
        .map(|group| {
            let own = held_out.stretch_rows(|g| g == group);
            let mut worst: Option<(f64, usize, Run)> = None;
            for (test, (scores, share)) in scores.tests.iter().zip(&shares).enumerate() {
                let others = held_out.stretches(scores, |g| g != group && kept[g]);
                let reference = RunReference::new(&others, longest, config.overlap)?;
                let Some(run) = reference.worst_run(scores, &own, &durations) else {
                    continue;
                };
                let p = (run.p_value / share).min(1.0);
                if worst.as_ref().is_none_or(|(before, ..)| p < *before) {
                    worst = Some((p, test, run));
                }
            }
            Ok(worst.map(|(p_value, test, run)| {
                let finding = AuditFinding {
                    group: names[group].clone(),
                    p_value,
                    left_out: false,
                    test: test_names[test].clone(),
                    log: held_out.places[run.first].log,
                    first: run.first,
                    last: run.last,
                };
                (group, finding)
            }))
        })
        .filter_map(Result::transpose)
        .collect()
}
