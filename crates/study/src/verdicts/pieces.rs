//! Pieces of logs with a fault in them: how often each contender calls them out of distribution.

use super::defects;
use super::fold::FoldFit;
use super::table::{Measurer, Table};
use anyhow::Result;
use dose3_datasets::faults::{Fault, Injection, faulty_steps};
use dose3_datasets::{Trajectory, stretches};
use serde::Serialize;
use std::ops::Range;

/// Poses of the shortest log that is a piece as it is.
const SHORTEST: usize = 200;

/// How long pieces and the faults in them are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Plan {
    /// Poses of a piece. Logs without one, of 200 poses or more, are one piece.
    pub length: usize,
    /// Poses of the range that a fault is injected into.
    pub faulty: usize,
}

/// Part of a log.
pub struct Piece {
    /// Name of the log.
    pub log: String,
    /// First pose within the log.
    pub start: usize,
    /// Its poses.
    pub trajectory: Trajectory,
}

/// What a contender says of the pieces of a set with one fault, or with none.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Called {
    /// Letter of the set.
    pub set: char,
    /// Key of the contender.
    pub contender: &'static str,
    /// How long pieces and faults are.
    pub plan: Plan,
    /// Trusted logs, where they were few on purpose.
    pub trusted: Option<usize>,
    /// The fault; none for sound pieces.
    pub fault: Option<String>,
    /// Pieces judged.
    pub pieces: usize,
    /// Pieces called out of distribution.
    pub called: usize,
    /// Sound pieces that were called, with what is known to be wrong with them.
    pub alarms: Vec<String>,
}

/// Pieces of the `tested` logs, at most `most` of them, evenly spread.
pub fn of_logs(logs: &[Trajectory], tested: &[usize], length: usize, most: usize) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for log in tested.iter().map(|log| &logs[*log]) {
        let all = stretches(log, log.max_gap);
        let mut ranges: Vec<Range<usize>> = Vec::new();
        for stretch in &all {
            let starts = stretch.clone().step_by(length);
            let whole = starts.filter(|start| start + length <= stretch.end);
            ranges.extend(whole.map(|start| start..start + length));
        }
        if ranges.is_empty() {
            let longest = all.into_iter().max_by_key(ExactSizeIterator::len);
            ranges.extend(longest.filter(|stretch| stretch.len() >= SHORTEST.min(length)));
        }
        pieces.extend(ranges.into_iter().map(|range| Piece {
            log: log.name.clone(),
            start: range.start,
            trajectory: log.cut(range),
        }));
    }
    let kept = pieces.len().min(most);
    let is_kept = |i: usize| i * kept / pieces.len() != (i + 1) * kept / pieces.len();
    let keep: Vec<bool> = (0..pieces.len()).map(is_kept).collect();
    let mut keep = keep.into_iter();
    pieces.retain(|_| keep.next() == Some(true));
    pieces
}

/// Where the fault of a piece is: from two fifths of it on, or from end to end.
pub fn fault_range(length: usize, faulty: usize) -> Range<usize> {
    if faulty >= length {
        return 0..length;
    }
    let start = 2 * length / 5;
    start..(start + faulty).min(length - 1)
}

/// Judges all pieces, sound and with each fault.
///
/// # Errors
/// A failing network, a fault that cannot be injected.
pub fn run(
    set: char,
    pieces: &[Piece],
    (plan, trusted): (Plan, Option<usize>),
    faults: &[Fault],
    fit: &FoldFit,
    seed: u64,
    measurer: &mut Measurer,
) -> Result<Vec<Called>> {
    let logs: Vec<Trajectory> = pieces
        .iter()
        .map(|piece| piece.trajectory.clone())
        .collect();
    let windows = measurer.windows(&logs);
    let sound = measurer.measure(&logs, &windows)?;
    let all: Vec<usize> = (0..pieces.len()).collect();
    let cell = |contender, fault: Option<&Fault>, called: &[usize]| Called {
        set,
        contender,
        plan,
        trusted,
        fault: fault.map(Fault::label),
        pieces: pieces.len(),
        called: called.len(),
        alarms: match fault {
            Some(_) => Vec::new(),
            None => called
                .iter()
                .map(|&i| defects::describe(set, &pieces[i]))
                .collect(),
        },
    };
    let mut cells = Vec::new();
    for (contender, called) in judge(&sound, &all, fit, measurer)? {
        cells.push(cell(contender, None, &called));
    }
    for fault in faults {
        let injections = pieces.iter().enumerate().map(|(i, piece)| {
            let seed = seed.wrapping_mul(1_000_033).wrapping_add(i as u64);
            let range = fault_range(piece.trajectory.len(), plan.faulty);
            fault.inject(&piece.trajectory, range, seed)
        });
        let injections = injections.collect::<Result<Vec<_>, _>>()?;
        let faulty = with_faults(&sound, &logs, &injections, measurer)?;
        for (contender, called) in judge(&faulty, &all, fit, measurer)? {
            cells.push(cell(contender, Some(fault), &called));
        }
    }
    Ok(cells)
}

