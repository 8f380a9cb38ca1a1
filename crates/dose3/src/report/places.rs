//! Where in a log: windows, runs of windows, runs of poses.

use super::{PoseScores, Reason};
use dose3_datasets::{Trajectory, Window};
use dose3_ood::Score;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What is said of one window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WindowReport {
    /// Index of its first pose in the log as it was judged.
    pub first_pose: usize,
    /// Index of its last pose.
    pub last_pose: usize,
    /// Row of the first pose in the user's file.
    pub first_row: u64,
    /// Row of the last pose.
    pub last_row: u64,
    /// Stamp of the first pose, nanoseconds.
    pub first_stamp_ns: i64,
    /// Stamp of the last pose, nanoseconds.
    pub last_stamp_ns: i64,
    /// Minus the log-density of its statistics; higher is more out of distribution.
    pub score: Score,
    /// Share of held-out trusted windows with such a score or a higher one.
    pub p_value: f64,
    /// Whether the score is beyond the window threshold.
    pub beyond: bool,
}

/// A part of a log: as it was judged, and in the user's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Place {
    /// Its first pose in the log as it was judged.
    pub first_pose: usize,
    /// Its last pose.
    pub last_pose: usize,
    /// Row of the first pose in the file, counted as [`super::JudgedLog::row_kind`] says; of a resampled log the row
    /// nearest in time.
    pub first_row: u64,
    /// Row of the last pose.
    pub last_row: u64,
    /// Stamp of the first pose as the file has it; none where it has no stamps.
    pub first_stamp: Option<String>,
    /// Stamp of the last pose.
    pub last_stamp: Option<String>,
    /// Its start from the log's start, seconds.
    pub start_s: f64,
    /// Its end from the log's start, seconds.
    pub end_s: f64,
}

/// A run of overlapping windows beyond the threshold, or of the run that decided.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Segment {
    /// Where it is.
    #[serde(flatten)]
    pub place: Place,
    /// Highest window score of the run.
    pub worst_score: Score,
    /// Why it is unlike the trusted logs, the strongest reason first; none of detectors of format 3 and older.
    #[serde(default)]
    pub reasons: Vec<Reason>,
}

/// A run of poses that stick out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PoseSpan {
    /// Where it is.
    #[serde(flatten)]
    pub place: Place,
    /// The pose that sticks out most.
    pub worst_pose: usize,
    /// Its score: 1 is what one trusted pose in a thousand reaches.
    pub worst_score: Score,
}

impl WindowReport {
    pub(super) fn new(
        window: &Window,
        log: &Trajectory,
        (score, p_value): (Score, f64),
        threshold: Score,
    ) -> Self {
        let (first, last) = (window.start, window.start + window.length - 1);
        Self {
            first_pose: first,
            last_pose: last,
            first_row: log.rows[first],
            last_row: log.rows[last],
            first_stamp_ns: log.stamps[first],
            last_stamp_ns: log.stamps[last],
            score,
            p_value,
            beyond: score > threshold,
        }
    }
}

impl Place {
    pub(crate) fn new(log: &Trajectory, first_pose: usize, last_pose: usize) -> Self {
        let start = log.stamps.first().copied().unwrap_or_default();
        let seconds = |pose: usize| log.stamps[pose].saturating_sub(start) as f64 * 1e-9;
        Self {
            first_pose,
            last_pose,
            first_row: log.rows[first_pose],
            last_row: log.rows[last_pose],
            first_stamp: log.stamp_in_file(first_pose),
            last_stamp: log.stamp_in_file(last_pose),
            start_s: seconds(first_pose),
            end_s: seconds(last_pose),
        }
    }
}

/// Of the windows beyond the threshold, and of those of the run that decided.
pub(super) fn segments(
    log: &Trajectory,
    windows: &[WindowReport],
    decided: Range<usize>,
) -> Vec<Segment> {
    let mut runs: Vec<(usize, usize, Score)> = Vec::new();
    let shown = |(i, w): &(usize, &WindowReport)| w.beyond || decided.contains(i);
    for (_, w) in windows.iter().enumerate().filter(shown) {
        match runs.last_mut() {
            Some((_, last, worst)) if w.first_pose <= *last => {
                (*last, *worst) = (w.last_pose, w.score.max(*worst));
            }
            _ => runs.push((w.first_pose, w.last_pose, w.score)),
        }
    }
    let segment = |(first, last, worst_score)| Segment {
        place: Place::new(log, first, last),
        worst_score,
        reasons: Vec::new(),
    };
    runs.into_iter().map(segment).collect()
}

