//! Contenders fitted to trusted windows, and what they say of logs.

use super::contender::{Contender, Kind};
use super::forest::Forest;
use super::nearest::Nearest;
use anyhow::{Context, Result};
use dose3_ood::calibration::{Duration, RunReference, Stretch, erode};
use dose3_ood::{DensityConfig, DetectorConfig, DetectorStatistics, ExternalTest, Place, Score};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Chance of a false alarm that everything is judged at.
pub const ALPHA: f64 = 0.05;
/// Folds that trusted groups are held out in, for the baselines.
const FOLDS: usize = 5;

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
    /// A score of windows, judged by the detector's rule.
    Baseline {
        /// The score.
        score: Baseline,
        /// Held-out runs of trusted windows.
        runs: RunReference,
        /// How long runs are.
        durations: Vec<Duration>,
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
    /// Out of distribution, or unlike where one log is trusted.
    pub called: bool,
    /// Chance of as much in a log like the trusted ones.
    pub chance: f64,
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
            Kind::Detector {
                combination,
                shares,
            } => {
                let config = DetectorConfig {
                    statistics: contender.set()?,
                    density: settings.density.clone(),
                    combination,
                    shares: shares.map(<[f64]>::to_vec),
                    overlap: settings.overlap,
                    alpha: ALPHA,
                    draws: settings.draws,
                    seed: settings.seed,
                    ..DetectorConfig::default()
                };
                let names: Vec<String> = (0..=groups(places).last().copied().unwrap_or(0))
                    .map(|group| format!("group {group}"))
                    .collect();
                let detector = DetectorStatistics::fit(config, rows, places, &names);
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
        self.judge_with(rows, stretches, &[])
    }

    /// The same, where a detector is told of tests from outside; baselines know of none.
    ///
    /// # Errors
    /// As [`Self::judge`].
    pub fn judge_with(
        &self,
        rows: &[Vec<f64>],
        stretches: &[usize],
        tests: &[ExternalTest],
    ) -> Result<Judged> {
        match self {
            Self::Detector(detector) => {
                let verdict = detector.judge_with(rows, stretches, tests, ALPHA)?;
                Ok(Judged {
                    called: verdict.verdict.differs(),
                    chance: verdict.p_value,
                    mean: verdict.mean_score.value(),
                })
            }
            Self::Baseline {
                score,
                runs,
                durations,
            } => {
                let scores = score.of(rows);
                let run = runs.worst_run(&scores, &by_stretch(stretches), durations);
                let chance = run.context("no window")?.p_value;
                let sum: f64 = scores.iter().map(|score| score.value()).sum();
                Ok(Judged {
                    called: chance <= ALPHA,
                    chance,
                    mean: sum / scores.len() as f64,
                })
            }
        }
    }
}

/// The groups, each once, ascending.
fn groups(places: &[Place]) -> Vec<usize> {
    let mut groups: Vec<usize> = places.iter().map(|place| place.group).collect();
    groups.sort_unstable();
    groups.dedup();
    groups
}

/// The windows of each stretch.
fn by_stretch<T: Ord + Copy>(stretches: &[T]) -> Vec<Vec<usize>> {
    let mut found: BTreeMap<T, Vec<usize>> = BTreeMap::new();
    for (window, stretch) in stretches.iter().enumerate() {
        found.entry(*stretch).or_default().push(window);
    }
    found.into_values().collect()
}

/// The highest of the lowest scores of `run` windows in a row; none where no stretch has so many.
pub fn worst_run(scores: &[Score], stretches: &[usize], run: usize) -> Option<Score> {
    let of = |stretch: Vec<usize>| -> Vec<Score> {
        let scores: Vec<Score> = stretch.iter().map(|&window| scores[window]).collect();
        erode(&scores, run)
    };
    by_stretch(stretches).into_iter().flat_map(of).max()
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
    let groups = groups(places);
    anyhow::ensure!(groups.len() > 1, "held-out scores need two groups of logs");
    let mut stretches = Vec::new();
    for fold in 0..FOLDS.min(groups.len()) {
        let is_out = |window: usize| {
            let group = groups.binary_search(&places[window].group);
            group.is_ok_and(|group| group % FOLDS == fold)
        };
        let of = |out: bool| (0..rows.len()).filter(move |&window| is_out(window) == out);
        let train: Vec<Vec<f64>> = of(false).map(|window| rows[window].clone()).collect();
        let score = fit(&train);
        let out: Vec<usize> = of(true).collect();
        let keys: Vec<_> = out
            .iter()
            .map(|&window| (places[window].log, places[window].stretch))
            .collect();
        for stretch in by_stretch(&keys) {
            let windows: Vec<usize> = stretch.iter().map(|&i| out[i]).collect();
            let rows: Vec<Vec<f64>> = windows.iter().map(|&window| rows[window].clone()).collect();
            stretches.push(Stretch {
                group: places[windows[0]].group,
                scores: score.of(&rows),
            });
        }
    }
    let durations = Duration::of_overlap(settings.overlap);
    let longest = durations.iter().map(|duration| duration.windows).max();
    Ok(Fitted::Baseline {
        score: fit(rows),
        runs: RunReference::new(&stretches, longest.unwrap_or(1), settings.overlap)?,
        durations,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_end_with_their_stretch() {
        let scores = [5.0, 3.0, 4.0, 9.0, 8.0].map(Score::new);
        let worst = |stretches: &[usize], run| {
            let found = worst_run(&scores, stretches, run);
            found.map(|score| score.value())
        };
        assert_eq!(worst(&[0; 5], 3), Some(4.0));
        assert_eq!(worst(&[0, 0, 0, 1, 1], 3), Some(3.0));
        assert_eq!(worst(&[0, 0, 0, 1, 1], 2), Some(8.0));
        assert_eq!(worst(&[0, 0, 1, 1, 2], 3), None);
    }

    #[test]
    fn a_baseline_calls_what_lies_apart() {
        let wave = |i: usize, k: f64| {
            (1..7)
                .map(|j| (i as f64 * k * f64::from(j * j)).sin())
                .sum()
        };
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
                row.fill(20.0);
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