/// Windows of faulty pieces. Those without a faulty step move as they did, so theirs are taken from the sound
/// piece, unless the fault changed the number of poses.
fn with_faults(
    sound: &Table,
    logs: &[Trajectory],
    injections: &[Injection],
    measurer: &mut Measurer,
) -> Result<Table> {
    let faulty: Vec<Trajectory> = injections.iter().map(|i| i.trajectory.clone()).collect();
    let windows = measurer.windows(&faulty);
    let known: Vec<Option<usize>> = windows
        .iter()
        .map(|window| {
            let log = window.trajectory;
            let same_poses = faulty[log].len() == logs[log].len();
            let moves_as_before = faulty_steps(&injections[log].affected, window) == 0;
            let position = || sound.windows.iter().position(|other| other == window);
            (same_poses && moves_as_before).then(position).flatten()
        })
        .collect();
    let fresh: Vec<_> = windows
        .iter()
        .zip(&known)
        .filter(|(_, known)| known.is_none())
        .map(|(window, _)| *window)
        .collect();
    let measured = measurer.measure(&faulty, &fresh)?;
    let mut table = Table::default();
    let mut next = 0..fresh.len();
    for known in known {
        match known {
            Some(window) => table.push(sound, window),
            None => next
                .next()
                .into_iter()
                .for_each(|window| table.push(&measured, window)),
        }
    }
    Ok(table)
}

/// Those of the `pieces` that each contender calls.
pub fn judge(
    table: &Table,
    pieces: &[usize],
    fit: &FoldFit,
    measurer: &Measurer,
) -> Result<Vec<(&'static str, Vec<usize>)>> {
    let mut all = Vec::new();
    for (contender, fitted) in &fit.fitted {
        let set = contender.set()?;
        let mut called = Vec::new();
        for &piece in pieces {
            let windows = table.of_log(piece);
            if windows.is_empty() {
                continue;
            }
            let rows = measurer.rows(table, &windows, &set, |_| fit.linear.all())?;
            let stretches: Vec<usize> = windows.iter().map(|&w| table.stretches[w]).collect();
            if fitted.judge(&rows, &stretches)?.called {
                called.push(piece);
            }
        }
        all.push((contender.key, called));
    }
    Ok(all)
}

/// Adds what was found in one fold to what others found of the same.
pub fn add(all: &mut Vec<Called>, found: Vec<Called>) {
    for cell in found {
        let same = |other: &&mut Called| {
            (other.set, other.contender, other.plan) == (cell.set, cell.contender, cell.plan)
                && (other.trusted, &other.fault) == (cell.trusted, &cell.fault)
        };
        match all.iter_mut().find(same) {
            Some(known) => {
                known.pieces += cell.pieces;
                known.called += cell.called;
                known.alarms.extend(cell.alarms);
            }
            None => all.push(cell),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_datasets::synthetic::{Platform, trajectory};

    #[test]
    fn pieces_by_hand() {
        let logs = [150, 600, 2500].map(|poses| trajectory(Platform::Drone, 2, poses, 10.0));
        let of = |length, most| -> Vec<(usize, usize)> {
            let found = of_logs(&logs, &[0, 1, 2], length, most);
            found
                .iter()
                .map(|p| (p.start, p.trajectory.len()))
                .collect()
        };
        assert_eq!(of(1000, usize::MAX), [(0, 600), (0, 1000), (1000, 1000)]);
        assert_eq!(of(300, usize::MAX).len(), 2 + 8);
        assert_eq!(of(300, 3).len(), 3);
        assert_eq!(fault_range(1000, 100), 400..500);
        assert_eq!(fault_range(220, 150), 88..219);
        assert_eq!(fault_range(220, 1000), 0..220);
    }
}
