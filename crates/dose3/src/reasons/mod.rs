//! Why a stretch of a log is unlike the trusted ones, in words: which plain quantities leave the range that they have
//! in trusted windows.

mod deviation;
mod words;

use crate::detector::Detector;
use crate::error::Result;
use crate::report::{Place, Reason, Report};
use crate::series::{Motion, TrustedRanges};
use deviation::Deviation;
use dose3_datasets::{Trajectory, stretches};
use dose3_ood::statistics::LinearPredictor;
use std::ops::Range;

/// Most reasons of a stretch.
const MOST: usize = 3;

/// Fills in why each segment of `report` is unlike the trusted logs; `log` is the log as it was judged.
pub(crate) fn explain(detector: &Detector, log: &Trajectory, report: &mut Report) -> Result<()> {
    let Some(ranges) = &detector.header().ranges else {
        return Ok(());
    };
    let all = stretches(log, log.max_gap);
    let windows: Vec<Range<usize>> = report
        .windows
        .iter()
        .map(|window| window.first_pose..window.last_pose + 1)
        .collect();
    for segment in &mut report.segments {
        let poses = segment.place.first_pose..segment.place.last_pose + 1;
        // A segment lies in one stretch.
        let Some(stretch) = all.iter().find(|s| s.contains(&poses.start)) else {
            continue;
        };
        // Some poses more on both sides: the quantities of a pose look at its neighbours.
        let from = poses.start.saturating_sub(MARGIN).max(stretch.start);
        let to = (poses.end + MARGIN).min(stretch.end);
        let motion = Motion::new(
            &log.poses[from..to],
            log.frame,
            log.rate.hertz,
            detector.linear(),
        )?;
        let shift = |range: Range<usize>| range.start - from..range.end - from;
        let within: Vec<Range<usize>> = windows
            .iter()
            .filter(|w| w.start >= poses.start && w.end <= poses.end)
            .map(|w| shift(w.clone()))
            .collect();
        let found = strongest(&motion, ranges, &shift(poses), &within);
        let named = log.frame.has_forward();
        let reason = |deviation: Deviation| {
            let (first, last) = (deviation.poses.start + from, deviation.poses.end - 1 + from);
            deviation.reason(Place::new(log, first, last), named)
        };
        segment.reasons = found.into_iter().map(reason).collect();
    }
    report.reasons = overall(report);
    Ok(())
}

/// Why one window, all poses of `log`, is unlike the trusted ones, the strongest first.
pub(crate) fn of_window(
    log: &Trajectory,
    hertz: f64,
    linear: Option<&LinearPredictor>,
    ranges: &TrustedRanges,
) -> Result<Vec<Reason>> {
    let motion = Motion::new(&log.poses, log.frame, hertz, linear)?;
    let all = 0..log.len();
    let found = strongest(&motion, ranges, &all, std::slice::from_ref(&all));
    let reason = |deviation: Deviation| {
        let (first, last) = (deviation.poses.start, deviation.poses.end - 1);
        deviation.reason(Place::new(log, first, last), log.frame.has_forward())
    };
    Ok(found.into_iter().map(reason).collect())
}

/// Poses beside a segment that are looked at with it.
const MARGIN: usize = 16;

fn strongest(
    motion: &Motion,
    ranges: &TrustedRanges,
    poses: &Range<usize>,
    windows: &[Range<usize>],
) -> Vec<Deviation> {
    let mut found: Vec<Deviation> = ranges
        .iter()
        .flat_map(|(quantity, range)| {
            let column = motion.column(quantity);
            Deviation::of(quantity, &column, poses, windows, range)
        })
        .collect();
    found.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    let mut kept: Vec<Deviation> = Vec::new();
    for deviation in found {
        if kept.len() < MOST && !kept.iter().any(|other| other.same_axis(&deviation)) {
            kept.push(deviation);
        }
    }
    kept
}

/// The strongest reasons of all segments, one of each kind and axis.
fn overall(report: &Report) -> Vec<Reason> {
    let mut all: Vec<&Reason> = report.segments.iter().flat_map(|s| &s.reasons).collect();
    all.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    let mut kept: Vec<Reason> = Vec::new();
    for reason in all {
        let said = |other: &Reason| (other.kind, other.axis) == (reason.kind, reason.axis);
        if kept.len() < MOST && !kept.iter().any(said) {
            kept.push(reason.clone());
        }
    }
    kept
}
