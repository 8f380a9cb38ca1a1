//! What streams say of stamps: on sound logs as they were recorded, and after faults of the stamps.

use super::Fitted;
use crate::faults::Part;
use crate::verdicts::pieces::of_logs;
use crate::verdicts::timing::{has_stamps, inject, range};
use anyhow::Result;
use dose3::stream::{EventKind, Said};
use dose3_datasets::Trajectory;
use dose3_datasets::faults::Fault;
use serde::Serialize;

/// Poses of a piece.
const LENGTH: usize = 1000;
/// Severities of the validation part over those that are tested.
const BETWEEN: f64 = 1.4;

/// One fault in the pieces of one set, or none in its whole logs.
#[derive(Clone, Debug, Serialize)]
pub struct Stamps {
    /// Name of the set.
    pub set: &'static str,
    /// The fault; none for sound logs.
    pub fault: Option<String>,
    /// Logs or pieces.
    pub pieces: usize,
    /// Hours of sound logs.
    pub hours: f64,
    /// Events of stamps, in sound logs all of them.
    pub events: usize,
    /// Of each piece with an event the seconds from the start of the fault to the first behind it.
    pub delays: Vec<f64>,
}

/// Sound logs and pieces with faults; nothing of logs without stamps.
pub fn run(
    set: &'static str,
    (logs, tested): (&[Trajectory], &[usize]),
    fitted: &Fitted,
    (part, most, seed): (Part, usize, u64),
) -> Result<Vec<Stamps>> {
    if !logs.iter().all(has_stamps) {
        return Ok(Vec::new());
    }
    let mut sound = Stamps::new(set, None);
    for log in tested.iter().map(|log| &logs[*log]) {
        sound.pieces += 1;
        sound.events += events(fitted, log)?.len();
        let span = log.stamps.last().zip(log.stamps.first());
        sound.hours += span.map_or(0.0, |(last, first)| (last - first) as f64 * 1e-9 / 3600.0);
    }
    let mut all = vec![sound];
    let factor = match part {
        Part::Validation => BETWEEN,
        Part::Test => 1.0,
    };
    let pieces = of_logs(logs, tested, LENGTH, most);
    for (.., fault) in Fault::timing() {
        let fault = fault.stronger(factor);
        let mut cell = Stamps::new(set, Some(fault.label()));
        for (i, piece) in pieces.iter().enumerate() {
            let seed = seed.wrapping_mul(1_000_033).wrapping_add(i as u64);
            let log = inject(&fault, &piece.trajectory, seed)?;
            let begin = piece.trajectory.stamps[range(&fault, &piece.trajectory).start];
            let after = events(fitted, &log)?;
            let first = after.iter().find(|stamp| **stamp >= begin);
            cell.pieces += 1;
            cell.events += usize::from(first.is_some());
            let delay = first.map(|stamp| (stamp - begin) as f64 * 1e-9);
            cell.delays.extend(delay);
        }
        all.push(cell);
    }
    Ok(all)
}

/// Adds what was found in one fold to what others found.
pub fn add(all: &mut Vec<Stamps>, found: Vec<Stamps>) {
    for cell in found {
        let same = |other: &&mut Stamps| (other.set, &other.fault) == (cell.set, &cell.fault);
        match all.iter_mut().find(same) {
            Some(known) => {
                known.pieces += cell.pieces;
                known.hours += cell.hours;
                known.events += cell.events;
                known.delays.extend(cell.delays);
            }
            None => all.push(cell),
        }
    }
}

impl Stamps {
    fn new(set: &'static str, fault: Option<String>) -> Self {
        Self {
            set,
            fault,
            pieces: 0,
            hours: 0.0,
            events: 0,
            delays: Vec::new(),
        }
    }
}

/// Stamps of the poses at which a stream speaks of stamps or of a pause.
fn events(fitted: &Fitted, log: &Trajectory) -> Result<Vec<i64>> {
    let mut stream = fitted.monitor.stream(log.frame)?;
    let mut heard = Vec::new();
    for (stamp, pose) in log.stamps.iter().zip(&log.poses) {
        for said in stream.push(*stamp, *pose)? {
            match said {
                Said::Event(event)
                    if matches!(
                        event.kind,
                        EventKind::Stamps(_) | EventKind::Gap { .. } | EventKind::Doubled { .. }
                    ) =>
                {
                    heard.push(event.stamp_ns);
                }
                _ => {}
            }
        }
    }
    Ok(heard)
}
