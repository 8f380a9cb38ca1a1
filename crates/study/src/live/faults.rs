//! Seconds from the start of an injected fault to the alarm.

use super::Fitted;
use crate::faults::Part;
use crate::verdicts::pieces::{fault_range, of_logs};
use anyhow::Result;
use dose3_datasets::Trajectory;
use dose3_datasets::faults::Fault;
use dose3_ood::alarm::RaisedBy;
use rayon::prelude::*;
use serde::Serialize;

/// Poses of a piece.
const LENGTH: usize = 1000;
/// Poses of the range that a fault is injected into.
const FAULTY: usize = 100;
/// Severities of the validation part over those that are tested.
const BETWEEN: f64 = 1.4;

/// What is injected.
pub struct Plan<'a> {
    /// Only these names; all where empty.
    pub kinds: &'a [String],
    /// Validation or test.
    pub part: Part,
    /// Most pieces.
    pub most: usize,
    /// Of the faults.
    pub seed: u64,
    /// Every so many faults.
    pub step: usize,
}

/// One fault in the pieces of one set.
#[derive(Clone, Debug, Serialize)]
pub struct Delays {
    /// Letter of the set.
    pub set: char,
    /// The fault.
    pub fault: String,
    /// Its name, without the severity.
    pub family: &'static str,
    /// Piece by piece.
    pub pieces: Vec<Piece>,
}

/// One fault in one piece.
#[derive(Clone, Debug, Serialize)]
pub struct Piece {
    /// Name of the log.
    pub log: String,
    /// Whether the verdict on the whole piece calls it.
    pub called: bool,
    /// Seconds from the start of the fault to the alarm; none without one.
    pub delay: Option<f64>,
    /// Which watcher raised it.
    pub by: Option<RaisedBy>,
    /// Whether an alarm stood already when the fault began.
    pub before: bool,
    /// Seconds from the start of the fault to the pose that the alarm names as the first wrong one.
    pub since: Option<f64>,
}

/// All faults in the pieces of the tested logs.
pub fn run(
    (set, logs, tested): (char, &[Trajectory], &[usize]),
    fitted: &Fitted,
    plan: &Plan<'_>,
) -> Result<Vec<Delays>> {
    let pieces = of_logs(logs, tested, LENGTH, plan.most);
    let factor = match plan.part {
        Part::Validation => BETWEEN,
        Part::Test => 1.0,
    };
    let all: Vec<Fault> = [Fault::suite(), Fault::couplings()]
        .into_iter()
        .flatten()
        .map(|(.., fault)| fault.stronger(factor))
        .step_by(plan.step)
        .filter(|fault| plan.kinds.is_empty() || plan.kinds.iter().any(|k| k == fault.name()))
        .collect();
    all.par_iter()
        .map(|fault| {
            let mut found = Vec::new();
            for (i, piece) in pieces.iter().enumerate() {
                let seed = plan.seed.wrapping_mul(1_000_033).wrapping_add(i as u64);
                let range = fault_range(piece.trajectory.len(), FAULTY);
                let injected = fault.inject(&piece.trajectory, range, seed)?;
                let log = &injected.trajectory;
                let Some(begin) = log.stamps.get(injected.affected.start).copied() else {
                    continue;
                };
                let Ok(report) = fitted.detector.judge(log) else {
                    continue;
                };
                let (alarms, _) = fitted.listen(log)?;
                let seconds = |ns: i64| ns.saturating_sub(begin) as f64 * 1e-9;
                let after = alarms.iter().find(|alarm| alarm.raised.raised_ns >= begin);
                let before = alarms.iter().any(|alarm| {
                    let ended = alarm.ended_ns.unwrap_or(i64::MAX);
                    alarm.raised.raised_ns < begin && ended > begin
                });
                found.push(Piece {
                    log: piece.log.clone(),
                    called: report.verdict.differs(),
                    delay: after.map(|alarm| seconds(alarm.raised.raised_ns)),
                    since: after.map(|alarm| seconds(alarm.raised.since_ns)),
                    by: after.map(|alarm| alarm.raised.raised_by),
                    before,
                });
            }
            Ok(Delays {
                set,
                fault: fault.label(),
                family: fault.name(),
                pieces: found,
            })
        })
        .collect()
}

/// Adds what was found in one fold to what others found.
pub fn add(all: &mut Vec<Delays>, found: Vec<Delays>) {
    for cell in found {
        let same = |other: &&mut Delays| (other.set, &other.fault) == (cell.set, &cell.fault);
        match all.iter_mut().find(same) {
            Some(known) => known.pieces.extend(cell.pieces),
            None => all.push(cell),
        }
    }
}
