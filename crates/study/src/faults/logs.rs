//! Faults in logs of realistic length: verdict, detection at few false alarms, delay.

use super::methods::METHODS;
use super::prober::{Prober, Rows};
use super::protocol::LogSet;
use super::windows::Context;
use anyhow::{Context as _, Result};
use dose3_datasets::faults::{Fault, Injection, faulty_steps};
use dose3_datasets::{Trajectory, Window, stretches, windows as cut_windows};
use dose3_ood::{DetectorStatistics, Reference, Score};
use serde::Serialize;
use std::ops::Range;

/// Poses of a piece.
pub const PIECE: usize = 1000;
/// Poses of a piece that the fault is injected into.
pub const FAULT: Range<usize> = 400..500;
/// Poses of the shortest log that is a piece as it is.
pub const SHORTEST: usize = 200;
/// Poses between the starts of windows.
pub const STRIDE: usize = 32;
/// False alarms per log that detection is measured at.
const FALSE_ALARMS: f64 = 0.05;

/// One row on one fault in one set.
#[derive(Clone, Debug, Serialize)]
pub struct LogCell {
    /// Letter of the set.
    pub set: char,
    /// The fault with its severity; none for the sound pieces.
    pub fault: Option<String>,
    /// Key of the row.
    pub method: &'static str,
    /// Pieces judged.
    pub pieces: usize,
    /// Share of pieces called OOD.
    pub called_ood: f64,
    /// Share of pieces whose highest window score is beyond that of nearly all sound pieces.
    pub detected: f64,
    /// Median number of poses from the onset to the end of the first window beyond the window
    /// threshold that holds a faulty step; none where more than half of the pieces have no such
    /// window.
    pub delay: Option<f64>,
}

/// Pieces of the `tested` logs.
pub fn pieces(logs: &[Trajectory], tested: &[usize]) -> Vec<Trajectory> {
    let mut pieces = Vec::new();
    for &log in tested {
        let t = &logs[log];
        let all = stretches(t, t.max_gap);
        let before = pieces.len();
        for stretch in &all {
            let starts = (stretch.start..stretch.end).step_by(PIECE);
            let whole = starts.filter(|start| start + PIECE <= stretch.end);
            pieces.extend(whole.map(|start| t.cut(start..start + PIECE)));
        }
        // A short log is one piece.
        let longest = all.into_iter().max_by_key(ExactSizeIterator::len);
        if let Some(stretch) = longest.filter(|s| s.len() >= SHORTEST && pieces.len() == before) {
            pieces.push(t.cut(stretch));
        }
    }
    pieces
}

/// Where the fault of a piece is.
pub fn fault_range(length: usize) -> Range<usize> {
    if length == PIECE {
        FAULT
    } else {
        length / 3..2 * length / 3
    }
}

/// Sound pieces with the statistics of their windows.
struct Sound<'a> {
    pieces: &'a [Trajectory],
    windows: Vec<Window>,
    rows: Rows,
}

/// One row of the table: its detector, and the highest window score of each sound piece.
struct Judge<'a> {
    method: usize,
    detector: &'a DetectorStatistics,
    highest: Reference,
}

/// All faults for the `methods` named.
///
/// # Errors
/// No piece, a failing network.
pub fn run(
    set: &LogSet,
    pieces: &[Trajectory],
    faults: &[Fault],
    methods: &[usize],
    context: &Context<'_>,
    prober: &mut Prober,
) -> Result<Vec<LogCell>> {
    let windows = cut_windows(pieces, prober.poses, STRIDE);
    let sound = Sound {
        rows: prober.rows(pieces, &windows, methods, context.tick)?,
        windows,
        pieces,
    };
    let mut cells = Vec::new();
    let mut judges = Vec::new();
    for &method in methods {
        let detector = &context.detectors[method];
        let scores = detector.window_scores(&sound.rows[method])?;
        let of_piece = by_piece(&sound.windows, &scores, pieces.len());
        let judge = Judge {
            method,
            detector,
            highest: Reference::new(of_piece.iter().map(|s| highest(s)).collect())
                .context("no log is long enough for a piece")?,
        };
        cells.push(judge.cell(set, None, &sound.windows, &sound.rows, &[])?);
        judges.push(judge);
    }
    for fault in faults {
        let inject = |(i, piece): (usize, &Trajectory)| {
            let seed = context.seed.wrapping_mul(1_000_033).wrapping_add(i as u64);
            fault.inject(piece, fault_range(piece.len()), seed)
        };
        let injections = pieces.iter().enumerate().map(inject);
        let injections = injections.collect::<Result<Vec<_>, _>>()?;
        let (windows, rows) = sound.with(&injections, methods, context, prober)?;
        for judge in &judges {
            cells.push(judge.cell(set, Some(fault.label()), &windows, &rows, &injections)?);
        }
    }
    Ok(cells)
}

