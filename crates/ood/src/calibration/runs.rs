//! How unusual the worst run of windows of a log is.
//!
//! For runs of q windows, `p(E)` is the chance that a trusted run has an eroded score of E or more
//! (see [`erode`]): its rank among held-out trusted runs up to their 0.9 quantile, beyond it an
//! exponential tail with their mean excess as scale. Few trusted logs have few independent exceedances,
//! and a scale estimated from c of them is uncertain: integrated out, the tail z scales beyond its start is
//! `(1 + z / c)^-c`, with c the clusters of exceedances.
//!
//! Runs overlap and bad windows come in clusters, so the maximum over m windows is that of fewer
//! independent ones: `theta m`, with the extremal index theta (Leadbetter, Lindgren and Rootzen 1983)
//! estimated by the runs method (Smith and Weissman 1994) as clusters over exceedances of a high quantile.
//! At a lower one clusters merge that extremes would not form: at the 0.9 quantile, with an exponential
//! tail of known scale, 8 to 15 % of exchangeable simulated logs were called at alpha 0.05 beside 10 or 40
//! trusted ones and 14 to 22 % beside 3; as it stands 4 to 8 % and 4 to 12 %. For a whole log
//!
//! `p = 1 - (1 - min p(E))^max(1, theta m)`,
//!
//! and over durations of weight w the smallest `p / w`. A stretch shorter than a run is eroded as far
//! as it goes and compared with trusted runs of that length, never with longer ones.

use super::erosion::{Duration, erode};
use super::reference::Reference;
use crate::error::Error;
use crate::score::Score;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Beyond this quantile the chance is that of a tail.
const HIGH: f64 = 0.9;
/// Clusters over exceedances of this quantile are the extremal index.
const EXTREMES: f64 = 0.97;
/// Range of the extremal index: four windows of the usual stride cover a pose, so less than a quarter
/// would rest on few clusters.
const THETA: (f64, f64) = (0.25, 1.0);
/// Fewest clusters of exceedances of a length whose windows do not all share poses: the lowest of many windows is the same for
/// many runs that share it, and one cluster does not tell how far others go. Of shorter runs one will do.
const FEWEST_CLUSTERS: usize = 2;
/// The share of trusted runs that reaches a trusted extreme.
const EXTREME: f64 = 1e-3;

/// Held-out trusted window scores of one gap-free stretch of a log, in order of time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stretch {
    /// Index of the group of logs it belongs to.
    pub group: usize,
    /// One score a window.
    pub scores: Vec<Score>,
}

/// Held-out trusted runs of every length up to the longest that the trusted logs can tell of.
#[derive(Clone, Debug, PartialEq)]
pub struct RunReference {
    /// Of runs of 1, 2, ... windows; never empty.
    levels: Vec<Level>,
    /// Whether the order of the windows is known; else every run is compared with single windows.
    ordered: bool,
}

/// Trusted runs of one length.
#[derive(Clone, Debug, PartialEq)]
struct Level {
    eroded: Reference,
    /// Independent exceedances of the 0.9 quantile.
    clusters: f64,
    theta: f64,
}

/// The most unusual run of a log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Chance that a log like the trusted ones has so unusual a run, in (0, 1].
    pub p_value: f64,
    /// Index of its first window.
    pub first: usize,
    /// Index of its last window.
    pub last: usize,
    /// The lowest of its window scores.
    pub score: Score,
    /// Whether that lies beyond the 0.9 quantile of the trusted runs, where the chance is a fitted tail.
    pub tail: bool,
    /// How far the log's highest run of the first duration is: 0 is the median of trusted runs, 1 what one
    /// trusted run in a thousand reaches.
    pub excess: f64,
}

/// A run of a log before the log's length is taken into account.
struct Candidate {
    ln_p: f64,
    first: usize,
    last: usize,
    score: Score,
    level: usize,
}

