//! The number of components by held-out log-likelihood.

use super::em::{Components, GaussianMixtureParams};
use crate::density::Density;
use crate::error::Error;
use crate::folds::{FoldPlan, Folds};
use rayon::prelude::*;

/// Folds of the comparison.
const FOLDS: usize = 4;
/// Rows between held-out and fitted ones where a log has to be cut.
const GUARD: usize = 4;
/// Rows used at most, evenly spaced: which number fits best shows on fewer rows than a fit needs.
const ROWS: usize = 2000;
/// The share of held-out rows that counts, the likeliest ones: a few gross outliers must not decide
/// on the shape of the rest, and a detector's threshold cuts the tail off anyway.
const KEPT: f64 = 0.95;

/// The number asked for, or the best candidate.
pub(super) fn count(
    params: &GaussianMixtureParams,
    rows: &[Vec<f64>],
    logs: &[usize],
) -> Result<usize, Error> {
    let most = match params.components {
        Components::Fixed(count) => return Ok(count),
        Components::HeldOut(most) => most,
    };
    let every = rows.len().div_ceil(ROWS).max(1);
    let rows: Vec<Vec<f64>> = rows.iter().step_by(every).cloned().collect();
    let logs: Vec<usize> = logs.iter().step_by(every).copied().collect();
    let Ok(plan) = FoldPlan::new(&logs, Folds::K(FOLDS), GUARD) else {
        // Too little data to compare anything.
        return Ok(1);
    };
    let candidates = candidates(most, rows.len());
    let scores: Result<Vec<Vec<f64>>, Error> = candidates
        .par_iter()
        .map(|&count| held_out(params, count, &rows, &logs, &plan))
        .collect();
    Ok(candidates[simplest_of_the_best(&scores?)])
}

/// The first candidate that the best one does not beat by more than one standard error of their
/// difference over the folds (the one-standard-error rule of Breiman et al. 1984): components that
/// only fit the logs at hand would raise false alarms on the next.
fn simplest_of_the_best(scores: &[Vec<f64>]) -> usize {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let mut best = 0;
    for index in 1..scores.len() {
        if mean(&scores[index]) > mean(&scores[best]) {
            best = index;
        }
    }
    let equals_best = |index: &usize| {
        let differences: Vec<f64> = scores[best]
            .iter()
            .zip(&scores[*index])
            .map(|(b, c)| b - c)
            .collect();
        let average = mean(&differences);
        let folds = differences.len() as f64;
        let variance: f64 = differences.iter().map(|d| (d - average).powi(2)).sum();
        average <= (variance / (folds - 1.0) / folds).sqrt()
    };
    (0..best).find(equals_best).unwrap_or(best)
}

/// 1, 2, 3, 5, 8, ...: each must leave ten rows to a component.
fn candidates(most: usize, rows: usize) -> Vec<usize> {
    let mut candidates = vec![1];
    let mut next = (2, 3);
    while next.0 <= most && next.0 * 10 <= rows {
        candidates.push(next.0);
        next = (next.1, next.0 + next.1);
    }
    candidates
}

/// Per fold, the mean log-density of its likeliest rows.
fn held_out(
    params: &GaussianMixtureParams,
    count: usize,
    rows: &[Vec<f64>],
    logs: &[usize],
    plan: &FoldPlan,
) -> Result<Vec<f64>, Error> {
    let params = GaussianMixtureParams {
        components: Components::Fixed(count),
        restarts: 1,
        ..params.clone()
    }
    .check()?;
    let mut scores = Vec::with_capacity(plan.folds());
    for fold in 0..plan.folds() {
        let train = plan.train(fold);
        if train.len() < count.max(2) {
            return Ok(vec![super::LOG_DENSITY_FLOOR; plan.folds()]);
        }
        let fitted = params.fit_rows(
            &train.iter().map(|&i| rows[i].clone()).collect::<Vec<_>>(),
            &train.iter().map(|&i| logs[i]).collect::<Vec<_>>(),
        )?;
        let held_out = plan.held_out(fold).into_iter();
        let mut densities: Vec<f64> = held_out.map(|i| fitted.log_density(&rows[i])).collect();
        densities.sort_by(f64::total_cmp);
        let kept = &densities[((1.0 - KEPT) * densities.len() as f64) as usize..];
        scores.push(kept.iter().sum::<f64>() / kept.len() as f64);
    }
    Ok(scores)
}

#[cfg(test)]
mod tests {
    use super::{candidates, simplest_of_the_best};

    #[test]
    fn a_gain_within_one_standard_error_does_not_count() {
        let base = vec![1.0, 2.0, 3.0, 4.0];
        let plus = |gains: [f64; 4]| {
            base.iter()
                .zip(gains)
                .map(|(b, g)| b + g)
                .collect::<Vec<_>>()
        };
        // Gains 1, -1, 1, -0.5: mean 0.125, standard error 0.515.
        let noisy = plus([1.0, -1.0, 1.0, -0.5]);
        assert_eq!(simplest_of_the_best(&[base.clone(), noisy]), 0);
        // Gains 0.1, 0.2, 0.1, 0.2: mean 0.15, standard error 0.029.
        let steady = plus([0.1, 0.2, 0.1, 0.2]);
        assert_eq!(simplest_of_the_best(&[base.clone(), steady]), 1);
        assert_eq!(simplest_of_the_best(&[base]), 0);
    }

    #[test]
    fn candidates_grow_as_far_as_asked_and_as_rows_allow() {
        assert_eq!(candidates(8, 1000), [1, 2, 3, 5, 8]);
        assert_eq!(candidates(7, 1000), [1, 2, 3, 5]);
        assert_eq!(candidates(100, 35), [1, 2, 3]);
        assert_eq!(candidates(1, 5), [1]);
    }
}
