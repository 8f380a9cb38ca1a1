//! Contenders fitted to trusted windows, and what they say of logs.

use super::contender::{Contender, Kind};
use super::forest::Forest;
use super::nearest::Nearest;
use anyhow::{Context, Result};
use dose3_ood::{DensityConfig, DetectorConfig, DetectorStatistics, Reference, Score};
use rayon::prelude::*;

/// Chance of a false alarm that everything is judged at.
pub const ALPHA: f64 = 0.05;
/// The extremal index where a log's windows overlap by three quarters, for the baselines that have no calibration of
/// their own.
const CLUSTERS: f64 = 0.3;
/// Folds that trusted groups are held out in, for the same.
const FOLDS: usize = 5;

/// Where a trusted window lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Number of its group.
    pub group: usize,
    /// Number of its log.
    pub log: usize,
    /// Number of the gap-free stretch within the log.
    pub stretch: usize,
}

/// Settings of the fits.
pub struct Settings {
    /// The density of every block.
    pub density: DensityConfig,
    /// Windows that share poses with one, on one side, and itself.
    pub overlap: usize,
    /// Noise draws, as the detector notes them.
    pub draws: usize,
    /// Seed.
    pub seed: u64,
}

/// A fitted contender.
pub enum Fitted {
    /// The detector.
    Detector(Box<DetectorStatistics>),
    /// A score of windows with held-out runs of trusted windows.
    Baseline {
        /// The score.
        score: Baseline,
        /// Lowest scores of runs of trusted windows.
        runs: Reference,
        /// Windows of a run.
        run: usize,
    },
}

/// A score of windows.
pub enum Baseline {
    /// Isolation forest.
    Forest(Forest),
    /// Nearest neighbour.
    Nearest(Nearest),
}

/// What is said of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// Out of distribution.
    pub called: bool,
    /// Mean window score.
    pub mean: f64,
}

impl Fitted {
    /// Fits to the rows of trusted windows.
    ///
    /// # Errors
    /// Too few rows or groups.
    pub fn fit(
        contender: &Contender,
        rows: &[Vec<f64>],
        places: &[Place],
        settings: &Settings,
    ) -> Result<Self> {
        match contender.kind {
            Kind::Detector(combination) => {
                let config = DetectorConfig {
                    statistics: contender.set()?,
                    density: settings.density.clone(),
                    combination,
                    overlap: settings.overlap,
                    alpha: ALPHA,
                    draws: settings.draws,
                    seed: settings.seed,
                    ..DetectorConfig::default()
                };
                let groups: Vec<usize> = places.iter().map(|place| place.group).collect();
                let names: Vec<String> = (0..=groups.iter().copied().max().unwrap_or(0))
                    .map(|group| format!("group {group}"))
                    .collect();
                let detector = DetectorStatistics::fit(config, rows, &groups, &names);
                let detector = detector.with_context(|| contender.key)?;
                Ok(Self::Detector(Box::new(detector)))
            }
            kind => baseline(kind, rows, places, settings),
        }
    }

    /// Scores of windows; higher is more unusual.
    ///
    /// # Errors
    /// Rows of another kind.
    pub fn scores(&self, rows: &[Vec<f64>]) -> Result<Vec<Score>> {
        Ok(match self {
            Self::Detector(detector) => detector.window_scores(rows)?,
            Self::Baseline { score, .. } => score.of(rows),
        })
    }

    /// What it says of a log, by the windows in order of time and the stretches that they lie in.
    ///
    /// # Errors
    /// Rows of another kind, or none.
    pub fn judge(&self, rows: &[Vec<f64>], stretches: &[usize]) -> Result<Judged> {
        match self {
            Self::Detector(detector) => {
                let verdict = detector.judge(rows)?;
                Ok(Judged {
                    called: verdict.verdict.is_ood(),
                    mean: verdict.mean_score.value(),
                })
            }
            Self::Baseline { score, runs, run } => {
                let scores = score.of(rows);
                let worst = lowest_of_runs(&scores, stretches, *run).into_iter().max();
                let worst = worst.context("no window")?;
                let clusters = (CLUSTERS * rows.len() as f64).max(1.0);
                let chance = -((-runs.ln_p(worst).exp()).ln_1p() * clusters).exp_m1();
                let sum: f64 = scores.iter().map(|score| score.value()).sum();
                Ok(Judged {
                    called: chance <= ALPHA,
                    mean: sum / scores.len() as f64,
                })
            }
        }
    }
}

