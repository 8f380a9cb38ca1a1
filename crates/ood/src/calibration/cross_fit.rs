//! Scores of trusted windows by densities that have not seen them.

use crate::density::{DensityConfig, DensityModel};
use crate::error::{Error, expect_len, expect_table};
use crate::folds::{FoldPlan, Folds};
use crate::score::Score;
use rayon::prelude::*;

/// Held-out scores of trusted rows.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossFit {
    /// One per row: the score under a density fitted without the row's log (or block).
    pub scores: Vec<Score>,
    /// What was held out together.
    pub plan: FoldPlan,
}

/// Fits on the other logs and scores the held-out one, for every fold. What a density chooses by the
/// data (the number of components) is chosen once, on all rows. See [`FoldPlan::new`] for `logs`,
/// `folds` and `guard`.
///
/// # Errors
/// Those of [`FoldPlan::new`] and [`DensityModel::fit`].
pub fn cross_fit(
    rows: &[Vec<f64>],
    logs: &[usize],
    config: &DensityConfig,
    folds: Folds,
    guard: usize,
) -> Result<CrossFit, Error> {
    let config = config.resolve(rows, logs)?;
    let plan = FoldPlan::new(logs, folds, guard)?;
    let scores = held_out(
        rows,
        logs,
        &plan,
        |rows, logs, _| DensityModel::fit(rows, logs, &config),
        |model, row| model.score(row),
    )?;
    Ok(CrossFit { scores, plan })
}

/// For every row, what `score` says of it by a model that `fit` made without its fold: from the other
/// rows, their logs and their indices.
pub(crate) fn held_out<M: Sync, S: Send>(
    rows: &[Vec<f64>],
    logs: &[usize],
    plan: &FoldPlan,
    fit: impl Fn(&[Vec<f64>], &[usize], &[usize]) -> Result<M, Error> + Sync,
    score: impl Fn(&M, &[f64]) -> Result<S, Error> + Sync,
) -> Result<Vec<S>, Error> {
    expect_table("trusted rows", rows)?;
    expect_len("logs of the trusted rows", rows.len(), logs.len())?;
    let folds: Result<Vec<Vec<(usize, S)>>, Error> = (0..plan.folds())
        .into_par_iter()
        .map(|fold| {
            let train = plan.train(fold);
            let train_rows: Vec<Vec<f64>> = train.iter().map(|&i| rows[i].clone()).collect();
            let train_logs: Vec<usize> = train.iter().map(|&i| logs[i]).collect();
            let model = fit(&train_rows, &train_logs, &train)?;
            let held_out = plan.held_out(fold).into_par_iter();
            held_out
                .map(|i| Ok((i, score(&model, &rows[i])?)))
                .collect()
        })
        .collect();
    // Every row is in exactly one fold.
    let mut scored: Vec<(usize, S)> = folds?.into_iter().flatten().collect();
    scored.sort_by_key(|&(row, _)| row);
    Ok(scored.into_iter().map(|(_, s)| s).collect())
}
