//! Levels of an alarm, from a rate and the trusted logs.

use super::{Peaks, Watch, ln_bet};
use crate::calibration::{RunReference, Stretch, erode};
use crate::detector::DetectorStatistics;
use crate::error::Error;
use crate::score::Score;
use serde::{Deserialize, Serialize};

/// A window is unusual where its chance is at most this.
const UNUSUAL: f64 = 0.05;
/// Share of a window's length without an unusual window that ends an alarm.
const RECOVERY: f64 = 0.25;
/// Runs that are watched: so many windows at least, and so much of a window's length; and their shares of the rate.
const RUNS: [(usize, f64, f64); 3] = [(1, 0.0, 0.3), (2, 0.5, 0.2), (2, 0.75, 0.3)];
/// Share of the rate of evidence that adds up.
const SUMMED: f64 = 0.2;

/// How often a monitor looks, and how often it may be wrong.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlarmConfig {
    /// False alarms an hour that are allowed, above 0 and at most 60.
    pub per_hour: f64,
    /// Windows watched from one trusted window's start to the next: as finely as it is looked.
    pub spacing: usize,
    /// Windows that share a step of motion with a given one on one side, plus itself, as they are watched.
    pub overlap: usize,
    /// Seconds from one trusted window to the next.
    pub trusted_every: f64,
}

/// What the levels rest on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlarmBasis {
    /// Groups of trusted logs; with one there was none to be left out.
    pub groups: usize,
    /// Hours of trusted windows.
    pub hours: f64,
    /// Runs of so many windows, `-ln p`, in order of length.
    pub runs: Vec<LevelBasis>,
    /// Evidence that adds up, ln W.
    pub summed: LevelBasis,
    /// Groups of trusted logs that would raise an alarm by a window or a run if the others alone had set the level.
    pub apart: Vec<usize>,
}

/// What one level rests on: the larger counts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LevelBasis {
    /// Windows of the run; 1 for evidence that adds up.
    pub windows: usize,
    /// What windows as independent as the trusted ones ask for.
    pub bound: f64,
    /// What the peaks of the trusted logs ask for; none in detectors that kept no order of windows.
    pub trusted: Option<f64>,
}

/// A run that is watched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunLevel {
    /// Its windows, as far apart as the trusted ones.
    pub windows: usize,
    /// The `-ln p` that raises an alarm.
    pub level: f64,
}

/// Levels of an alarm.
#[derive(Clone, Debug, PartialEq)]
pub struct AlarmReference {
    config: AlarmConfig,
    ln_shares: Vec<f64>,
    runs: Vec<RunLevel>,
    summed: f64,
    basis: AlarmBasis,
    /// Per test the median of trusted windows, and how far above it one in a thousand is.
    reach: Vec<(f64, f64)>,
}

impl AlarmConfig {
    fn check(&self) -> Result<(), Error> {
        let wrong = |name, value: String, expected| {
            Err(Error::Parameter {
                name,
                value,
                expected,
            })
        };
        // Written so that NaN fails as well.
        if !(self.per_hour > 0.0 && self.per_hour <= 60.0) {
            let expected = "must be above 0 and at most 60";
            return wrong("false alarms an hour", self.per_hour.to_string(), expected);
        }
        if !(self.trusted_every > 0.0 && self.trusted_every.is_finite()) {
            let found = self.trusted_every.to_string();
            return wrong("seconds between trusted windows", found, "must be above 0");
        }
        if self.spacing == 0 || self.overlap == 0 {
            return wrong("windows", "0".to_owned(), "must be at least 1");
        }
        Ok(())
    }
}

impl LevelBasis {
    fn level(&self) -> f64 {
        self.bound.max(self.trusted.unwrap_or(0.0))
    }
}

