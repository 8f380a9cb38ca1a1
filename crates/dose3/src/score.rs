//! Scoring: what a detector says of a log.

use crate::backend::{Backend, Computing};
use crate::detector_file::Detector;
use crate::error::{Error, Result};
use crate::logs::conform;
use crate::probe::Probe;
use dose3_datasets::{RateSource, Trajectory, Window, stretch_numbers, windows_of_each};
use dose3_ood::detector::{Basis, Contribution, LogVerdict, TestVerdict};
use dose3_ood::{PoseReference, Score, Verdict};
use serde::Serialize;

/// A detector with its networks loaded.
pub struct Judge {
    detector: Detector,
    probe: Probe,
}

/// What is said of one window.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
#[derive(Clone, Debug, PartialEq, Serialize)]
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
#[derive(Clone, Debug, PartialEq, Serialize)]
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

/// What is said of one log.
#[derive(Clone, Debug, Serialize)]
pub struct LogReport {
    /// The log's name.
    pub log: String,
    /// Its file.
    pub path: String,
    /// `in_distribution` or `out_of_distribution`; beside one trusted log `like` or `unlike`.
    pub verdict: &'static str,
    /// Poses judged.
    pub poses: usize,
    /// Rate of the log as judged, hertz.
    pub rate_hz: f64,
    /// Whether that rate is the data set's nominal one, because the file has no stamps.
    pub rate_is_nominal: bool,
    /// The share of trusted logs that may be rejected.
    pub alpha: f64,
    /// Chance that a log like the trusted ones is so unusual.
    pub p_value: f64,
    /// Index of the test that decided.
    pub decided_by: usize,
    /// What each test says.
    pub tests: Vec<TestVerdict>,
    /// What the chance rests on.
    pub basis: Basis,
    /// How far the log is: 0 is a usual run of trusted windows, 1 a trusted extreme.
    pub excess: f64,
    /// Mean window score.
    pub mean_score: Score,
    /// Window threshold.
    pub threshold: Score,
    /// Number of windows.
    pub windows: usize,
    /// Number of windows beyond the threshold.
    pub beyond: usize,
    /// Where in the log.
    pub segments: Vec<Segment>,
    /// Runs of poses beyond the pose threshold within these segments, the worst first.
    pub pose_spans: Vec<PoseSpan>,
    /// Score beyond which one in a thousand trusted poses is; none in detectors of format 1.
    pub pose_threshold: Option<Score>,
    /// Score of every pose; none where no window reaches.
    #[serde(skip)]
    pub pose_scores: Vec<Option<Score>>,
    /// Which groups of statistics drove it, the strongest first.
    pub groups: Vec<Contribution>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// Every window.
    pub window_reports: Vec<WindowReport>,
}

impl LogReport {
    /// Whether the log is out of distribution.
    pub fn is_ood(&self) -> bool {
        self.verdict == "out_of_distribution"
    }
}

impl Judge {
    /// Loads the detector's networks.
    ///
    /// # Errors
    /// A backend that cannot be had.
    pub fn new(detector: Detector, backend: Backend, threads: usize) -> Result<Self> {
        let set = &detector.header.statistics.config().statistics;
        let computing = Computing { backend, threads };
        Ok(Self {
            probe: Probe::for_sets(&detector.model, &detector.header.probe, [set], computing)?,
            detector,
        })
    }

    /// The detector.
    pub fn detector(&self) -> &Detector {
        &self.detector
    }

    /// Judges one log. `alpha` defaults to the detector's; the windows lie as they did when it was
    /// fitted, because its calibration knows how much they overlap.
    ///
    /// # Errors
    /// A log that does not fit the detector or is shorter than a window.
    pub fn judge(
        &mut self,
        log: Trajectory,
        alpha: Option<f64>,
        progress: &dyn Fn(usize, usize),
    ) -> Result<LogReport> {
        let Measured {
            log,
            windows,
            rows,
            pose_scores,
            mut notes,
        } = self.statistics(log, progress)?;
        let statistics = &self.detector.header.statistics;
        let alpha = alpha.unwrap_or(statistics.config().alpha);
        let stretches = stretch_numbers(&windows, self.detector.header.stride);
        let verdict = statistics.judge_with(&rows, &stretches, &[], alpha)?;
        notes.extend(log.report.lines());
        let threshold = self.detector.header.poses.as_ref();
        let poses = (pose_scores, threshold.map(PoseReference::threshold));
        Ok(report(&log, &windows, verdict, poses, notes))
    }

