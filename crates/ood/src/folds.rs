//! Which trusted rows are held out together.
//!
//! Windows of one log overlap and resemble each other: a threshold set on random windows lets
//! through 13 to 14 % instead of 5 % on logs it has not seen. So whole logs are held out. With one
//! log that cannot be done, and contiguous blocks of it are held out instead, with a guard of rows on
//! both sides that neither fit nor test sees.

use crate::error::Error;
use serde::{Deserialize, Serialize};

/// Blocks cut where there are too few logs.
const BLOCKS: usize = 6;
/// With fewer logs than this, logs are cut.
const FEWEST_LOGS: usize = 2;
/// Most folds of [`Folds::Auto`].
const AUTO_FOLDS: usize = 10;

/// How trusted logs are held out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Folds {
    /// One log at a time up to 10 logs, else 10 folds of logs.
    #[default]
    Auto,
    /// One log at a time.
    LeaveOneLogOut,
    /// So many folds of whole logs, of similar numbers of rows.
    K(usize),
}

/// What was held out as one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// Whole logs.
    Log,
    /// Contiguous blocks of a log: only one was given.
    Block,
}

/// Rows cut into units (logs or blocks), units put into folds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoldPlan {
    unit: Unit,
    logs: usize,
    /// Unit of each row.
    unit_of: Vec<usize>,
    /// Fold of each unit.
    fold_of: Vec<usize>,
    /// Position of each row within its log, where logs are cut.
    log_and_position: Vec<(usize, usize)>,
    guard: usize,
}

impl FoldPlan {
    /// Plans for rows whose logs are `logs`; rows of one log are in order of time. `guard` is the
    /// number of rows that share poses with a row (window length over stride, rounded up); it is
    /// used only where a log has to be cut.
    ///
    /// # Errors
    /// [`Error::TooFew`] where not even two units with something left to fit on can be made,
    /// [`Error::Parameter`] for fewer than two folds.
    pub fn new(logs: &[usize], folds: Folds, guard: usize) -> Result<Self, Error> {
        if let Folds::K(k @ (0 | 1)) = folds {
            return Err(Error::Parameter {
                name: "folds",
                value: k.to_string(),
                expected: "must be at least 2",
            });
        }
        let mut names: Vec<usize> = Vec::new();
        let mut sizes: Vec<usize> = Vec::new();
        let mut log_and_position = Vec::with_capacity(logs.len());
        for &log in logs {
            let index = names.iter().position(|&n| n == log).unwrap_or_else(|| {
                names.push(log);
                sizes.push(0);
                names.len() - 1
            });
            log_and_position.push((index, sizes[index]));
            sizes[index] += 1;
        }
        let plan = if names.len() >= FEWEST_LOGS {
            Self {
                unit: Unit::Log,
                logs: names.len(),
                unit_of: log_and_position.iter().map(|&(log, _)| log).collect(),
                fold_of: balance(&sizes, fold_count(folds, names.len())),
                log_and_position,
                guard: 0,
            }
        } else {
            Self::cut(&sizes, log_and_position, guard)
        };
        let fits = (0..plan.folds()).all(|fold| plan.train(fold).len() >= 2);
        if plan.folds() < 2 || !fits {
            return Err(Error::TooFew {
                what: "trusted windows to hold some out",
                needed: 4 * (guard + 1),
                found: logs.len(),
                hint: "give more or longer trusted logs",
            });
        }
        Ok(plan)
    }

    /// Contiguous blocks of a log, each block a fold.
    fn cut(sizes: &[usize], log_and_position: Vec<(usize, usize)>, guard: usize) -> Self {
        let wanted = BLOCKS / sizes.len().max(1);
        // A block shorter than the guard would lose more rows to the guard than it holds out.
        let blocks: Vec<usize> = sizes
            .iter()
            .map(|&rows| (rows / guard.max(1)).clamp(1, wanted))
            .collect();
        let mut unit_of = Vec::with_capacity(log_and_position.len());
        for &(log, position) in &log_and_position {
            let before: usize = blocks[..log].iter().sum();
            unit_of.push(before + position * blocks[log] / sizes[log]);
        }
        Self {
            unit: Unit::Block,
            logs: sizes.len(),
            unit_of,
            fold_of: (0..blocks.iter().sum()).collect(),
            log_and_position,
            guard,
        }
    }

    /// Whether logs or blocks are held out.
    #[must_use]
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// Number of logs.
    #[must_use]
    pub fn logs(&self) -> usize {
        self.logs
    }

    /// Number of units.
    #[must_use]
    pub fn units(&self) -> usize {
        self.fold_of.len()
    }

    /// The unit of each row.
    #[must_use]
    pub fn unit_of(&self) -> &[usize] {
        &self.unit_of
    }

    /// Number of folds.
    #[must_use]
    pub fn folds(&self) -> usize {
        self.fold_of.iter().max().map_or(0, |&last| last + 1)
    }

    /// Rows held out in a fold.
    #[must_use]
    pub fn held_out(&self, fold: usize) -> Vec<usize> {
        let rows = 0..self.unit_of.len();
        rows.filter(|&row| self.fold_of[self.unit_of[row]] == fold)
            .collect()
    }

