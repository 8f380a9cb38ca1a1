//! The verdict on a log.
//!
//! With n trusted logs a per-log p-value cannot fall below 1/(n+1). So:
//!
//! 1. where alpha is at least 1/(n+1) and the log has as many windows as some trusted log, the
//!    p-value of its mean window score decides ([`Rule::PValue`]): it needs no model of how logs
//!    differ, only that a trusted log could have been any of them;
//! 2. else the share of its windows beyond the threshold decides, against what held-out trusted logs
//!    showed ([`Rule::Share`], see [`crate::calibration::SharePrediction`]): a mean over few windows
//!    scatters more than one over many, and a share's limit knows the number of windows;
//! 3. where no share is rare enough at that alpha (few windows, or a trusted log that was all beyond
//!    the threshold), or where all windows overlap and are one window to both, the log is OOD if each
//!    of its windows has a p-value of at most alpha ([`Rule::Window`]): all windows are beyond no more
//!    often than the first one is.
//!
//! A fault of a few seconds in a long log moves neither mean nor share. So a log that passes is also OOD
//! where its worst window is beyond every held-out trusted window, and one that a log of its length has with
//! a chance of at most alpha / 2 ([`Rule::Worst`]): `1 - (1 - p)^n` for n windows that share no poses, p
//! from the exponential tail of the held-out window scores.

use super::DetectorStatistics;
use crate::calibration::{Reference, thin_down};
use crate::error::Error;
use crate::folds::Unit;
use crate::score::Score;
use crate::statistics::quantile_sorted;
use crate::verdict::Verdict;
use serde::{Deserialize, Serialize};

/// What decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// The p-value of the log's mean score.
    PValue,
    /// The share of windows beyond the threshold.
    Share,
    /// The p-value of every single window.
    Window,
    /// The worst window, where the rules above let the log pass.
    Worst,
}

impl Rule {
    /// Share of alpha that [`Rule::Worst`] has.
    pub const WORST_SHARE: f64 = 0.5;
}

/// The verdict on one log, with what it rests on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogVerdict {
    /// What is said of the log.
    pub verdict: Verdict,
    /// The alpha asked for.
    pub alpha: f64,
    /// What decided.
    pub rule: Rule,
    /// Windows of the log.
    pub windows: usize,
    /// Mean window score.
    pub mean_score: Score,
    /// `(1 + #{trusted logs with a mean score >= this one's}) / (n + 1)`, at least
    /// `smallest_p_value`.
    pub p_value: f64,
    /// The smallest p-value there is with so many trusted logs.
    pub smallest_p_value: f64,
    /// The window threshold.
    pub threshold: Score,
    /// Windows beyond the threshold.
    pub beyond: usize,
    /// Share of windows beyond the threshold.
    pub share_beyond: f64,
    /// Chance that a log like the trusted ones shows such a share (a model, see
    /// [`crate::calibration::SharePrediction`]).
    pub share_p_value: f64,
    /// From this share on the log is OOD by [`Rule::Share`]; none where no share is rare enough.
    pub share_limit: Option<f64>,
    /// Chance that a log like the trusted ones, of this length, has such a worst window: a model, see
    /// [`Rule::Worst`].
    pub worst_p_value: f64,
    /// Score of each window.
    pub window_scores: Vec<Score>,
    /// p-value of each window among held-out trusted windows.
    pub window_p_values: Vec<f64>,
    /// Groups of statistics, the one that drove the scores first.
    pub contributions: Vec<Contribution>,
    /// What a reader of the verdict has to know, in sentences.
    pub notes: Vec<String>,
}

/// What one group of statistics says of the log's windows: of those beyond the threshold where there
/// are any, else of all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contribution {
    /// Name of the group.
    pub group: String,
    /// p-value of the windows' median score under this group's density, among held-out trusted
    /// windows.
    pub p_value: f64,
    /// Where that median lies between the trusted median (0) and the group's own threshold (1);
    /// above 1 it is beyond.
    pub excess: f64,
    /// Share of all windows of the log beyond the group's own threshold.
    pub share_beyond: f64,
}

/// `scored` holds the score of each window and the scores of its groups; not empty.
pub(super) fn judge(
    detector: &DetectorStatistics,
    scored: &[(Score, Vec<Score>)],
    alpha: f64,
) -> Result<LogVerdict, Error> {
    let (config, calibration) = (&detector.config, &detector.calibration);
    let window_scores: Vec<Score> = scored.iter().map(|s| s.0).collect();
    let p_of = |&score: &Score| calibration.windows.p_value(score);
    let window_p_values: Vec<f64> = window_scores.iter().map(p_of).collect();
    let windows = scored.len();
    let threshold = calibration.threshold;
    let beyond = window_scores.iter().filter(|&&s| s > threshold).count();

    let mean_score = Score::mean(&window_scores);
    let smallest_p_value = calibration.smallest_p_value();
    let p_value = calibration
        .log_scores()?
        .p_value(mean_score)
        .max(smallest_p_value);

    let (thin_beyond, thin_windows) = thin_down(beyond, windows, config.overlap);
    let tails = calibration.share_prediction(config)?.tails(thin_windows);
    let share_p_value = tails[thin_beyond];
    let limit = tails.iter().position(|&tail| tail <= alpha);
    let share_limit = limit.map(|k| k as f64 / thin_windows as f64);

    let fewest = calibration
        .units
        .iter()
        .map(|u| u.windows)
        .min()
        .unwrap_or(0);
    let rule = if thin_windows > 1 && smallest_p_value <= alpha && windows >= fewest {
        Rule::PValue
    } else if thin_windows > 1 && limit.is_some() {
        Rule::Share
    } else {
        Rule::Window
    };
    let rejected = match rule {
        Rule::PValue => p_value <= alpha,
        Rule::Share => share_p_value <= alpha,
        Rule::Window | Rule::Worst => window_p_values.iter().all(|&p| p <= alpha),
    };
    let worst_p_value = worst_p_value(&calibration.windows, &window_scores, thin_windows);
    // Beyond every held-out window, too: the tail's shape alone must not condemn a log.
    let worst = window_scores.iter().max() > calibration.windows.scores().last()
        && matches!(rule, Rule::PValue | Rule::Share)
        && worst_p_value <= Rule::WORST_SHARE * alpha;
    let (rule, ood) = match rejected {
        false if worst => (Rule::Worst, true),
        _ => (rule, rejected),
    };
    let notes = notes(detector, alpha, rule, windows, thin_windows, fewest);
    Ok(LogVerdict {
        // Blocks of one log are judged as if they were logs.
        verdict: Verdict::of(ood, calibration.units.len()),
        alpha,
        rule,
        windows,
        mean_score,
        p_value,
        smallest_p_value,
        threshold,
        beyond,
        share_beyond: beyond as f64 / windows as f64,
        share_p_value,
        share_limit,
        worst_p_value,
        contributions: contributions(detector, scored, threshold),
        window_scores,
        window_p_values,
        notes,
    })
}

