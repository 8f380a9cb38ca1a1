//! Which logs are trusted while which are judged, and the contenders fitted to them.

use super::contender::Contender;
use super::judge::Fitted;
use super::run::Run;
use super::table::{self, Table};
use crate::faults::Part;
use crate::faults::protocol::LogSet;
use anyhow::Result;
use dose3_datasets::Trajectory;
use dose3_ood::Place;
use dose3_ood::statistics::LinearReference;

/// Most folds of a set.
const MOST: usize = 6;

/// Indices of logs.
#[derive(Clone, Debug, PartialEq)]
pub struct Fold {
    /// Judged.
    pub tested: Vec<usize>,
    /// Trusted.
    pub fitted: Vec<usize>,
}

/// Logs of a set, whole, with what was measured of them.
pub struct Measured<'a> {
    /// The logs at the model's rate.
    pub logs: &'a [Trajectory],
    /// The number of each log's group.
    pub groups: &'a [usize],
    /// All their windows.
    pub table: Table,
}

/// Contenders fitted to the trusted logs of a fold; none where there is too little for one.
pub struct FoldFit {
    /// In the order of the contenders.
    pub fitted: Vec<(Contender, Fitted)>,
    /// For the block `lin`.
    pub linear: LinearReference,
}

/// The folds of a set. To choose settings: one, of the validation logs. To test: every group of logs in turn (of many
/// groups, every sixth together), or one fold of the test logs alone.
pub fn of_set(set: &LogSet, part: Part, one: bool) -> Vec<Fold> {
    if part == Part::Validation || one {
        return vec![Fold {
            tested: set.tested(part),
            fitted: set.fitted(part),
        }];
    }
    by_group(&set.groups(), MOST)
}

/// Every group left out in turn, in at most `most` folds.
pub fn by_group(groups: &[usize], most: usize) -> Vec<Fold> {
    let count = groups.iter().max().map_or(0, |last| last + 1);
    let folds = count.min(most);
    let of = |fold: usize| {
        let (tested, fitted) =
            (0..groups.len()).partition(|&log| groups[log] % folds.max(1) == fold);
        Fold { tested, fitted }
    };
    (0..folds).map(of).collect()
}

/// Fits all rows of a run.
///
/// # Errors
/// Trusted logs that are too short for any.
pub fn fit(measured: &Measured<'_>, trusted: &[usize], run: &Run<'_>) -> Result<FoldFit> {
    let linear = table::linear(measured.logs, trusted, measured.groups)?;
    let table = &measured.table;
    let windows: Vec<usize> = trusted.iter().flat_map(|log| table.of_log(*log)).collect();
    let place = |&window: &usize| {
        let log = table.windows[window].trajectory;
        Place {
            group: measured.groups[log],
            log,
            stretch: table.stretches[window],
        }
    };
    let places: Vec<Place> = windows.iter().map(place).collect();
    let mut fitted = Vec::new();
    for contender in &run.contenders {
        let rows = run
            .measurer
            .rows(table, &windows, &contender.set()?, |log| {
                linear.without(measured.groups[log])
            })?;
        match Fitted::fit(contender, &rows, &places, &run.settings) {
            Ok(fit) => fitted.push((*contender, fit)),
            Err(error) => say!("{}: not fitted, {error:#}", contender.key),
        }
    }
    Ok(FoldFit { fitted, linear })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_log_is_tested_once_and_never_beside_its_group() {
        let groups = [0, 0, 1, 2, 3, 3, 4];
        for most in [2, 6] {
            let folds = by_group(&groups, most);
            assert_eq!(folds.len(), most.min(5));
            let mut tested: Vec<usize> = folds.iter().flat_map(|f| f.tested.clone()).collect();
            tested.sort_unstable();
            assert_eq!(tested, [0, 1, 2, 3, 4, 5, 6]);
            for fold in folds {
                let of =
                    |logs: &[usize]| -> Vec<usize> { logs.iter().map(|l| groups[*l]).collect() };
                let tested = of(&fold.tested);
                assert!(of(&fold.fitted).iter().all(|g| !tested.contains(g)));
            }
        }
        assert!(by_group(&[], 6).is_empty());
    }
}
