//! Trusted groups that are unlike the other trusted ones.
//!
//! One odd trusted log sets every threshold. So each group is judged by the others as a new log would be,
//! and while the least likely one has a chance of at most [`ALPHA`], it is left out of the *reference* that
//! new logs are compared with by the test that shows it: an unusual speed is no reason to forget how the
//! axes of that log go together. It stays in the densities, which only say what is likely, and the user is
//! told. No more than a tenth of the groups goes, or one: a reference that drops whatever does not fit
//! would promise too much; of fewer than eight groups none does.

use super::held_out::{HeldOut, Kept, Scores};
use crate::calibration::{Run, RunReference};
use crate::error::Error;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// With fewer groups there is nothing to judge one by.
const FEWEST_GROUPS: usize = 4;
/// With fewer groups those unlike the others are named only: one of five is as likely to be what sound logs also
/// are, and without it more sound logs are called.
const FEWEST_TO_LEAVE_OUT: usize = 8;
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
    /// Chance of so unusual a group among groups like the others, those left out aside, whenever in the
    /// audit it was found.
    pub p_value: f64,
    /// Whether it was left out of the reference of a test.
    pub left_out: bool,
    /// Name of the test that shows it best.
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
    /// Whether each group is in the reference of each test, `[test][group]`.
    pub kept: Vec<Vec<bool>>,
    /// Scores with that reference.
    pub scores: Scores,
    /// What was found, in the order in which it was.
    pub findings: Vec<AuditFinding>,
}

/// Audits `names.len()` groups, all of which have windows or are not counted.
pub(super) fn audit(held_out: &HeldOut<'_>, names: &[String]) -> Result<Audited, Error> {
    let mut kept = vec![vec![true; names.len()]; held_out.tests.len()];
    let mut scores = held_out.scores(&kept)?;
    let groups = held_out.plan.logs();
    if groups < FEWEST_GROUPS {
        return Ok(Audited {
            kept,
            scores,
            findings: Vec::new(),
        });
    }
    let most = match held_out.config.keep_all || groups < FEWEST_TO_LEAVE_OUT {
        true => 0,
        false => ((LARGEST_SHARE * groups as f64) as usize).max(1),
    };
    let all: Vec<(usize, usize)> = (0..kept.len())
        .flat_map(|test| (0..names.len()).map(move |group| (test, group)))
        .collect();
    let mut found: Vec<(usize, usize)> = Vec::new();
    loop {
        let rest = all.iter().filter(|pair| !found.contains(pair)).copied();
        let mut unlike = judged(held_out, &scores, &kept, rest.collect())?;
        unlike.retain(|found| found.p_value <= ALPHA);
        // The least likely first; the order of tests and groups where they tie.
        unlike.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
        let has_room = |test: usize| kept[test].iter().filter(|kept| !**kept).count() < most;
        let next = unlike.iter().find(|found| has_room(found.test));
        let Some(next) = next.map(|next| (next.test, next.group)) else {
            found.extend(unlike.iter().map(|found| (found.test, found.group)));
            break;
        };
        kept[next.0][next.1] = false;
        found.push(next);
        scores = held_out.scores(&kept)?;
    }
    let findings = findings(held_out, &scores, &kept, found, names)?;
    Ok(Audited {
        kept,
        scores,
        findings,
    })
}

/// What is said of the pairs of test and group that were found: all by the same reference, the one that stays, each
/// group once, by what sets it apart most.
fn findings(
    held_out: &HeldOut<'_>,
    scores: &Scores,
    kept: &Kept,
    found: Vec<(usize, usize)>,
    names: &[String],
) -> Result<Vec<AuditFinding>, Error> {
    let test_names = held_out.config.statistics.test_names();
    let mut judged = judged(held_out, scores, kept, found)?;
    judged.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    let mut said = BTreeSet::new();
    judged.retain(|one| said.insert(one.group));
    let finding = |one: Judged| AuditFinding {
        group: names[one.group].clone(),
        p_value: one.p_value,
        left_out: kept.iter().any(|test| !test[one.group]),
        test: test_names[one.test].clone(),
        log: held_out.places[one.run.first].log,
        first: one.run.first,
        last: one.run.last,
    };
    Ok(judged.into_iter().map(finding).collect())
}

/// A group as one test sees it.
struct Judged {
    test: usize,
    group: usize,
    p_value: f64,
    run: Run,
}

/// Groups, each by the other kept ones of the test.
fn judged(
    held_out: &HeldOut<'_>,
    scores: &Scores,
    kept: &Kept,
    pairs: Vec<(usize, usize)>,
) -> Result<Vec<Judged>, Error> {
    let config = held_out.config;
    let (shares, durations) = (config.shares(), config.durations());
    let longest = durations.iter().map(|d| d.windows).max().unwrap_or(1);
    let judge = |(test, group): (usize, usize)| -> Result<Option<Judged>, Error> {
        let own = held_out.stretch_rows(|g| g == group);
        if own.is_empty() {
            return Ok(None);
        }
        let of_test = &scores.tests[test];
        let others = held_out.stretches(of_test, |g| g != group && kept[test][g]);
        let reference = RunReference::new(&others, longest, config.overlap)?;
        let run = reference.worst_run(of_test, &own, &durations);
        Ok(run.map(|run| Judged {
            test,
            group,
            p_value: (run.p_value / shares[test]).min(1.0),
            run,
        }))
    };
    pairs
        .into_par_iter()
        .map(judge)
        .filter_map(Result::transpose)
        .collect()
}