/// Windows in order of their poses.
pub(super) fn window_of_each_pose(windows: &[WindowReport], poses: usize) -> Vec<Option<usize>> {
    let mut of: Vec<Option<usize>> = vec![None; poses];
    // Twice the distance from the middle of a window.
    let distance = |w: usize, pose: usize| {
        let window = &windows[w];
        (window.first_pose + window.last_pose).abs_diff(2 * pose)
    };
    for (index, window) in windows.iter().enumerate() {
        let within = of.iter_mut().enumerate().take(window.last_pose + 1);
        for (pose, of) in within.skip(window.first_pose) {
            if of.is_none_or(|other| distance(index, pose) < distance(other, pose)) {
                *of = Some(index);
            }
        }
    }
    of
}

/// Poses apart by no more than this are one run.
const SPAN_GAP: usize = 4;

pub(super) fn pose_spans(
    log: &Trajectory,
    segments: &[Segment],
    poses: &PoseScores,
) -> Vec<PoseSpan> {
    let Some(threshold) = poses.threshold else {
        return Vec::new();
    };
    // First and last pose, and the worst one with its score.
    let mut runs: Vec<(usize, usize, usize, Score)> = Vec::new();
    for segment in segments {
        let mut last: Option<usize> = None;
        let within = segment.place.first_pose..=segment.place.last_pose;
        for pose in within {
            let Some(score) = poses.scores[pose].filter(|s| *s > threshold) else {
                continue;
            };
            match (last, runs.last_mut()) {
                (Some(before), Some(run)) if pose - before <= SPAN_GAP => {
                    run.1 = pose;
                    if score > run.3 {
                        (run.2, run.3) = (pose, score);
                    }
                }
                _ => runs.push((pose, pose, pose, score)),
            }
            last = Some(pose);
        }
    }
    let span = |(first, last, worst_pose, worst_score)| PoseSpan {
        place: Place::new(log, first, last),
        worst_pose,
        worst_score,
    };
    let mut spans: Vec<PoseSpan> = runs.into_iter().map(span).collect();
    spans.sort_by_key(|span| std::cmp::Reverse(span.worst_score));
    spans
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_datasets::synthetic;

    #[test]
    fn overlapping_windows_are_one_segment_and_near_poses_one_span() {
        let log = synthetic::trajectory(synthetic::Platform::Vehicle, 1, 100, 10.0);
        let window = |start, score| {
            let window = Window {
                trajectory: 0,
                start,
                length: 20,
            };
            WindowReport::new(&window, &log, (Score::new(score), 0.5), Score::new(1.0))
        };
        let windows = [
            window(0, 0.5),
            window(10, 2.0),
            window(20, 3.0),
            window(60, 1.5),
        ];
        let found = segments(&log, &windows, 0..0);
        assert_eq!(found.len(), 2);
        let first = &found[0].place;
        assert_eq!((first.first_pose, first.last_pose), (10, 39));
        assert!((first.start_s - 1.0).abs() < 1e-12 && (first.end_s - 3.9).abs() < 1e-12);
        assert_eq!((first.first_row, first.last_row), (10, 39));
        assert_eq!(found[0].worst_score, Score::new(3.0));
        let mut poses = PoseScores {
            threshold: Some(Score::new(1.0)),
            scores: vec![Some(Score::new(0.0)); 100],
        };
        for (pose, score) in [(5, 9.0), (12, 1.5), (16, 2.0), (22, 1.2), (61, 4.0)] {
            poses.scores[pose] = Some(Score::new(score));
        }
        let spans = pose_spans(&log, &found, &poses);
        let all: Vec<_> = spans
            .iter()
            .map(|s| (s.place.first_pose, s.place.last_pose, s.worst_pose))
            .collect();
        // Pose 5 lies in no segment; 16 and 22 are more than four apart.
        assert_eq!(all, [(61, 61, 61), (12, 16, 16), (22, 22, 22)]);
        let of = window_of_each_pose(&windows, 100);
        let at = |pose: usize| of[pose];
        assert_eq!(
            (at(0), at(14), at(15), at(24), at(25)),
            (Some(0), Some(0), Some(1), Some(1), Some(2))
        );
        assert_eq!(
            (at(39), at(40), at(60), at(79), at(80)),
            (Some(2), None, Some(3), Some(3), None)
        );
        // A run that decided is shown, whatever the threshold.
        let decided = segments(&log, &windows, 0..2);
        assert_eq!((decided.len(), decided[0].place.first_pose), (2, 0));
        poses.threshold = None;
        assert!(pose_spans(&log, &found, &poses).is_empty());
    }
}