impl RunReference {
    /// From the trusted stretches, for runs of up to `longest` windows. Exceedances more than `gap` windows
    /// apart are clusters of their own.
    ///
    /// A length counts where at least half of the groups have trusted runs of it, with a cluster of exceedances; with two where it
    /// is longer than `gap`.
    ///
    /// # Errors
    /// [`Error::TooFew`] for no window.
    pub fn new(stretches: &[Stretch], longest: usize, gap: usize) -> Result<Self, Error> {
        let groups = groups_of(stretches.iter());
        let mut levels = Vec::new();
        for run in 1..=longest.max(1) {
            let eroded: Vec<Vec<Score>> = stretches.iter().map(|s| erode(&s.scores, run)).collect();
            let told = stretches.iter().filter(|s| s.scores.len() >= run);
            if run > 1 && 2 * groups_of(told) < groups {
                break;
            }
            let reference = Reference::new(eroded.concat())?;
            let (clusters, _) = clusters(&eroded, reference.quantile(HIGH), gap);
            let fewest = if run <= gap { 1 } else { FEWEST_CLUSTERS };
            if run > 1 && clusters < fewest {
                break;
            }
            levels.push(Level {
                clusters: clusters.max(1) as f64,
                theta: extremal_index(&eroded, reference.quantile(EXTREMES), gap),
                eroded: reference,
            });
        }
        Ok(Self {
            levels,
            ordered: true,
        })
    }

    /// From window scores whose order is not known: runs of any length are compared with single
    /// windows, and windows to be judged count as independent, so that chances come out too large rather
    /// than too small.
    #[must_use]
    pub fn unordered(windows: Reference) -> Self {
        let high = windows.quantile(HIGH);
        let beyond = windows.scores().iter().filter(|s| s.value() > high);
        let level = Level {
            // Of overlapping windows about four are one piece of evidence.
            clusters: (THETA.0 * beyond.count() as f64).max(1.0),
            eroded: windows,
            theta: 1.0,
        };
        Self {
            levels: vec![level],
            ordered: false,
        }
    }

    /// The single windows.
    #[must_use]
    pub fn windows(&self) -> &Reference {
        &self.levels[0].eroded
    }

    /// The logarithm of the chance of a run of so many windows, or of the longest known, with the tail of a
    /// prediction beyond the 0.9 quantile; `score` is the lowest of its windows'.
    #[must_use]
    pub fn run_ln_p(&self, windows: usize, score: Score) -> f64 {
        let level = self.level(windows);
        level.eroded.predictive_ln_p(score, level.clusters)
    }

    /// Whether the trusted logs can tell of runs of so many windows.
    #[must_use]
    pub fn knows(&self, windows: usize) -> bool {
        (1..=self.levels.len()).contains(&windows)
    }

    /// The median of single windows, and how far above it one in a thousand is.
    #[must_use]
    pub fn reach(&self) -> (f64, f64) {
        self.levels[0].reach()
    }

    /// Whether the order of the trusted windows is known.
    #[must_use]
    pub fn is_ordered(&self) -> bool {
        self.ordered
    }

    /// The extremal index of runs of so many windows, or of the longest runs known.
    #[must_use]
    pub fn extremal_index(&self, run: usize) -> f64 {
        self.level(run).theta
    }

    /// The most unusual run among `scores`, whose gap-free stretches are given as indices in order of time;
    /// `None` without windows or durations.
    #[must_use]
    pub fn worst_run(
        &self,
        scores: &[Score],
        stretches: &[Vec<usize>],
        durations: &[Duration],
    ) -> Option<Run> {
        let mut found: Vec<(Vec<usize>, f64, Run)> = Vec::new();
        for duration in durations {
            let lengths = self.lengths(stretches, duration.windows);
            // Where a log is too short to tell durations apart, they are one.
            if let Some((_, weight, _)) = found.iter_mut().find(|(l, ..)| *l == lengths) {
                *weight += duration.weight;
                continue;
            }
            let run = self.of_lengths(scores, stretches, &lengths)?;
            found.push((lengths, duration.weight, run));
        }
        let excess = found.first()?.2.excess;
        let weighted = found.into_iter().map(|(_, weight, run)| Run {
            p_value: (run.p_value / weight).min(1.0),
            excess,
            ..run
        });
        weighted.min_by(|a, b| a.p_value.total_cmp(&b.p_value))
    }

