//! Where in a log: windows, runs of windows, runs of poses.

use super::PoseScores;
use dose3_datasets::Window;
use dose3_ood::Score;
use serde::{Deserialize, Serialize};

/// What is said of one window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowReport {
    /// Index of its first pose in the log as it was judged.
    pub first_pose: usize,
    /// Index of its last pose.
    pub last_pose: usize,
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

/// A run of overlapping windows beyond the threshold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// First pose of the run.
    pub first_pose: usize,
    /// Last pose of the run.
    pub last_pose: usize,
    /// Start of the run from the log's start, seconds.
    pub start_s: f64,
    /// End of the run from the log's start, seconds.
    pub end_s: f64,
    /// Highest window score of the run.
    pub worst_score: Score,
}

/// A run of poses that stick out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseSpan {
    /// First pose of the run.
    pub first_pose: usize,
    /// Last pose of the run.
    pub last_pose: usize,
    /// Start of the run from the log's start, seconds.
    pub start_s: f64,
    /// End of the run from the log's start, seconds.
    pub end_s: f64,
    /// The pose that sticks out most.
    pub worst_pose: usize,
    /// Its score: 1 is what one trusted pose in a thousand reaches.
    pub worst_score: Score,
}

impl WindowReport {
    pub(super) fn new(
        window: &Window,
        stamps: &[i64],
        (score, p_value): (Score, f64),
        threshold: Score,
    ) -> Self {
        let (first, last) = (window.start, window.start + window.length - 1);
        Self {
            first_pose: first,
            last_pose: last,
            first_stamp_ns: stamps[first],
            last_stamp_ns: stamps[last],
            score,
            p_value,
            beyond: score > threshold,
        }
    }
}

/// Seconds from the first stamp.
fn seconds(stamps: &[i64], stamp: i64) -> f64 {
    stamp.saturating_sub(stamps.first().copied().unwrap_or_default()) as f64 * 1e-9
}

pub(super) fn segments(stamps: &[i64], windows: &[WindowReport]) -> Vec<Segment> {
    let mut segments: Vec<Segment> = Vec::new();
    for w in windows.iter().filter(|w| w.beyond) {
        match segments.last_mut() {
            Some(s) if w.first_pose <= s.last_pose => {
                s.last_pose = w.last_pose;
                s.end_s = seconds(stamps, w.last_stamp_ns);
                s.worst_score = s.worst_score.max(w.score);
            }
            _ => segments.push(Segment {
                first_pose: w.first_pose,
                last_pose: w.last_pose,
                start_s: seconds(stamps, w.first_stamp_ns),
                end_s: seconds(stamps, w.last_stamp_ns),
                worst_score: w.score,
            }),
        }
    }
    segments
}

/// Poses apart by no more than this are one run.
const SPAN_GAP: usize = 4;

pub(super) fn pose_spans(
    stamps: &[i64],
    segments: &[Segment],
    poses: &PoseScores,
) -> Vec<PoseSpan> {
    let Some(threshold) = poses.threshold else {
        return Vec::new();
    };
    let time = |pose: usize| seconds(stamps, stamps[pose]);
    let mut spans: Vec<PoseSpan> = Vec::new();
    for segment in segments {
        let mut last: Option<usize> = None;
        let scores = poses.scores.iter().enumerate().take(segment.last_pose + 1);
        for (pose, score) in scores.skip(segment.first_pose) {
            let Some(score) = score.filter(|s| *s > threshold) else {
                continue;
            };
            match (last, spans.last_mut()) {
                (Some(last), Some(span)) if pose - last <= SPAN_GAP => {
                    span.last_pose = pose;
                    span.end_s = time(pose);
                    if score > span.worst_score {
                        (span.worst_pose, span.worst_score) = (pose, score);
                    }
                }
                _ => spans.push(PoseSpan {
                    first_pose: pose,
                    last_pose: pose,
                    start_s: time(pose),
                    end_s: time(pose),
                    worst_pose: pose,
                    worst_score: score,
                }),
            }
            last = Some(pose);
        }
    }
    spans.sort_by_key(|span| std::cmp::Reverse(span.worst_score));
    spans
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlapping_windows_are_one_segment_and_near_poses_one_span() {
        let stamps: Vec<i64> = (0..100).map(|i| 5_000 + i * 100_000_000).collect();
        let window = |start, score| {
            let window = Window {
                trajectory: 0,
                start,
                length: 20,
            };
            WindowReport::new(&window, &stamps, (Score::new(score), 0.5), Score::new(1.0))
        };
        let windows = [
            window(0, 0.5),
            window(10, 2.0),
            window(20, 3.0),
            window(60, 1.5),
        ];
        let found = segments(&stamps, &windows);
        assert_eq!(found.len(), 2);
        let first = &found[0];
        assert_eq!((first.first_pose, first.last_pose), (10, 39));
        assert!((first.start_s - 1.0).abs() < 1e-12 && (first.end_s - 3.9).abs() < 1e-12);
        assert_eq!(first.worst_score, Score::new(3.0));
        let mut poses = PoseScores {
            threshold: Some(Score::new(1.0)),
            scores: vec![Some(Score::new(0.0)); 100],
        };
        for (pose, score) in [(5, 9.0), (12, 1.5), (16, 2.0), (22, 1.2), (61, 4.0)] {
            poses.scores[pose] = Some(Score::new(score));
        }
        let spans = pose_spans(&stamps, &found, &poses);
        let all: Vec<_> = spans
            .iter()
            .map(|s| (s.first_pose, s.last_pose, s.worst_pose))
            .collect();
        // Pose 5 lies in no segment; 16 and 22 are more than four apart.
        assert_eq!(all, [(61, 61, 61), (12, 16, 16), (22, 22, 22)]);
        poses.threshold = None;
        assert!(pose_spans(&stamps, &found, &poses).is_empty());
    }
}
