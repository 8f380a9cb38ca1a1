//! Faults of the stamps in pieces of logs as they were recorded, and false alarms of whole logs: every group of logs
//! left out in turn.

use super::fold;
use super::judge::ALPHA;
use super::pieces::{self, Piece};
use anyhow::Result;
use dose3_datasets::faults::Fault;
use dose3_datasets::{Trajectory, stretches};
use dose3_ood::ExternalTest;
use dose3_ood::timing::{Cadence, TimingReference};
use serde::Serialize;
use std::ops::Range;

/// Share of alpha that the test of the stamps has in a verdict.
pub const SHARE: f64 = 0.1;
/// Poses of a piece.
const PIECE: usize = 1000;
/// How long faults last that have no length of their own, seconds.
const SECONDS: f64 = 10.0;

/// Pieces of a set with one fault of the stamps.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimingCell {
    /// Name of the set.
    pub set: String,
    /// The fault; none for sound pieces.
    pub fault: Option<String>,
    /// Pieces judged.
    pub pieces: usize,
    /// Pieces called.
    pub called: usize,
    /// What was said of the first piece that was called.
    pub example: Option<String>,
}

/// Whole logs of a set, sound, each judged by the others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimingAlarms {
    /// Name of the set.
    pub set: String,
    /// Logs judged.
    pub logs: usize,
    /// Logs called, with what was said.
    pub called: Vec<String>,
}

/// Whether the log has stamps of its own.
pub fn has_stamps(log: &Trajectory) -> bool {
    log.stamp_unit.is_some()
}

/// Judges pieces of `logs`, at most `most`, with each fault, and the whole logs; none without stamps.
///
/// # Errors
/// A fault that cannot be injected.
pub fn run(
    set: &str,
    logs: &[Trajectory],
    groups: &[usize],
    (faults, most): (&[Fault], usize),
    seed: u64,
) -> Result<Option<(Vec<TimingCell>, TimingAlarms)>> {
    if !logs.iter().all(has_stamps) {
        return Ok(None);
    }
    let mut alarms = TimingAlarms {
        set: set.to_owned(),
        logs: 0,
        called: Vec::new(),
    };
    let choices: Vec<Option<Fault>> = std::iter::once(None)
        .chain(faults.iter().copied().map(Some))
        .collect();
    let mut cells: Vec<TimingCell> = choices
        .iter()
        .map(|fault| TimingCell {
            set: set.to_owned(),
            fault: fault.as_ref().map(Fault::label),
            pieces: 0,
            called: 0,
            example: None,
        })
        .collect();
    let all: Vec<usize> = (0..logs.len()).collect();
    let chosen = of_logs(logs, &all, most);
    for fold in fold::by_group(groups, usize::MAX) {
        let reference = reference(logs, &fold.fitted, groups)?;
        for log in fold.tested.iter().map(|log| &logs[*log]) {
            alarms.logs += 1;
            let said = call(&reference, log);
            alarms
                .called
                .extend(said.map(|said| format!("{}: {said}", log.name)));
            for (i, piece) in chosen.iter().enumerate().filter(|(_, p)| p.log == log.name) {
                for (fault, cell) in choices.iter().zip(&mut cells) {
                    let seed = seed.wrapping_mul(1_000_033).wrapping_add(i as u64);
                    let faulty = match fault {
                        None => piece.trajectory.clone(),
                        Some(fault) => inject(fault, &piece.trajectory, seed)?,
                    };
                    cell.pieces += 1;
                    if let Some(said) = call(&reference, &faulty) {
                        cell.called += 1;
                        cell.example.get_or_insert(said);
                    }
                }
            }
        }
    }
    Ok(Some((cells, alarms)))
}

/// What is trusted of the stamps of the logs named.
///
/// # Errors
/// None with stamps.
pub fn reference(
    logs: &[Trajectory],
    fitted: &[usize],
    groups: &[usize],
) -> Result<TimingReference> {
    let (mut cadences, mut of) = (Vec::new(), Vec::new());
    for &log in fitted {
        if let Some(cadence) = Cadence::of(logs[log].source_stamps()) {
            cadences.push(cadence);
            of.push(groups[log]);
        }
    }
    Ok(TimingReference::fit(&cadences, &of)?)
}

/// The stamps of a log as a test beside those of a detector; none without enough of them.
pub fn test(reference: &TimingReference, log: &Trajectory) -> Option<ExternalTest> {
    let verdict = reference.judge(&Cadence::of(log.source_stamps())?, ALPHA * SHARE);
    let said: Vec<String> = verdict.events.iter().map(ToString::to_string).collect();
    Some(ExternalTest {
        name: "stamps".to_owned(),
        share: SHARE,
        p_value: verdict.chance,
        sentence: said.join("; "),
    })
}

/// What the stamps show, where they are unlike the trusted ones.
fn call(reference: &TimingReference, log: &Trajectory) -> Option<String> {
    let test = test(reference, log)?;
    (test.p_value <= ALPHA * SHARE).then_some(test.sentence)
}

/// Pieces of recorded logs; where a log has too short stretches, all of it.
fn of_logs(logs: &[Trajectory], tested: &[usize], most: usize) -> Vec<Piece> {
    pieces::of_logs(logs, tested, PIECE, most)
}

/// For ten seconds from two fifths of the piece on; jitter on all of it.
///
/// # Errors
/// A fault that cannot be injected.
pub fn inject(fault: &Fault, piece: &Trajectory, seed: u64) -> Result<Trajectory> {
    Ok(fault.apply(piece, range(fault, piece), seed)?)
}

/// Where [`inject`] puts a fault.
pub fn range(fault: &Fault, piece: &Trajectory) -> Range<usize> {
    let stretch = stretches(piece, piece.max_gap)
        .into_iter()
        .max_by_key(ExactSizeIterator::len)
        .unwrap_or(0..piece.len());
    if matches!(fault, Fault::StampJitter { .. }) {
        return stretch;
    }
    let start = stretch.start + 2 * stretch.len() / 5;
    let last = piece.stamps[start].saturating_add((SECONDS * 1e9) as i64);
    let end = piece.stamps.partition_point(|stamp| *stamp <= last);
    start..end.clamp(start + 2, stretch.end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_datasets::synthetic::{Platform, suite};

    #[test]
    fn faults_of_stamps_are_called_and_sound_logs_are_not() {
        let logs = suite(Platform::Drone, 4, 3);
        let faults = [Fault::Stall { seconds: 1.0 }, Fault::Drop { share: 0.2 }];
        let (cells, alarms) = run("drone", &logs, &[0, 1, 2, 3], (&faults, 4), 0)
            .unwrap()
            .unwrap();
        assert_eq!((alarms.logs, alarms.called.len()), (4, 0));
        assert_eq!(cells.len(), 3);
        assert_eq!(cells[0].called, 0);
        for cell in &cells[1..] {
            assert_eq!(cell.called, cell.pieces);
            assert!(cell.pieces > 0 && cell.example.is_some());
        }
        // Without stamps there is nothing to say.
        let mut without = logs;
        without[2].stamp_unit = None;
        assert_eq!(
            run("drone", &without, &[0, 1, 2, 3], (&faults, 4), 0).unwrap(),
            None
        );
    }
}
