//! One row of a table of results.

use crate::detector::Detector;
use crate::report::{Report, Segment};
use dose3_ood::Score;
use serde::{Deserialize, Serialize};

/// What made the results.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Versions {
    /// Version of this software.
    pub dose3_version: String,
    /// Version of the software that fitted the detector.
    pub detector_version: String,
}

impl Versions {
    /// This software and that of the detector.
    #[must_use]
    pub fn of(detector: &Detector) -> Self {
        Self {
            dose3_version: env!("CARGO_PKG_VERSION").to_owned(),
            detector_version: detector.header().version.clone(),
        }
    }
}

/// One log: what is said of it, or why nothing could be. Fields are columns of tables, in this order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the log; none where it could not be judged.
    pub log: Option<String>,
    /// Its file as it was named; empty for poses that were in memory.
    pub path: String,
    /// The verdict in one word; `error` where there is none.
    pub verdict: String,
    /// Chance that a log like the trusted ones is so unusual.
    pub chance: Option<f64>,
    /// The log is called where its chance is at most this.
    pub alpha: Option<f64>,
    /// The test that decided.
    pub decided_by: Option<String>,
    /// How far the log is: 1 is a trusted extreme.
    pub excess: Option<f64>,
    /// Mean score of its windows; higher is more out of distribution.
    pub score: Option<f64>,
    /// The highest score of a window.
    pub worst_score: Option<f64>,
    /// The window threshold.
    pub threshold: Option<f64>,
    /// Windows.
    pub windows: Option<u64>,
    /// Windows beyond the threshold.
    pub beyond: Option<u64>,
    /// Poses judged.
    pub poses: Option<u64>,
    /// Rate of the log as judged, hertz.
    pub rate_hz: Option<f64>,
    /// Where: the segments of the report.
    pub stretches: Vec<Stretch>,
    /// Why, in sentences, the strongest reason first.
    pub reasons: Vec<String>,
    /// What the user should know, in sentences.
    pub notes: Vec<String>,
    /// Why the log could not be judged.
    pub error: Option<String>,
    /// What made the row.
    #[serde(flatten)]
    pub versions: Versions,
}

/// One stretch of a log that sticks out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stretch {
    /// First row of the file.
    pub first_row: u64,
    /// Last row of the file.
    pub last_row: u64,
    /// Its start from the log's start, seconds.
    pub start_s: f64,
    /// Its end from the log's start, seconds.
    pub end_s: f64,
    /// Highest window score within.
    pub worst_score: f64,
}

impl From<&Segment> for Stretch {
    fn from(segment: &Segment) -> Self {
        let place = &segment.place;
        Self {
            first_row: place.first_row,
            last_row: place.last_row,
            start_s: place.start_s,
            end_s: place.end_s,
            worst_score: segment.worst_score.value(),
        }
    }
}

impl Row {
    /// The row of a log that was judged.
    #[must_use]
    pub fn of(path: &str, report: &Report, versions: &Versions) -> Self {
        let e = &report.evidence;
        let worst = report.windows.iter().map(|window| window.score).max();
        Self {
            log: Some(report.log.name.clone()),
            path: path.to_owned(),
            verdict: report.verdict.name().to_owned(),
            chance: Some(e.p_value),
            alpha: Some(e.alpha),
            decided_by: Some(e.deciding().name.clone()),
            excess: Some(e.excess),
            score: Some(e.mean_score.value()),
            worst_score: worst.map(Score::value),
            threshold: Some(e.threshold.value()),
            windows: Some(e.windows as u64),
            beyond: Some(e.beyond as u64),
            poses: Some(report.log.poses as u64),
            rate_hz: Some(report.log.rate_hz),
            stretches: report.segments.iter().map(Stretch::from).collect(),
            reasons: report.reasons.iter().map(|r| r.sentence.clone()).collect(),
            notes: report.notes.clone(),
            error: None,
            versions: versions.clone(),
        }
    }

    /// The row of a log that could not be judged.
    #[must_use]
    pub fn failed(path: &str, error: &str, versions: &Versions) -> Self {
        Self {
            log: None,
            path: path.to_owned(),
            verdict: "error".to_owned(),
            chance: None,
            alpha: None,
            decided_by: None,
            excess: None,
            score: None,
            worst_score: None,
            threshold: None,
            windows: None,
            beyond: None,
            poses: None,
            rate_hz: None,
            stretches: Vec::new(),
            reasons: Vec::new(),
            notes: Vec::new(),
            error: Some(error.to_owned()),
            versions: versions.clone(),
        }
    }
}