impl AlarmReference {
    /// Levels for a detector.
    ///
    /// # Errors
    /// [`Error::Parameter`] for settings out of range.
    pub fn new(detector: &DetectorStatistics, config: AlarmConfig) -> Result<Self, Error> {
        config.check()?;
        let ln_shares: Vec<f64> = detector.config().shares().iter().map(|s| s.ln()).collect();
        let overlap = detector.config().overlap;
        let tests = &detector.calibration().tests;
        let an_hour = 3600.0 / config.trusted_every;
        let mut runs: Vec<LevelBasis> = Vec::new();
        let mut chances = Vec::new();
        let mut apart = Vec::new();
        let groups: Vec<usize> = tests
            .first()
            .into_iter()
            .flatten()
            .map(|s| s.group)
            .collect();
        for (least, length, share) in RUNS {
            let windows = ((length * overlap as f64).round() as usize).max(least);
            let known = detector.runs().iter().all(|r| r.knows(windows));
            if runs.last().is_some_and(|last| last.windows >= windows) || !known {
                continue;
            }
            let rate = share * config.per_hour;
            // Windows overlap and come in clusters: as many as are independent (the extremal index).
            let theta = detector.runs().iter().map(|r| r.extremal_index(windows));
            let independent = an_hour * theta.fold(0.0, f64::max);
            let found = held_out_chances(tests, &ln_shares, overlap, windows)?;
            let series: Vec<Vec<f64>> = found
                .iter()
                .map(|stretch| stretch.iter().map(|ln_p| -ln_p).collect())
                .collect();
            let level = |series: &[Vec<f64>]| {
                let peaks = Peaks::of(series, overlap, config.trusted_every);
                LevelBasis {
                    windows,
                    bound: (independent / rate).ln().max(0.0),
                    trusted: peaks.map(|peaks| peaks.level(rate)),
                }
            };
            runs.push(level(&series));
            apart.extend(beyond_the_others(&series, &groups, |s| level(s).level()));
            if windows == 1 {
                chances = found;
            }
        }
        let rate = SUMMED * config.per_hour;
        let sums = Peaks::of(&sums(&chances, overlap), overlap, config.trusted_every);
        let summed = LevelBasis {
            windows: 1,
            // Each chain passes A once in A of its windows, and every window belongs to one chain.
            bound: (an_hour / rate).ln().max(0.0),
            trusted: sums.map(|peaks| peaks.level(rate)),
        };
        let level = |basis: &LevelBasis| RunLevel {
            windows: basis.windows,
            level: basis.level(),
        };
        Ok(Self {
            runs: runs.iter().map(level).collect(),
            summed: summed.level(),
            basis: AlarmBasis {
                groups: detector.calibration().logs,
                hours: detector.calibration().windows.len() as f64 / an_hour,
                runs,
                summed,
                apart: {
                    apart.sort_unstable();
                    apart.dedup();
                    apart
                },
            },
            reach: detector.runs().iter().map(RunReference::reach).collect(),
            config,
            ln_shares,
        })
    }

    /// The settings.
    #[must_use]
    pub fn config(&self) -> &AlarmConfig {
        &self.config
    }

    /// What the levels rest on.
    #[must_use]
    pub fn basis(&self) -> &AlarmBasis {
        &self.basis
    }

    /// The runs that are watched, in order of length, single windows first.
    #[must_use]
    pub fn runs(&self) -> &[RunLevel] {
        &self.runs
    }

    /// The ln W that raises an alarm.
    #[must_use]
    pub fn summed(&self) -> f64 {
        self.summed
    }

    /// Windows watched from one window of a run to the next.
    #[must_use]
    pub fn spacing(&self) -> usize {
        self.config.spacing
    }

    /// A watch for it.
    #[must_use]
    pub fn watch(&self) -> Watch {
        let longest = self.runs.iter().map(|run| run.windows).max().unwrap_or(1);
        let back = (longest - 1) * self.config.spacing;
        Watch::new(self.config.overlap, back, self.ln_shares.len())
    }

    /// The logarithm of a window's chance, by its scores in the tests of `detector`, and the test that it is the
    /// chance of.
    #[must_use]
    pub fn ln_p(&self, detector: &DetectorStatistics, tests: &[Score]) -> (f64, usize) {
        let references = detector.runs().iter().zip(&self.ln_shares);
        let each = references.zip(tests).enumerate();
        each.map(|(test, ((reference, ln_share), &score))| {
            ((reference.run_ln_p(1, score) - ln_share).min(0.0), test)
        })
        .fold(
            (0.0, 0),
            |best, next| if next.0 < best.0 { next } else { best },
        )
    }

