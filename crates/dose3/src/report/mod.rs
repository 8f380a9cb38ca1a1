//! What is said of a log: the verdict, what it rests on, where in the log, and why.

mod places;
mod reason;
mod text;

pub(crate) use text::rows;

pub use places::{Place, PoseSpan, Segment, WindowReport};
pub use reason::{Reason, ReasonAxis, ReasonKind};

use crate::detector::WholeFindings;
use crate::error::{Error, Result};
use dose3_datasets::{RateSource, RowKind, Trajectory, Window};
use dose3_ood::detector::{Contribution, LogVerdict, TestVerdict};
use dose3_ood::{Score, Verdict};
use serde::{Deserialize, Serialize};

/// What is said of one log. As text (`Display`) a summary in plain words; as JSON everything, and back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Report {
    /// The log.
    pub log: JudgedLog,
    /// The verdict in one word.
    pub verdict: Verdict,
    /// The numbers that it rests on. Scores of windows stand in [`windows`](Self::windows), contributions in
    /// [`contributions`](Self::contributions), notes in [`notes`](Self::notes).
    pub evidence: LogVerdict,
    /// Where: runs of overlapping windows beyond the threshold, and the run that decided where the log differs.
    pub segments: Vec<Segment>,
    /// Runs of poses beyond the pose threshold within these segments, the worst first.
    pub pose_spans: Vec<PoseSpan>,
    /// What the log shows as a whole: its stamps, its calibration.
    pub whole: WholeFindings,
    /// Why, in words: the strongest reasons of all segments, at most three. Each segment has its own.
    #[serde(default)]
    pub reasons: Vec<Reason>,
    /// Which groups of statistics drove the scores, the strongest first.
    pub contributions: Vec<Contribution>,
    /// What the user should know, in sentences.
    pub notes: Vec<String>,
    /// Every window, in order.
    pub windows: Vec<WindowReport>,
    /// Scores of single poses.
    pub poses: PoseScores,
}

impl Report {
    /// The report in its JSON, checked: as text it shows the test that decided and the windows of its run.
    ///
    /// # Errors
    /// [`Error::Unsound`] for other JSON, and for a report that names a test or a window which it does not have.
    pub fn from_json(text: &str) -> Result<Self> {
        let unsound = |reason: String| Error::Unsound {
            what: "report",
            reason,
        };
        let report: Self = serde_json::from_str(text).map_err(|e| unsound(e.to_string()))?;
        let (tests, windows) = (&report.evidence.tests, report.windows.len());
        let decided_by = report.evidence.decided_by;
        if decided_by >= tests.len() {
            let found = format!("test {decided_by} decided, of {}", tests.len());
            return Err(unsound(found));
        }
        let runs = tests.iter().filter_map(TestVerdict::run);
        match runs
            .into_iter()
            .find(|run| run.first > run.last || run.last >= windows)
        {
            Some(run) => Err(unsound(format!(
                "windows {} to {} stick out, of {windows}",
                run.first, run.last
            ))),
            None => Ok(report),
        }
    }
}

/// What a report says of the log itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct JudgedLog {
    /// Its name.
    pub name: String,
    /// Its file; empty for poses that were in memory.
    pub path: String,
    /// Poses judged.
    pub poses: usize,
    /// What rows of the file count.
    pub row_kind: RowKind,
    /// Whether its axes are known to be forward, left and up.
    pub named_axes: bool,
    /// Rate of the log as judged, hertz.
    pub rate_hz: f64,
    /// Whether that rate is the data set's nominal one, because the file has no stamps.
    pub rate_is_nominal: bool,
}

impl From<&Trajectory> for JudgedLog {
    fn from(log: &Trajectory) -> Self {
        Self {
            name: log.name.clone(),
            path: log.path.display().to_string(),
            poses: log.len(),
            row_kind: log.row_kind,
            named_axes: log.frame.has_forward(),
            rate_hz: log.rate.hertz,
            rate_is_nominal: log.rate.source == RateSource::Nominal,
        }
    }
}

/// How much single poses stick out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PoseScores {
    /// Score beyond which one in a thousand trusted poses is; none in detectors of format 1.
    pub threshold: Option<Score>,
    /// Score of every pose as judged; none where no window reaches. Not written to files.
    #[serde(skip)]
    pub scores: Vec<Option<Score>>,
}

impl Report {
    pub(crate) fn new(
        log: &Trajectory,
        windows: &[Window],
        mut evidence: LogVerdict,
        whole: WholeFindings,
        poses: PoseScores,
        mut notes: Vec<String>,
    ) -> Self {
        let scores = std::mem::take(&mut evidence.window_scores);
        let p_values = std::mem::take(&mut evidence.window_p_values);
        let windows: Vec<WindowReport> = windows
            .iter()
            .zip(scores.into_iter().zip(p_values))
            .map(|(window, said)| WindowReport::new(window, log, said, evidence.threshold))
            .collect();
        notes.append(&mut evidence.notes);
        let decided = evidence.run().filter(|_| evidence.verdict.differs());
        let decided = decided.map_or(0..0, |run| run.first..run.last + 1);
        let segments = places::segments(log, &windows, decided);
        Self {
            pose_spans: places::pose_spans(log, &segments, &poses),
            segments,
            reasons: Vec::new(),
            contributions: std::mem::take(&mut evidence.contributions),
            verdict: evidence.verdict,
            log: JudgedLog::from(log),
            evidence,
            whole,
            notes,
            windows,
            poses,
        }
    }

    /// For each pose as judged the index of the window in whose middle it lies most; none where no window reaches. For
    /// drawings: a pose is coloured as that window.
    #[must_use]
    pub fn window_of_each_pose(&self) -> Vec<Option<usize>> {
        places::window_of_each_pose(&self.windows, self.log.poses)
    }

    /// Whether the log is out of distribution.
    #[must_use]
    pub fn is_ood(&self) -> bool {
        self.verdict.is_ood()
    }
}
