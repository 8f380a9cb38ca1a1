//! Evaluation: how well a detector tells two lists of logs apart.

use crate::detector::{Detector, JudgeOptions};
use crate::error::{Error, Result};
use crate::progress::Progress;
use dose3_datasets::{LogGroups, Trajectory};
use dose3_ood::Score;
use dose3_ood::metrics::{Bootstrap, Estimate, Grouped, Metric, estimate_all};
use serde::{Deserialize, Serialize};

/// One metric with its interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MetricReport {
    /// `auroc`, `aupr_in`, `aupr_out`, `fpr_at_95_tpr`, `detection`, `false_alarms`.
    pub metric: String,
    /// The value and its bootstrap interval over logs.
    pub estimate: Estimate,
}

/// What an evaluation found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Evaluation {
    /// Statistics of the detector.
    pub statistics: String,
    /// Seed of the noise draws, of the density's fit and of the bootstrap.
    pub seed: u64,
    /// Noise draws a window.
    pub draws: usize,
    /// Diffusion steps visited.
    pub steps: usize,
    /// Bootstrap resamples.
    pub resamples: usize,
    /// In-distribution windows.
    pub id_windows: usize,
    /// Out-of-distribution windows.
    pub ood_windows: usize,
    /// In-distribution logs that were rejected, of how many.
    pub id_logs_rejected: (usize, usize),
    /// Out-of-distribution logs that were rejected, of how many.
    pub ood_logs_rejected: (usize, usize),
    /// Window metrics.
    pub windows: Vec<MetricReport>,
    /// Metrics over logs, each scored by its mean window score.
    pub logs: Vec<MetricReport>,
    /// In-distribution logs that the detector was fitted on: their scores are too good.
    pub leaked: Vec<String>,
}

/// Window scores of some logs, and the verdict on each.
struct Side {
    scores: Vec<Score>,
    logs: Vec<usize>,
    log_scores: Vec<Score>,
    groups: Vec<usize>,
    rejected: usize,
}

/// Scores both lists and computes the metrics; `progress` hears of every judged log.
///
/// # Errors
/// An empty list, or a log that cannot be judged.
pub fn evaluate(
    detector: &Detector,
    id: &[Trajectory],
    ood: &[Trajectory],
    bootstrap: Bootstrap,
    progress: &mut dyn Progress,
) -> Result<Evaluation> {
    let header = detector.header();
    let trusted: Vec<&str> = header.trusted.iter().map(|r| r.sha256.as_str()).collect();
    let leaked = id
        .iter()
        .filter(|t| trusted.contains(&t.fingerprint().as_str()))
        .map(|t| t.name.clone())
        .collect();
    let (id_count, ood_count) = (id.len(), ood.len());
    let id = side(detector, id, progress)?;
    let ood = side(detector, ood, progress)?;
    let threshold = header.statistics.calibration().threshold;
    let metrics = [
        ("auroc", Metric::Auroc),
        ("aupr_in", Metric::AuprIn),
        ("aupr_out", Metric::AuprOut),
        ("fpr_at_95_tpr", Metric::FprAt95Tpr),
        ("detection", Metric::DetectionAt(threshold)),
        ("false_alarms", Metric::FalseAlarmAt(threshold)),
    ];
    let compute = |count: usize, id: Grouped<'_>, ood: Grouped<'_>| -> Result<Vec<MetricReport>> {
        let kinds: Vec<Metric> = metrics[..count].iter().map(|m| m.1).collect();
        let estimates = estimate_all(&kinds, id, ood, bootstrap)?;
        Ok(metrics
            .iter()
            .zip(estimates)
            .map(|((metric, _), estimate)| MetricReport {
                metric: (*metric).to_owned(),
                estimate,
            })
            .collect())
    };
    let plan = header.plan();
    Ok(Evaluation {
        statistics: header.statistics.config().statistics.to_string(),
        seed: plan.seed,
        draws: plan.draws,
        steps: plan.steps,
        resamples: bootstrap.resamples,
        id_windows: id.scores.len(),
        ood_windows: ood.scores.len(),
        id_logs_rejected: (id.rejected, id_count),
        ood_logs_rejected: (ood.rejected, ood_count),
        windows: compute(
            6,
            Grouped {
                scores: &id.scores,
                logs: &id.logs,
            },
            Grouped {
                scores: &ood.scores,
                logs: &ood.logs,
            },
        )?,
        // Thresholds are for windows, so logs get the four metrics without one.
        logs: compute(
            4,
            Grouped {
                scores: &id.log_scores,
                logs: &id.groups,
            },
            Grouped {
                scores: &ood.log_scores,
                logs: &ood.groups,
            },
        )?,
        leaked,
    })
}

fn side(detector: &Detector, logs: &[Trajectory], progress: &mut dyn Progress) -> Result<Side> {
    if logs.is_empty() {
        return Err(Error::NoLog {
            purpose: "evaluate on",
        });
    }
    let groups = LogGroups::of(logs).of_log;
    let mut side = Side {
        scores: Vec::new(),
        logs: Vec::new(),
        log_scores: Vec::new(),
        groups: groups.clone(),
        rejected: 0,
    };
    for (log, group) in logs.iter().zip(groups) {
        let report = detector.judge_with(log, &JudgeOptions::default(), &mut ())?;
        side.scores.extend(report.windows.iter().map(|w| w.score));
        side.logs.extend(report.windows.iter().map(|_| group));
        side.log_scores.push(report.evidence.mean_score);
        side.rejected += usize::from(report.is_ood());
        progress.log(&log.name);
    }
    Ok(side)
}