    /// The same of a run of windows, of which `lowest` answers the lowest score in each test.
    pub(super) fn run_ln_p(
        &self,
        detector: &DetectorStatistics,
        windows: usize,
        lowest: impl Fn(usize) -> Score,
    ) -> f64 {
        let references = detector.runs().iter().zip(&self.ln_shares).enumerate();
        references
            .map(|(test, (reference, share))| reference.run_ln_p(windows, lowest(test)) - share)
            .fold(0.0, f64::min)
    }

    /// How far a window is: 0 for the median of trusted windows, 1 for what one in a thousand reaches; the largest
    /// over the tests.
    #[must_use]
    pub fn excess(&self, tests: &[Score]) -> f64 {
        let each = self.reach.iter().zip(tests);
        each.map(|((median, reach), score)| (score.value() - median) / reach)
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// The `ln p` up to which a window is unusual.
    #[must_use]
    pub fn unusual(&self) -> f64 {
        UNUSUAL.ln()
    }

    /// Windows in a row, none of them unusual, that end an alarm.
    #[must_use]
    pub fn recovery(&self) -> usize {
        ((RECOVERY * self.config.overlap as f64).ceil() as usize).max(1)
    }
}

/// `ln p` of the trusted runs of so many windows, stretch by stretch, each among the runs of the other groups; with one
/// group among all.
fn held_out_chances(
    tests: &[Vec<Stretch>],
    ln_shares: &[f64],
    overlap: usize,
    windows: usize,
) -> Result<Vec<Vec<f64>>, Error> {
    let Some(first) = tests.first() else {
        return Ok(Vec::new());
    };
    let mut groups: Vec<usize> = first.iter().map(|s| s.group).collect();
    groups.sort_unstable();
    groups.dedup();
    let runs = |stretch: &Stretch| erode(&stretch.scores, windows);
    let mut chances: Vec<(usize, Vec<f64>)> = first
        .iter()
        .map(|s| (s.group, vec![0.0; runs(s).len()]))
        .collect();
    for group in &groups {
        for (test, ln_share) in tests.iter().zip(ln_shares) {
            let others: Vec<Stretch> = test
                .iter()
                .filter(|s| s.group != *group || groups.len() == 1)
                .cloned()
                .collect();
            let reference = RunReference::new(&others, windows, overlap)?;
            // A test may lack a group that stands apart in it.
            let own = test.iter().filter(|s| s.group == *group);
            let of_group = chances.iter_mut().filter(|(of, _)| of == group);
            for (stretch, (_, chances)) in own.zip(of_group) {
                for (score, chance) in runs(stretch).iter().zip(chances) {
                    *chance = chance.min(reference.run_ln_p(windows, *score) - ln_share);
                }
            }
        }
    }
    Ok(chances.into_iter().map(|(_, chances)| chances).collect())
}

/// The groups with a value beyond the level that the others alone would set; none of fewer than three groups, of which
/// the others are one.
fn beyond_the_others(
    series: &[Vec<f64>],
    groups: &[usize],
    level: impl Fn(&[Vec<f64>]) -> f64,
) -> Vec<usize> {
    let mut names = groups.to_vec();
    names.sort_unstable();
    names.dedup();
    if names.len() < 3 {
        return Vec::new();
    }
    names.retain(|name| {
        let of = |own: bool| {
            let all = series.iter().zip(groups);
            all.filter(move |(_, group)| (*group == name) == own)
        };
        let highest = of(true).flat_map(|(s, _)| s).copied();
        let others: Vec<Vec<f64>> = of(false).map(|(s, _)| s.clone()).collect();
        highest.fold(f64::NEG_INFINITY, f64::max) >= level(&others)
    });
    names
}

/// What bets on the trusted windows add up to.
fn sums(chances: &[Vec<f64>], overlap: usize) -> Vec<Vec<f64>> {
    let of_stretch = |stretch: &Vec<f64>| {
        let mut chains = vec![0.0_f64; overlap.max(1)];
        let each = stretch.iter().enumerate();
        each.map(|(i, ln_p)| {
            let chain = &mut chains[i % overlap.max(1)];
            *chain = chain.max(0.0) + ln_bet(*ln_p);
            *chain
        })
        .collect()
    };
    chances.iter().map(of_stretch).collect()
}