impl Sound<'_> {
    /// Windows and statistics of faulty pieces. Windows without a faulty step move as they did, so
    /// theirs are taken from the sound piece, unless the fault changed the number of poses.
    fn with(
        &self,
        injections: &[Injection],
        methods: &[usize],
        context: &Context<'_>,
        prober: &mut Prober,
    ) -> Result<(Vec<Window>, Rows)> {
        let faulty: Vec<Trajectory> = injections.iter().map(|i| i.trajectory.clone()).collect();
        let windows = cut_windows(&faulty, prober.poses, STRIDE);
        let known: Vec<Option<usize>> = windows
            .iter()
            .map(|w| {
                let same_poses = faulty[w.trajectory].len() == self.pieces[w.trajectory].len();
                let sound = faulty_steps(&injections[w.trajectory].affected, w) == 0;
                let position = || self.windows.iter().position(|s| s == w);
                (same_poses && sound).then(position).flatten()
            })
            .collect();
        let fresh: Vec<Window> = windows
            .iter()
            .zip(&known)
            .filter(|(_, known)| known.is_none())
            .map(|(w, _)| *w)
            .collect();
        let computed = prober.rows(&faulty, &fresh, methods, context.tick)?;
        let mut rows: Rows = vec![Vec::new(); METHODS.len()];
        for &method in methods {
            let mut computed = computed[method].iter();
            let row = known.iter().map(|known| match known {
                Some(index) => self.rows[method].get(*index),
                None => computed.next(),
            });
            rows[method] = row.map(|row| row.cloned().unwrap_or_default()).collect();
        }
        Ok((windows, rows))
    }
}

impl Judge<'_> {
    /// Judges all pieces; `injections` is empty for the sound ones.
    fn cell(
        &self,
        set: &LogSet,
        fault: Option<String>,
        windows: &[Window],
        rows: &Rows,
        injections: &[Injection],
    ) -> Result<LogCell> {
        let pieces = self.highest.len();
        let window_threshold = self.detector.calibration().threshold;
        let of_piece = by_piece(windows, &rows[self.method], pieces);
        let windows = by_piece(windows, windows, pieces);
        let (mut ood, mut detected, mut delays) = (0, 0, Vec::new());
        for (piece, rows) in of_piece.iter().enumerate() {
            // A piece lies in one gap-free stretch.
            let verdict = self.detector.judge(rows, &vec![0; rows.len()])?;
            ood += usize::from(verdict.verdict.is_ood());
            let scores = &verdict.window_scores;
            detected += usize::from(highest(scores) > self.highest.threshold(FALSE_ALARMS));
            if let Some(injection) = injections.get(piece) {
                delays.push(delay(
                    &windows[piece],
                    scores,
                    window_threshold,
                    &injection.affected,
                ));
            }
        }
        Ok(LogCell {
            set: set.letter,
            fault,
            method: METHODS[self.method].key,
            pieces,
            called_ood: ood as f64 / pieces as f64,
            detected: detected as f64 / pieces as f64,
            delay: median(delays),
        })
    }
}

/// Poses from the first faulty step to the end of the first window beyond the threshold that holds
/// one; none where no such window is.
fn delay(
    windows: &[Window],
    scores: &[Score],
    threshold: Score,
    affected: &Range<usize>,
) -> Option<usize> {
    let mut found = windows.iter().zip(scores);
    let (window, _) = found.find(|(w, s)| **s > threshold && faulty_steps(affected, w) > 0)?;
    Some((window.start + window.length - 1).saturating_sub(affected.start))
}

/// Median, none counted as infinite; none where that is infinite.
fn median(delays: Vec<Option<usize>>) -> Option<f64> {
    let missing = usize::MAX;
    let mut delays: Vec<usize> = delays.into_iter().map(|d| d.unwrap_or(missing)).collect();
    delays.sort_unstable();
    let middle = delays.len().checked_sub(1)?;
    let (low, high) = (delays[middle / 2], delays[middle.div_ceil(2)]);
    (high != missing).then(|| (low + high) as f64 / 2.0)
}

fn highest(scores: &[Score]) -> Score {
    let lowest = Score::new(f64::NEG_INFINITY);
    scores.iter().copied().max().unwrap_or(lowest)
}

/// What belongs to each piece, in order.
fn by_piece<T: Clone>(windows: &[Window], values: &[T], pieces: usize) -> Vec<Vec<T>> {
    let mut of_piece = vec![Vec::new(); pieces];
    for (window, value) in windows.iter().zip(values) {
        of_piece[window.trajectory].push(value.clone());
    }
    of_piece
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_datasets::synthetic::{Platform, trajectory};

    #[test]
    fn pieces_by_hand() {
        let logs = [150, 600, 2500].map(|poses| trajectory(Platform::Drone, 2, poses, 10.0));
        let found = pieces(&logs, &[0, 1, 2]);
        let lengths: Vec<usize> = found.iter().map(Trajectory::len).collect();
        assert_eq!(lengths, [600, PIECE, PIECE]);
        assert_eq!(found[2].poses[0], logs[2].poses[PIECE]);
        assert_eq!(fault_range(PIECE), 400..500);
        assert_eq!(fault_range(600), 200..400);
    }

    #[test]
    fn delay_by_hand() {
        let windows: Vec<Window> = (0..4)
            .map(|i| Window {
                trajectory: 0,
                start: 32 * i,
                length: 129,
            })
            .collect();
        let scores = [9.0, 1.0, 3.0, 4.0].map(Score::new);
        let at = |threshold| delay(&windows, &scores, Score::new(threshold), &(150..200));
        // The first window ends at pose 128, before the fault: its alarm is not one of the fault's.
        // The third ends at pose 192.
        assert_eq!(at(2.0), Some(42));
        assert_eq!(at(3.5), Some(74));
        assert_eq!(at(5.0), None);
        assert_eq!(at(0.0), Some(10));
    }

    #[test]
    fn missed_faults_count_in_the_median() {
        assert_eq!(median(vec![Some(10), None, Some(30)]), Some(30.0));
        assert_eq!(median(vec![Some(10), Some(30)]), Some(20.0));
        assert_eq!(median(vec![Some(10), None]), None);
        assert_eq!(median(vec![None, None, Some(1)]), None);
        assert_eq!(median(vec![]), None);
    }
}
