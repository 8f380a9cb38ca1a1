//! Why a stretch of a log is unlike the trusted ones, in words: which plain quantities leave the range that they have
//! in trusted windows, and what no sensor that measures ever shows.

mod candidate;
mod coupling;
mod deviation;
mod exact;
mod jump;
mod select;
mod words;

use crate::detector::Detector;
use crate::error::Result;
use crate::report::{Place, Reason, Report};
use crate::series::{Motion, TrustedRanges};
use candidate::{Candidate, Stretch};
use dose3_datasets::{Trajectory, stretches};
use dose3_ood::statistics::LinearPredictor;
use std::ops::Range;

/// Most reasons of a stretch.
const MOST: usize = 3;
/// Poses beside a segment that are read with it: the quantities of a pose look at its neighbours.
const MARGIN: usize = 16;

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
        let from = poses.start.saturating_sub(MARGIN).max(stretch.start);
        let to = (poses.end + MARGIN).min(stretch.end);
        let within = windows
            .iter()
            .filter(|w| w.start >= poses.start && w.end <= poses.end);
        let shift = |range: &Range<usize>| range.start - from..range.end - from;
        let within: Vec<Range<usize>> = within.map(shift).collect();
        let found = reasons(detector, ranges, log, from..to, &shift(&poses), &within)?;
        let place = |c: &Candidate| Place::new(log, c.poses.start + from, c.poses.end - 1 + from);
        let reason = |candidate: Candidate| {
            let place = place(&candidate);
            candidate.reason(place)
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
    let found = candidates(&Stretch {
        motion: &motion,
        ranges,
        all: &log.poses,
        poses: all.clone(),
        windows: std::slice::from_ref(&all),
        named: log.frame.has_forward(),
        hertz,
    });
    let reason = |candidate: Candidate| {
        let place = Place::new(log, candidate.poses.start, candidate.poses.end - 1);
        candidate.reason(place)
    };
    let found = select::strongest(found, MOST);
    Ok(found.into_iter().map(reason).collect())
}

/// All that can be said without the calibration.
fn candidates(stretch: &Stretch<'_>) -> Vec<Candidate> {
    let mut found = exact::candidates(stretch);
    found.extend(jump::candidates(stretch));
    found.extend(deviation::candidates(stretch));
    found
}

/// Of the poses `read` of a log, of which `poses` (counted from the first one read) are to be explained.
fn reasons(
    detector: &Detector,
    ranges: &TrustedRanges,
    log: &Trajectory,
    read: Range<usize>,
    poses: &Range<usize>,
    windows: &[Range<usize>],
) -> Result<Vec<Candidate>> {
    let (all, hertz) = (&log.poses[read], log.rate.hertz);
    let motion = Motion::new(all, log.frame, hertz, detector.linear())?;
    let stretch = Stretch {
        motion: &motion,
        ranges,
        all,
        poses: poses.clone(),
        windows,
        named: log.frame.has_forward(),
        hertz,
    };
    let mut found = candidates(&stretch);
    if let Some(reference) = &detector.header().whole.calibration {
        found.extend(coupling::candidate(&stretch, log.frame, reference)?);
    }
    Ok(select::strongest(found, MOST))
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
