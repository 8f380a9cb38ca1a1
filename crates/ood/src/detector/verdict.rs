//! The verdict on a log.
//!
//! Each test asks how unusual the log's worst run of windows is ([`RunReference::worst_run`]); the tests,
//! with those from outside, join with their shares of alpha ([`super::TestVerdict`]), and the log is out
//! of distribution where the chance is at most alpha. It rests on a tail fitted to held-out trusted windows:
//! n groups of trusted logs alone could only say `1 / (n + 1)`, and [`Basis`] holds both. With one group
//! the verdict is only whether the log is like it.
//!
//! [`RunReference::worst_run`]: crate::calibration::RunReference::worst_run

use super::DetectorStatistics;
use super::basis::Basis;
use super::contribution::{Contribution, contributions};
use super::scored::Scored;
use super::test::{Evidence, ExternalTest, TestVerdict, join, share_left};
use crate::calibration::Run;
use crate::error::Error;
use crate::folds::Unit;
use crate::score::Score;
use crate::verdict::Verdict;
use serde::{Deserialize, Serialize};

/// The verdict on one log, with what it rests on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct LogVerdict {
    /// What is said of the log.
    pub verdict: Verdict,
    /// The alpha asked for.
    pub alpha: f64,
    /// Chance that a log like the trusted ones is so unusual, by all tests, in (0, 1]; the log differs
    /// where it is at most alpha.
    pub p_value: f64,
    /// Index of the test that decided: the one with the smallest chance for its share.
    pub decided_by: usize,
    /// What each test says; the detector's own first, then those from outside.
    pub tests: Vec<TestVerdict>,
    /// What the chance rests on.
    pub basis: Basis,
    /// How far the log is: the largest [`Run::excess`] of its tests. 0 is a usual run of trusted windows, 1
    /// a trusted extreme, one run in a thousand.
    pub excess: f64,
    /// Windows of the log.
    pub windows: usize,
    /// Mean window score.
    pub mean_score: Score,
    /// The window threshold.
    pub threshold: Score,
    /// Windows beyond the threshold.
    pub beyond: usize,
    /// How often the log is unusual: share of windows beyond the threshold.
    pub share_beyond: f64,
    /// Score of each window, over all tests.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub window_scores: Vec<Score>,
    /// p-value of each window among held-out trusted windows.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub window_p_values: Vec<f64>,
    /// Groups of statistics, the one that drove the scores first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contributions: Vec<Contribution>,
    /// What a reader of the verdict has to know, in sentences.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

impl LogVerdict {
    /// The test that decided.
    #[must_use]
    pub fn deciding(&self) -> &TestVerdict {
        &self.tests[self.decided_by]
    }

    /// The most unusual run of windows: that of the test that decided, else of the strongest of the
    /// detector's own.
    #[must_use]
    pub fn run(&self) -> Option<&Run> {
        self.deciding().run().or_else(|| {
            let own = self.tests.iter().filter(|t| t.run().is_some());
            let strongest =
                own.min_by(|a, b| a.weighted_p_value().total_cmp(&b.weighted_p_value()));
            strongest.and_then(TestVerdict::run)
        })
    }
}

/// `scored` are the windows of the log, not empty, `stretches` their indices by gap-free stretch.
pub(super) fn judge(
    detector: &DetectorStatistics,
    scored: &[Scored],
    stretches: &[Vec<usize>],
    external: &[ExternalTest],
    alpha: f64,
) -> Result<LogVerdict, Error> {
    let (config, calibration) = (&detector.config, &detector.calibration);
    let left = share_left(external)?;
    let durations = config.durations();
    let names = config.statistics.test_names();
    let own = detector.runs.iter().zip(config.shares()).enumerate();
    let mut tests: Vec<TestVerdict> = own
        .filter_map(|(index, (reference, share))| {
            let scores: Vec<Score> = scored.iter().map(|s| s.tests[index]).collect();
            let run = reference.worst_run(&scores, stretches, &durations)?;
            Some(TestVerdict {
                name: names[index].clone(),
                share: share * left,
                p_value: run.p_value,
                evidence: Evidence::Run(run),
            })
        })
        .collect();
    let excesses = tests.iter().filter_map(TestVerdict::run).map(|r| r.excess);
    let excess = excesses.fold(f64::NEG_INFINITY, f64::max);
    tests.extend(external.iter().map(TestVerdict::from));
    let (decided_by, p_value) = join(&tests);
    let verdict = Verdict::of(p_value <= alpha, calibration.logs);

    let window_scores: Vec<Score> = scored.iter().map(|s| s.score).collect();
    let p_of = |&score: &Score| calibration.windows.p_value(score);
    let threshold = calibration.threshold;
    let beyond: Vec<usize> = (0..scored.len())
        .filter(|&w| window_scores[w] > threshold)
        .collect();
    let tail = tests[decided_by].run().is_some_and(|run| run.tail);
    let mut verdict = LogVerdict {
        verdict,
        alpha,
        p_value,
        decided_by,
        tests,
        basis: Basis::new(calibration.logs, calibration.windows.len(), tail),
        excess,
        windows: scored.len(),
        mean_score: Score::mean(&window_scores),
        threshold,
        beyond: beyond.len(),
        share_beyond: beyond.len() as f64 / scored.len() as f64,
        window_p_values: window_scores.iter().map(p_of).collect(),
        window_scores,
        contributions: Vec::new(),
        notes: notes(detector),
    };
    let deciding = match verdict.run() {
        Some(run) if verdict.verdict.differs() => (run.first..=run.last).collect(),
        _ if beyond.is_empty() => (0..scored.len()).collect(),
        _ => beyond,
    };
    verdict.contributions = contributions(detector, scored, &deciding);
    Ok(verdict)
}

fn notes(detector: &DetectorStatistics) -> Vec<String> {
    let calibration = &detector.calibration;
    let mut notes = Vec::new();
    if calibration.unit == Unit::Block {
        let logs = match calibration.logs {
            1 => "1 trusted log".to_owned(),
            n => format!("{n} trusted logs"),
        };
        notes.push(format!(
            "calibrated on {} contiguous blocks cut from {logs}: how much logs differ from each \
             other has not been seen, so expect more false alarms than alpha says",
            calibration.units.len(),
        ));
    }
    if detector.runs.iter().any(|runs| !runs.is_ordered()) {
        notes.push(
            "fitted by an older version that kept no order of the trusted windows: runs of windows \
             are compared with single ones, which finds less; fit it again"
                .to_owned(),
        );
    }
    if calibration.windows.smallest_p_value() > detector.config.window_alpha {
        notes.push(format!(
            "only {} trusted windows: the window threshold is the highest trusted score, not the \
             bottom {} of likelihoods",
            calibration.windows.len(),
            detector.config.window_alpha,
        ));
    }
    notes
}