    /// How long a run can be in each stretch.
    fn lengths(&self, stretches: &[Vec<usize>], run: usize) -> Vec<usize> {
        let known = if self.ordered {
            self.levels.len()
        } else {
            usize::MAX
        };
        stretches
            .iter()
            .map(|s| run.min(s.len()).min(known))
            .collect()
    }

    fn level(&self, run: usize) -> &Level {
        &self.levels[run.clamp(1, self.levels.len()) - 1]
    }

    fn of_lengths(
        &self,
        scores: &[Score],
        stretches: &[Vec<usize>],
        lengths: &[usize],
    ) -> Option<Run> {
        let mut independent = 0.0;
        let mut worst: Option<Candidate> = None;
        let mut excess = f64::NEG_INFINITY;
        for (stretch, &run) in stretches.iter().zip(lengths).filter(|(s, _)| !s.is_empty()) {
            let level = self.level(run);
            independent += level.theta * stretch.len() as f64;
            let own: Vec<Score> = stretch.iter().map(|&i| scores[i]).collect();
            // The first of equals.
            let (at, score) = erode(&own, run)
                .into_iter()
                .enumerate()
                .rev()
                .max_by_key(|&(_, score)| score)?;
            let ln_p = level.eroded.predictive_ln_p(score, level.clusters);
            excess = excess.max(level.excess(score));
            if worst.as_ref().is_none_or(|w| ln_p < w.ln_p) {
                worst = Some(Candidate {
                    ln_p,
                    first: stretch[at],
                    last: stretch[at + run - 1],
                    score,
                    level: run,
                });
            }
        }
        let worst = worst?;
        let reference = &self.level(worst.level).eroded;
        Some(Run {
            p_value: of_maximum(worst.ln_p, independent.max(1.0)),
            first: worst.first,
            last: worst.last,
            score: worst.score,
            tail: worst.score.value() > reference.quantile(HIGH),
            excess,
        })
    }
}

impl Level {
    fn excess(&self, score: Score) -> f64 {
        let (median, reach) = self.reach();
        (score.value() - median) / reach
    }

    fn reach(&self) -> (f64, f64) {
        let median = self.eroded.quantile(0.5);
        let reach = self.eroded.predictive_score(EXTREME, self.clusters) - median;
        (median, reach.max(1e-9 * median.abs().max(1.0)))
    }
}

/// `1 - (1 - p)^n`, without cancellation and never 0.
fn of_maximum(ln_p: f64, n: f64) -> f64 {
    let p = -(n * (-ln_p.exp()).ln_1p()).exp_m1();
    p.clamp(f64::MIN_POSITIVE, 1.0)
}

/// Clusters over exceedances of `threshold`, with one of each more: few exceedances say little against
/// independence.
fn extremal_index(eroded: &[Vec<Score>], threshold: f64, gap: usize) -> f64 {
    let (clusters, exceedances) = clusters(eroded, threshold, gap);
    ((clusters + 1) as f64 / (exceedances + 1) as f64).clamp(THETA.0, THETA.1)
}

/// Clusters of exceedances of `threshold`, and exceedances.
fn clusters(eroded: &[Vec<Score>], threshold: f64, gap: usize) -> (usize, usize) {
    let (mut clusters, mut exceedances) = (0_usize, 0_usize);
    for stretch in eroded {
        let mut before: Option<usize> = None;
        for (i, _) in stretch
            .iter()
            .enumerate()
            .filter(|(_, s)| s.value() > threshold)
        {
            exceedances += 1;
            clusters += usize::from(before.is_none_or(|b| i - b > gap));
            before = Some(i);
        }
    }
    (clusters, exceedances)
}

fn groups_of<'a>(stretches: impl Iterator<Item = &'a Stretch>) -> usize {
    let with_windows = stretches.filter(|s| !s.scores.is_empty());
    with_windows.map(|s| s.group).collect::<BTreeSet<_>>().len()
}

#[cfg(test)]
mod tests;
