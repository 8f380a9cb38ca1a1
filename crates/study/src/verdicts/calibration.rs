//! Faults of the calibration in whole logs, told by the finding that names them: every group of logs left out in turn.

use super::defects;
use super::fold;
use super::judge::ALPHA;
use anyhow::Result;
use dose3_datasets::faults::Fault;
use dose3_datasets::{Trajectory, increments, stretches};
use dose3_ood::findings::calibration::{CalibrationPiece, CalibrationReference};
use rayon::prelude::*;
use serde::Serialize;

/// Share of alpha that the finding has in a verdict.
pub const SHARE: f64 = dose3::detector::CALIBRATION_SHARE;

/// Pieces of a set with one fault all over their log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CalibrationCell {
    /// Letter of the set.
    pub set: char,
    /// Which logs are judged: `test`, or `all` in turn.
    pub logs: &'static str,
    /// The fault; none for sound pieces.
    pub fault: Option<String>,
    /// Pieces of about 1000 poses judged.
    pub pieces: usize,
    /// Pieces called.
    pub called: usize,
    /// Whole logs judged.
    pub whole: usize,
    /// Whole logs called.
    pub whole_called: usize,
    /// What was said of the first piece that was called.
    pub example: Option<String>,
    /// Sound pieces that were called, with what is known to be wrong with them.
    pub alarms: Vec<String>,
}

/// The faults that a calibration can have, of a list.
pub fn faults(couplings: Vec<Fault>) -> Vec<Fault> {
    let of_calibration = |fault: &Fault| {
        matches!(
            fault,
            Fault::PositionLate { .. }
                | Fault::AttitudeLate { .. }
                | Fault::LeverArm { .. }
                | Fault::Extrinsic { .. }
        )
    };
    couplings.into_iter().filter(of_calibration).collect()
}

/// About a thousand poses each, of every gap-free stretch.
///
/// # Errors
/// Poses that are no numbers.
pub fn pieces(log: &Trajectory) -> Result<Vec<CalibrationPiece>> {
    let mut pieces = Vec::new();
    for stretch in stretches(log, log.max_gap) {
        let steps = increments(&log.poses[stretch], log.frame);
        pieces.extend(CalibrationPiece::of_stretch(&steps, log.rate.hertz)?);
    }
    Ok(pieces)
}

/// The pieces of one log, sound and with each fault.
struct Log {
    name: String,
    /// `[choice][piece]`; the first choice is no fault.
    choices: Vec<Vec<CalibrationPiece>>,
}

/// Judges all pieces of the `folds` of `logs` with each fault, by what the others of their fold say.
///
/// # Errors
/// A fault that cannot be injected.
pub fn run(
    set: char,
    (logs, groups): (&[Trajectory], &[usize]),
    folds: &[(&'static str, Vec<fold::Fold>)],
    faults: &[Fault],
    seed: u64,
) -> Result<Vec<CalibrationCell>> {
    let measured: Vec<Log> = logs
        .par_iter()
        .enumerate()
        .map(|(i, log)| {
            measure(
                log,
                faults,
                seed.wrapping_mul(1_000_033).wrapping_add(i as u64),
            )
        })
        .collect::<Result<_>>()?;
    let choices = || std::iter::once(None).chain(faults.iter().map(Some));
    let mut cells = Vec::new();
    for (name, folds) in folds {
        let mut of_protocol: Vec<CalibrationCell> = choices()
            .map(|fault| CalibrationCell {
                set,
                logs: name,
                fault: fault.map(Fault::label),
                pieces: 0,
                called: 0,
                whole: 0,
                whole_called: 0,
                example: None,
                alarms: Vec::new(),
            })
            .collect();
        for fold in folds {
            let (mut trusted, mut of) = (Vec::new(), Vec::new());
            for &log in &fold.fitted {
                trusted.extend(measured[log].choices[0].iter().cloned());
                of.resize(trusted.len(), groups[log]);
            }
            if trusted.is_empty() {
                continue;
            }
            let reference = CalibrationReference::fit(&trusted, &of)?;
            for &log in &fold.tested {
                for (cell, pieces) in of_protocol.iter_mut().zip(&measured[log].choices) {
                    add(cell, &reference, (&logs[log], &measured[log].name), pieces)?;
                }
            }
        }
        cells.extend(of_protocol);
    }
    Ok(cells)
}

fn measure(log: &Trajectory, faults: &[Fault], seed: u64) -> Result<Log> {
    let longest = stretches(log, log.max_gap)
        .into_iter()
        .max_by_key(ExactSizeIterator::len)
        .unwrap_or(0..log.len());
    let sound = log.cut(longest);
    let mut choices = vec![pieces(&sound)?];
    for fault in faults {
        choices.push(pieces(&fault.apply(&sound, 0..sound.len(), seed)?)?);
    }
    Ok(Log {
        name: log.name.clone(),
        choices,
    })
}

fn add(
    cell: &mut CalibrationCell,
    reference: &CalibrationReference,
    (log, name): (&Trajectory, &str),
    pieces: &[CalibrationPiece],
) -> Result<()> {
    for (i, piece) in pieces.iter().enumerate() {
        let one = std::slice::from_ref(piece);
        let Some(finding) = reference.judge(one, ALPHA * SHARE)? else {
            continue;
        };
        cell.pieces += 1;
        if !finding.called {
            continue;
        }
        cell.called += 1;
        let said = || finding.sentence(log.frame.has_forward());
        match cell.fault {
            Some(_) => drop(cell.example.get_or_insert_with(said)),
            None => {
                let defect = defects::known(cell.set, name, 0..log.len(), log);
                let defect = defect.map_or(String::new(), |defect| format!(" ({defect})"));
                let of = format!(
                    "{name} piece {} of {}{defect}: {}",
                    i + 1,
                    pieces.len(),
                    said()
                );
                cell.alarms.push(of);
            }
        }
    }
    if let Some(finding) = reference.judge(pieces, ALPHA * SHARE)? {
        cell.whole += 1;
        cell.whole_called += usize::from(finding.called);
    }
    Ok(())
}