fn baseline(
    kind: Kind,
    rows: &[Vec<f64>],
    places: &[Place],
    settings: &Settings,
) -> Result<Fitted> {
    let fit = |rows: &[Vec<f64>]| match kind {
        Kind::Forest => Baseline::Forest(Forest::fit(rows, settings.seed)),
        _ => Baseline::Nearest(Nearest::fit(rows)),
    };
    let mut groups: Vec<usize> = places.iter().map(|place| place.group).collect();
    groups.sort_unstable();
    groups.dedup();
    anyhow::ensure!(groups.len() > 1, "held-out scores need two groups of logs");
    let run = (3 * settings.overlap).div_ceil(4).max(1);
    let mut held_out = Vec::new();
    for fold in 0..FOLDS.min(groups.len()) {
        let out = |place: &Place| {
            groups.iter().position(|g| *g == place.group).unwrap_or(0) % FOLDS == fold
        };
        let of = |keep: bool| -> Vec<usize> {
            (0..rows.len())
                .filter(|&i| out(&places[i]) == keep)
                .collect()
        };
        let (test, train) = (of(true), of(false));
        let train: Vec<Vec<f64>> = train.iter().map(|&i| rows[i].clone()).collect();
        let score = fit(&train);
        let test_rows: Vec<Vec<f64>> = test.iter().map(|&i| rows[i].clone()).collect();
        let scores = score.of(&test_rows);
        // A stretch of its own for each log's.
        let stretches: Vec<usize> = test
            .iter()
            .map(|&i| places[i].log * 100_000 + places[i].stretch)
            .collect();
        held_out.extend(lowest_of_runs(&scores, &stretches, run));
    }
    Ok(Fitted::Baseline {
        score: fit(rows),
        runs: Reference::new(held_out)?,
        run,
    })
}

impl Baseline {
    fn of(&self, rows: &[Vec<f64>]) -> Vec<Score> {
        let score = |row: &Vec<f64>| {
            Score::new(match self {
                Self::Forest(forest) => forest.score(row),
                Self::Nearest(nearest) => nearest.score(row),
            })
        };
        rows.par_iter().map(score).collect()
    }
}

/// The lowest score of every run of windows within a stretch; of a stretch shorter than a run, of all of it.
pub fn lowest_of_runs(scores: &[Score], stretches: &[usize], run: usize) -> Vec<Score> {
    let mut lowest = Vec::new();
    let mut start = 0;
    for end in 1..=scores.len() {
        if end < scores.len() && stretches[end] == stretches[start] {
            continue;
        }
        let part = &scores[start..end];
        let of_run = |window: &[Score]| window.iter().copied().min();
        lowest.extend(part.windows(run.min(part.len())).filter_map(of_run));
        start = end;
    }
    lowest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_end_with_their_stretch() {
        let scores = [5.0, 3.0, 4.0, 9.0, 8.0].map(Score::new);
        let lowest = |stretches: &[usize], run| -> Vec<f64> {
            let found = lowest_of_runs(&scores, stretches, run);
            found.iter().map(|score| score.value()).collect()
        };
        assert_eq!(lowest(&[0; 5], 3), [3.0, 3.0, 4.0]);
        assert_eq!(lowest(&[0, 0, 0, 1, 1], 3), [3.0, 8.0]);
        assert_eq!(lowest(&[0, 0, 0, 1, 1], 2), [3.0, 3.0, 8.0]);
    }

    #[test]
    fn a_baseline_calls_what_lies_apart() {
        let wave = |i: usize, k: f64| (i as f64 * k).sin();
        let (mut rows, mut places) = (Vec::new(), Vec::new());
        for log in 0..6 {
            for i in 0..60 {
                rows.push(vec![wave(i + 7 * log, 0.7), wave(i * (log + 1), 1.3)]);
                places.push(Place {
                    group: log,
                    log,
                    stretch: 0,
                });
            }
        }
        let settings = Settings {
            density: DensityConfig::default(),
            overlap: 4,
            draws: 1,
            seed: 0,
        };
        for kind in [Kind::Forest, Kind::Nearest] {
            let contender = Contender {
                key: "baseline",
                statistics: "kinematic",
                kind,
            };
            let fitted = Fitted::fit(&contender, &rows, &places, &settings).unwrap();
            let sound = &rows[60..90];
            let mut apart = sound.to_vec();
            for row in &mut apart[10..14] {
                row[0] = 20.0;
            }
            let called = |rows: &[Vec<f64>]| fitted.judge(rows, &vec![0; rows.len()]).unwrap();
            assert!(!called(sound).called);
            assert!(called(&apart).called);
            assert!(called(&apart).mean > called(sound).mean);
            // One group leaves nothing to hold out.
            assert!(Fitted::fit(&contender, &rows[..60], &places[..60], &settings).is_err());
        }
    }
}