/// `1 - (1 - p)^n` of the highest score, without cancellation.
fn worst_p_value(reference: &Reference, scores: &[Score], thin_windows: usize) -> f64 {
    let worst = scores.iter().max().map_or(0.0, |&s| reference.ln_p(s));
    -(thin_windows as f64 * (-worst.exp()).ln_1p()).exp_m1()
}

fn notes(
    detector: &DetectorStatistics,
    alpha: f64,
    rule: Rule,
    windows: usize,
    thin_windows: usize,
    fewest: usize,
) -> Vec<String> {
    let calibration = &detector.calibration;
    let logs = match calibration.logs {
        1 => "1 trusted log".to_owned(),
        n => format!("{n} trusted logs"),
    };
    let mut notes = Vec::new();
    if rule != Rule::PValue && calibration.smallest_p_value() > alpha {
        let decides = match rule {
            Rule::Share => ": the share of windows beyond the held-out window threshold decides",
            _ => "",
        };
        notes.push(format!(
            "with {logs} a per-log p-value cannot fall below 1/{} = {:.3}, and alpha = {alpha} is \
             finer{decides}",
            calibration.logs + 1,
            calibration.smallest_p_value(),
        ));
    } else if rule == Rule::Share {
        notes.push(format!(
            "the log has {windows} windows, every trusted log at least {fewest}: its mean score \
             scatters more than theirs, so the share of windows beyond the threshold decides"
        ));
    }
    if calibration.unit == Unit::Block {
        notes.push(format!(
            "calibrated on {} contiguous blocks cut from {logs}: how much logs differ from each \
             other has not been seen, so expect more false alarms than alpha says",
            calibration.units.len(),
        ));
    }
    let finest = calibration.windows.smallest_p_value();
    if rule == Rule::Window {
        notes.push(match windows {
            1 => "the log has one window, whose own p-value decides".to_owned(),
            _ if thin_windows == 1 => {
                "all windows of the log overlap: it is OOD where each of them is".to_owned()
            }
            _ => format!(
                "with {logs} no share of {windows} windows is rare enough to decide at alpha = \
                 {alpha}: the log is OOD where each of its windows is"
            ),
        });
        if finest > alpha {
            notes.push(format!(
                "with {} held-out windows a window's p-value cannot fall below {finest:.4}, and \
                 alpha = {alpha} is finer: nothing can be called OOD",
                calibration.windows.len(),
            ));
        }
    }
    if finest > detector.config.window_alpha {
        notes.push(format!(
            "only {} trusted windows: the window threshold is the highest trusted score, not the \
             bottom {} of likelihoods",
            calibration.windows.len(),
            detector.config.window_alpha,
        ));
    }
    notes
}

fn contributions(
    detector: &DetectorStatistics,
    scored: &[(Score, Vec<Score>)],
    threshold: Score,
) -> Vec<Contribution> {
    let any_beyond = scored.iter().any(|(score, _)| *score > threshold);
    let mut contributions: Vec<Contribution> = detector
        .groups
        .iter()
        .zip(&detector.calibration.groups)
        .enumerate()
        .map(|(index, (group, reference))| {
            let looked_at = scored.iter().filter(|(s, _)| !any_beyond || *s > threshold);
            let mut values: Vec<f64> = looked_at.map(|(_, g)| g[index].value()).collect();
            values.sort_by(f64::total_cmp);
            let median = quantile_sorted(&values, 0.5);
            let own = reference.threshold(detector.config.window_alpha);
            let over = scored.iter().filter(|(_, g)| g[index] > own).count();
            Contribution {
                group: group.name.clone(),
                p_value: reference.p_value(Score::new(median)),
                excess: excess(reference, own, median),
                share_beyond: over as f64 / scored.len() as f64,
            }
        })
        .collect();
    contributions.sort_by(|a, b| b.excess.total_cmp(&a.excess));
    contributions
}

fn excess(reference: &Reference, threshold: Score, score: f64) -> f64 {
    let median = reference.quantile(0.5);
    let spread = threshold.value() - median;
    (score - median) / spread.max(1e-9 * median.abs().max(1.0))
}