    /// Rows to fit on in a fold: those of the other folds, less the guard.
    #[must_use]
    pub fn train(&self, fold: usize) -> Vec<usize> {
        // Per log: first and last position held out; a fold holds out one block of a cut log.
        let mut ranges: Vec<Option<(usize, usize)>> = vec![None; self.logs];
        if self.unit == Unit::Block {
            for row in self.held_out(fold) {
                let (log, position) = self.log_and_position[row];
                let first = ranges[log].map_or(position, |(first, _)| first.min(position));
                ranges[log] = Some((first, position));
            }
        }
        let rows = 0..self.unit_of.len();
        rows.filter(|&row| {
            let (log, position) = self.log_and_position[row];
            let guarded = ranges[log].is_some_and(|(first, last)| {
                position + self.guard >= first && position <= last + self.guard
            });
            self.fold_of[self.unit_of[row]] != fold && !guarded
        })
        .collect()
    }
}

fn fold_count(folds: Folds, logs: usize) -> usize {
    match folds {
        Folds::Auto => logs.min(AUTO_FOLDS),
        Folds::LeaveOneLogOut => logs,
        Folds::K(k) => k.min(logs),
    }
}

/// Puts the longest logs first, each into the fold with the fewest rows so far.
fn balance(sizes: &[usize], folds: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&log| (std::cmp::Reverse(sizes[log]), log));
    let mut load = vec![(0_usize, 0_usize); folds];
    let mut fold_of = vec![0; sizes.len()];
    for log in order {
        // Fewest rows, then fewest logs, then first: no fold stays empty.
        let fold = (0..folds).min_by_key(|&f| (load[f], f)).unwrap_or(0);
        load[fold].0 += sizes[log];
        load[fold].1 += 1;
        fold_of[log] = fold;
    }
    fold_of
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_log_is_held_out_once_and_never_in_its_own_fit() {
        let logs: Vec<usize> = (0..70).map(|i| 100 + i / 10).collect();
        for folds in [Folds::Auto, Folds::LeaveOneLogOut, Folds::K(3)] {
            let plan = FoldPlan::new(&logs, folds, 4).unwrap();
            assert_eq!(plan.unit(), Unit::Log);
            let mut seen = vec![0; 70];
            for fold in 0..plan.folds() {
                let held_out = plan.held_out(fold);
                let train = plan.train(fold);
                assert_eq!(held_out.len() + train.len(), 70);
                for &row in &held_out {
                    seen[row] += 1;
                    assert!(train.iter().all(|&t| logs[t] != logs[row]));
                }
            }
            assert!(seen.iter().all(|&n| n == 1));
        }
        assert_eq!(FoldPlan::new(&logs, Folds::K(3), 0).unwrap().folds(), 3);
        assert_eq!(FoldPlan::new(&logs, Folds::Auto, 0).unwrap().folds(), 7);
        assert!(FoldPlan::new(&logs, Folds::K(1), 0).is_err());
    }

    #[test]
    fn one_log_is_cut_with_a_guard() {
        let guard = 4;
        let plan = FoldPlan::new(&[7; 60], Folds::Auto, guard).unwrap();
        assert_eq!(
            (plan.unit(), plan.logs(), plan.units()),
            (Unit::Block, 1, 6)
        );
        for fold in 0..6 {
            let held_out = plan.held_out(fold);
            assert_eq!(held_out.len(), 10);
            assert!(held_out.windows(2).all(|w| w[1] == w[0] + 1), "contiguous");
            for t in plan.train(fold) {
                assert!(held_out.iter().all(|&h| h.abs_diff(t) > guard));
            }
        }
        assert_eq!(plan.train(0).len(), 46);
        assert_eq!(plan.train(1).len(), 42);
    }

    #[test]
    fn two_logs_hold_out_each_other_and_interleaved_rows_keep_their_order() {
        let logs: Vec<usize> = (0..60).map(|i| i % 2).collect();
        let plan = FoldPlan::new(&logs, Folds::Auto, 2).unwrap();
        assert_eq!((plan.unit(), plan.logs(), plan.units()), (Unit::Log, 2, 2));
        let even: Vec<usize> = (0..60).step_by(2).collect();
        let odd: Vec<usize> = (1..60).step_by(2).collect();
        // Logs of a size are put into folds as they come.
        assert!([&even, &odd].contains(&&plan.held_out(0)));
        assert_eq!(plan.held_out(0).len() + plan.train(0).len(), 60);
        assert_eq!(plan.held_out(0), plan.train(1));
    }

    #[test]
    fn too_little_is_an_error() {
        assert!(FoldPlan::new(&[], Folds::Auto, 4).is_err());
        assert!(FoldPlan::new(&[1; 3], Folds::Auto, 4).is_err());
        assert!(FoldPlan::new(&[1; 9], Folds::Auto, 4).is_err());
        assert!(FoldPlan::new(&[1; 40], Folds::Auto, 4).is_ok());
        // Two short logs: each is held out whole.
        let plan = FoldPlan::new(&[1, 1, 1, 2, 2, 2], Folds::Auto, 4).unwrap();
        assert_eq!(plan.units(), 2);
    }
}
