//! Percentile intervals by resampling logs.
//!
//! Windows of one log are not independent, so whole logs are drawn with replacement, on either side
//! on its own. An interval over windows would be several times too narrow.

use super::Metric;
use super::curve::{Curve, Entry};
use crate::error::{Error, expect_len};
use crate::score::Score;
use crate::statistics::quantile_sorted;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Scores with the log that each comes from.
#[derive(Clone, Copy, Debug)]
pub struct Grouped<'a> {
    /// Scores of windows.
    pub scores: &'a [Score],
    /// The log of each; any numbers will do.
    pub logs: &'a [usize],
}

/// Settings of the bootstrap.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bootstrap {
    /// Resamples.
    pub resamples: usize,
    /// Share of resamples within the interval, in (0, 1).
    pub confidence: f64,
    /// Seed.
    pub seed: u64,
}

impl Default for Bootstrap {
    fn default() -> Self {
        Self {
            resamples: 1000,
            confidence: 0.95,
            seed: 0,
        }
    }
}

/// An interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Interval {
    /// Lower end.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

/// A metric with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Estimate {
    /// The metric of all scores.
    pub value: f64,
    /// Percentile interval; none where both sides are a single log, which leaves nothing to
    /// resample. A side of a single log stays as it is, and the interval tells of the other alone.
    pub interval: Option<Interval>,
    /// Logs on the ID side.
    pub id_logs: usize,
    /// Logs on the OOD side.
    pub ood_logs: usize,
}

/// One metric with its interval; see [`estimate_all`].
///
/// # Errors
/// As [`estimate_all`].
pub fn estimate(
    metric: Metric,
    id: Grouped<'_>,
    ood: Grouped<'_>,
    bootstrap: Bootstrap,
) -> Result<Estimate, Error> {
    Ok(estimate_all(&[metric], id, ood, bootstrap)?[0])
}

/// Several metrics with their intervals over the same resamples. The same seed gives the same
/// interval for any number of threads.
///
/// # Errors
/// [`Error::TooFew`] where a side is empty, [`Error::Shape`] where logs and scores differ in number,
/// [`Error::Parameter`] for no resamples or a confidence outside of (0, 1).
pub fn estimate_all(
    metrics: &[Metric],
    id: Grouped<'_>,
    ood: Grouped<'_>,
    bootstrap: Bootstrap,
) -> Result<Vec<Estimate>, Error> {
    let parameter = |name, value: String, expected| Error::Parameter {
        name,
        value,
        expected,
    };
    let Bootstrap {
        resamples,
        confidence,
        seed,
    } = bootstrap;
    if resamples == 0 {
        return Err(parameter("resamples", "0".to_owned(), "must be at least 1"));
    }
    if !(confidence > 0.0 && confidence < 1.0) {
        let value = confidence.to_string();
        return Err(parameter("confidence", value, "must lie in (0, 1)"));
    }
    let (id_logs, id_index) = dense("logs of the ID scores", id)?;
    let (ood_logs, ood_index) = dense("logs of the OOD scores", ood)?;

    // One sort serves all resamples: a resample only changes how often an entry counts.
    let entries = |side: Grouped<'_>, index: &[usize], is_ood| -> Vec<(Entry, usize)> {
        let scores = side.scores.iter().zip(index);
        scores
            .map(|(&score, &log)| (Entry::new(score, is_ood), log))
            .collect()
    };
    let mut all = entries(id, &id_index, false);
    all.extend(entries(ood, &ood_index, true));
    all.sort_by_key(|(entry, _)| std::cmp::Reverse(entry.score));

    let values: Vec<f64> = metrics
        .iter()
        .map(|metric| metric.of(id.scores, ood.scores))
        .collect::<Result<_, _>>()?;
    let resampled: Vec<Vec<f64>> = if id_logs == 1 && ood_logs == 1 {
        Vec::new()
    } else {
        (0..resamples)
            .into_par_iter()
            .map(|resample| {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                rng.set_stream(resample as u64);
                let id_counts = draw(&mut rng, id_logs);
                let ood_counts = draw(&mut rng, ood_logs);
                let weighted = all.iter().filter_map(|&(entry, log)| {
                    let counts = if entry.is_ood {
                        &ood_counts
                    } else {
                        &id_counts
                    };
                    let count = counts[log];
                    (count > 0).then_some(Entry { count, ..entry })
                });
                let curve = Curve::new(weighted);
                metrics.iter().map(|m| m.of_curve(&curve)).collect()
            })
            .collect()
    };
    let estimates = values.iter().enumerate().map(|(metric, &value)| {
        let mut column: Vec<f64> = resampled.iter().map(|r| r[metric]).collect();
        column.sort_by(f64::total_cmp);
        let outside = 0.5 * (1.0 - confidence);
        Estimate {
            value,
            interval: (!column.is_empty()).then(|| Interval {
                lower: quantile_sorted(&column, outside),
                upper: quantile_sorted(&column, 1.0 - outside),
            }),
            id_logs,
            ood_logs,
        }
    });
    Ok(estimates.collect())
}

/// Number of logs, and each score's log counted from 0 in order of appearance.
fn dense(what: &'static str, side: Grouped<'_>) -> Result<(usize, Vec<usize>), Error> {
    expect_len(what, side.scores.len(), side.logs.len())?;
    let mut names: Vec<usize> = Vec::new();
    let index = side
        .logs
        .iter()
        .map(|log| {
            names.iter().position(|n| n == log).unwrap_or_else(|| {
                names.push(*log);
                names.len() - 1
            })
        })
        .collect();
    Ok((names.len(), index))
}

/// How often each log is drawn; a single log is left as it is.
fn draw(rng: &mut ChaCha8Rng, logs: usize) -> Vec<u64> {
    let mut counts = vec![0; logs];
    for _ in 0..logs {
        counts[rng.random_range(0..logs)] += 1;
    }
    counts
}
