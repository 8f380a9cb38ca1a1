//! Robust linear regression without intercept, with standard errors that know of neighbours in time.

use crate::statistics::quantile_sorted;
use nalgebra::{DMatrix, DVector};

/// Residuals beyond this many robust standard deviations count by their size, not by its square (Huber 1964).
const HUBER: f64 = 1.345;
/// Rounds of reweighting; more move a coefficient by less than a hundredth of its error.
const ROUNDS: usize = 10;
/// A regressor of a smaller root mean square says nothing.
const SMALLEST_REGRESSOR: f64 = 1e-7;
/// A target scatters by at least this much (metres per pose).
const SMALLEST_SCATTER: f64 = 1e-7;
/// Share of the regressors' variance that is added to it.
const RIDGE: f64 = 1e-8;
/// Elements before and after, 2 s at 10 Hz, with which a residual is correlated.
const NEIGHBOURS: usize = 20;
/// Standard error of a coefficient that the data do not show.
pub(super) const UNKNOWN: f64 = 1e6;

/// A fit, able to tell what its coefficients would be for another target under the same weights.
pub(super) struct Regression<'a> {
    regressors: &'a [Vec<f64>],
    scale: Vec<f64>,
    weights: Vec<f64>,
    inverse: DMatrix<f64>,
    pub coefficients: Vec<f64>,
    /// Robust standard deviation of the residuals.
    pub scatter: f64,
}

impl<'a> Regression<'a> {
    /// `regressors` are as long as `target`, not empty.
    pub fn fit(regressors: &'a [Vec<f64>], target: &[f64]) -> Self {
        let count = target.len() as f64;
        let size = |series: &Vec<f64>| {
            let square = series.iter().map(|x| x * x).sum::<f64>() / count;
            Some(square.sqrt()).filter(|s| *s > SMALLEST_REGRESSOR)
        };
        let mut fit = Self {
            // A regressor that never moves is multiplied by 0.
            scale: regressors
                .iter()
                .map(|r| size(r).map_or(0.0, f64::recip))
                .collect(),
            regressors,
            weights: vec![1.0; target.len()],
            inverse: DMatrix::zeros(0, 0),
            coefficients: Vec::new(),
            scatter: 0.0,
        };
        for _ in 0..ROUNDS {
            fit.inverse = fit.inverse_moments();
            fit.coefficients = fit.solve(target);
            let residuals = fit.residuals(target);
            let mut sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
            sizes.sort_by(f64::total_cmp);
            fit.scatter = (1.4826 * quantile_sorted(&sizes, 0.5)).max(SMALLEST_SCATTER);
            fit.weights = residuals
                .iter()
                .map(|r| (HUBER * fit.scatter / r.abs()).min(1.0))
                .collect();
        }
        fit
    }

    /// Coefficients for another target, with the weights of this one.
    pub fn solve(&self, target: &[f64]) -> Vec<f64> {
        let d = self.scale.len();
        let right = DVector::from_fn(d, |i, _| {
            let terms = target
                .iter()
                .enumerate()
                .map(|(t, y)| self.weights[t] * self.at(i, t) * y);
            terms.sum::<f64>()
        });
        let scaled = &self.inverse * right;
        (0..d).map(|i| scaled[i] * self.scale[i]).collect()
    }

    fn at(&self, regressor: usize, t: usize) -> f64 {
        self.regressors[regressor][t] * self.scale[regressor]
    }

    fn residuals(&self, target: &[f64]) -> Vec<f64> {
        let predicted = |t: usize| -> f64 {
            let terms = self.regressors.iter().zip(&self.coefficients);
            terms.map(|(r, b)| r[t] * b).sum()
        };
        let all = target.iter().enumerate();
        all.map(|(t, y)| y - predicted(t)).collect()
    }

    fn inverse_moments(&self) -> DMatrix<f64> {
        let d = self.scale.len();
        let count = self.weights.len();
        let mut moments = DMatrix::from_fn(d, d, |i, j| {
            (0..count)
                .map(|t| self.weights[t] * self.at(i, t) * self.at(j, t))
                .sum::<f64>()
        });
        let ridge = RIDGE * count as f64;
        (0..d).for_each(|i| moments[(i, i)] += ridge);
        let identity = DMatrix::identity(d, d);
        moments
            .cholesky()
            .map_or(DMatrix::zeros(d, d), |c| c.solve(&identity))
    }

    /// Of the coefficients, for the target they were fitted to. Newey and West (1987): neighbours in time are wrong
    /// together.
    pub fn standard_errors(&self, target: &[f64]) -> Vec<f64> {
        let residuals = self.residuals(target);
        let (d, count) = (self.scale.len(), residuals.len());
        let pull = |i: usize, t: usize| self.weights[t] * residuals[t] * self.at(i, t);
        let meat = DMatrix::from_fn(d, d, |i, j| {
            let with = |lag: usize| -> f64 {
                let pairs = lag..count;
                pairs
                    .map(|t| pull(i, t) * pull(j, t - lag) + pull(j, t) * pull(i, t - lag))
                    .sum()
            };
            let reach = NEIGHBOURS.min(count - 1);
            let taper = |lag: usize| 1.0 - lag as f64 / (NEIGHBOURS + 1) as f64;
            0.5 * with(0) + (1..=reach).map(|lag| taper(lag) * with(lag)).sum::<f64>()
        });
        let covariance = &self.inverse * meat * &self.inverse;
        let of = |i: usize| match self.scale[i] {
            0.0 => UNKNOWN,
            scale => (covariance[(i, i)].max(0.0).sqrt() * scale).min(UNKNOWN),
        };
        (0..d).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(k: f64, count: usize) -> Vec<f64> {
        (0..count).map(|t| (k * t as f64).sin()).collect()
    }

    #[test]
    fn outliers_do_not_move_the_coefficients() {
        let regressors = [wave(0.31, 400), wave(1.7, 400), vec![0.0; 400]];
        let noise = wave(2.9, 400);
        let mut target: Vec<f64> = (0..400)
            .map(|t| 2.0 * regressors[0][t] - 0.5 * regressors[1][t] + 0.01 * noise[t])
            .collect();
        target[17] += 50.0;
        target[250] -= 80.0;
        let fit = Regression::fit(&regressors, &target);
        let errors = fit.standard_errors(&target);
        assert!(
            (fit.coefficients[0] - 2.0).abs() < 0.01,
            "{:?}",
            fit.coefficients
        );
        assert!(
            (fit.coefficients[1] + 0.5).abs() < 0.01,
            "{:?}",
            fit.coefficients
        );
        assert!(errors[0] < 0.01 && errors[0] > 1e-5, "{errors:?}");
        // A regressor that is not there: no coefficient, no claim.
        assert_eq!((fit.coefficients[2], errors[2]), (0.0, UNKNOWN));
        let again = fit.solve(&target);
        assert!((again[0] - fit.coefficients[0]).abs() < 1e-6);
    }

    #[test]
    fn a_target_that_never_moves_is_fitted_by_zeros() {
        let regressors = [wave(0.3, 50), vec![1.0; 50]];
        let fit = Regression::fit(&regressors, &[0.0; 50]);
        assert_eq!(fit.coefficients, [0.0, 0.0]);
        assert!(
            fit.standard_errors(&[0.0; 50])
                .iter()
                .all(|e| e.is_finite())
        );
    }
}