    fn statistics(&mut self, log: Trajectory, progress: &dyn Fn(usize, usize)) -> Result<Measured> {
        let header = &self.detector.header;
        let (log, notes) = conform(log, &header.needs)?;
        let logs = std::slice::from_ref(&log);
        let windows = windows_of_each(logs, self.probe.poses(), header.stride)?;
        let set = &header.statistics.config().statistics;
        let total = windows.len();
        let mut rows = Vec::with_capacity(total);
        let mut pose_scores = vec![None; log.poses.len()];
        self.probe.measure(logs, &windows, |window| {
            rows.push(window.row(set)?);
            if let Some(reference) = &header.poses {
                for (pose, numbers) in window.poses()? {
                    pose_scores[pose] = Some(reference.score(&numbers)?);
                }
            }
            progress(window.index + 1, total);
            Ok::<(), Error>(())
        })?;
        Ok(Measured {
            log,
            windows,
            rows,
            pose_scores,
            notes,
        })
    }
}

/// A log as it was judged, with the statistics of its windows.
struct Measured {
    log: Trajectory,
    windows: Vec<Window>,
    rows: Vec<Vec<f64>>,
    pose_scores: Vec<Option<Score>>,
    notes: Vec<String>,
}

fn report(
    log: &Trajectory,
    windows: &[Window],
    verdict: LogVerdict,
    (pose_scores, pose_threshold): (Vec<Option<Score>>, Option<Score>),
    mut notes: Vec<String>,
) -> LogReport {
    let window_reports: Vec<WindowReport> = windows
        .iter()
        .zip(verdict.window_scores.iter().zip(&verdict.window_p_values))
        .map(|(w, (score, p))| {
            let (first, last) = (w.start, w.start + w.length - 1);
            WindowReport {
                first_pose: first,
                last_pose: last,
                first_stamp_ns: log.stamps[first],
                last_stamp_ns: log.stamps[last],
                score: *score,
                p_value: *p,
                beyond: *score > verdict.threshold,
            }
        })
        .collect();
    notes.extend(verdict.notes);
    let segments = segments(log, &window_reports);
    let pose_spans = pose_threshold
        .map(|threshold| pose_spans(log, &segments, &pose_scores, threshold))
        .unwrap_or_default();
    LogReport {
        log: log.name.clone(),
        path: log.path.display().to_string(),
        verdict: match verdict.verdict {
            Verdict::InDistribution => "in_distribution",
            Verdict::OutOfDistribution => "out_of_distribution",
            Verdict::Like => "like",
            Verdict::Unlike => "unlike",
        },
        poses: log.poses.len(),
        rate_hz: log.rate.hertz,
        rate_is_nominal: log.rate.source == RateSource::Nominal,
        alpha: verdict.alpha,
        p_value: verdict.p_value,
        decided_by: verdict.decided_by,
        tests: verdict.tests,
        basis: verdict.basis,
        excess: verdict.excess,
        mean_score: verdict.mean_score,
        threshold: verdict.threshold,
        windows: verdict.windows,
        beyond: verdict.beyond,
        segments,
        pose_spans,
        pose_threshold,
        pose_scores,
        groups: verdict.contributions,
        notes,
        window_reports,
    }
}

fn segments(log: &Trajectory, windows: &[WindowReport]) -> Vec<Segment> {
    let start = log.stamps.first().copied().unwrap_or_default();
    let seconds = |stamp: i64| stamp.saturating_sub(start) as f64 * 1e-9;
    let mut segments: Vec<Segment> = Vec::new();
    for w in windows.iter().filter(|w| w.beyond) {
        match segments.last_mut() {
            Some(s) if w.first_pose <= s.last_pose => {
                s.last_pose = w.last_pose;
                s.end_s = seconds(w.last_stamp_ns);
                s.worst_score = s.worst_score.max(w.score);
            }
            _ => segments.push(Segment {
                first_pose: w.first_pose,
                last_pose: w.last_pose,
                start_s: seconds(w.first_stamp_ns),
                end_s: seconds(w.last_stamp_ns),
                worst_score: w.score,
            }),
        }
    }
    segments
}

/// Poses apart by no more than this are one run.
const SPAN_GAP: usize = 4;

fn pose_spans(
    log: &Trajectory,
    segments: &[Segment],
    scores: &[Option<Score>],
    threshold: Score,
) -> Vec<PoseSpan> {
    let start = log.stamps.first().copied().unwrap_or_default();
    let seconds = |pose: usize| log.stamps[pose].saturating_sub(start) as f64 * 1e-9;
    let mut spans: Vec<PoseSpan> = Vec::new();
    for segment in segments {
        let mut last: Option<usize> = None;
        let poses = scores.iter().enumerate().take(segment.last_pose + 1);
        for (pose, score) in poses.skip(segment.first_pose) {
            let Some(score) = score.filter(|s| *s > threshold) else {
                continue;
            };
            match (last, spans.last_mut()) {
                (Some(last), Some(span)) if pose - last <= SPAN_GAP => {
                    span.last_pose = pose;
                    span.end_s = seconds(pose);
                    if score > span.worst_score {
                        (span.worst_pose, span.worst_score) = (pose, score);
                    }
                }
                _ => spans.push(PoseSpan {
                    first_pose: pose,
                    last_pose: pose,
                    start_s: seconds(pose),
                    end_s: seconds(pose),
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
