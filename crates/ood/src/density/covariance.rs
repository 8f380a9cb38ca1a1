//! Covariances, their shrinkage and their factors.

use super::em::out_of_range;
use super::expect_columns;
use super::factor::inverse_factor;
use crate::error::{Error, expect_finite};
use ndarray::{Array1, Array2, ArrayView1};
use serde::{Deserialize, Serialize};

/// The shape of a covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CovarianceKind {
    /// All entries.
    #[default]
    Full,
    /// Variances only.
    Diagonal,
}

/// How a full covariance is drawn towards `mean variance * I` (in standardised columns).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shrinkage {
    /// Not at all, apart from the variance floor.
    None,
    /// By the amount that minimises the expected squared error (Ledoit and Wolf 2004).
    #[default]
    LedoitWolf,
    /// By a fixed amount in [0, 1].
    Fixed(f64),
}

impl Shrinkage {
    pub(super) fn check(self) -> Result<(), Error> {
        match self {
            // Written so that NaN fails as well.
            Self::Fixed(amount) if !(0.0..=1.0).contains(&amount) => {
                Err(out_of_range("shrinkage", amount, "must lie in [0, 1]"))
            }
            _ => Ok(()),
        }
    }
}

/// A covariance of `d` columns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Covariance {
    /// Lower triangle, row by row: `d (d + 1) / 2` entries.
    Full(Vec<f64>),
    /// Variances.
    Diagonal(Vec<f64>),
}

impl Covariance {
    /// Packs the lower triangle of a symmetric matrix.
    pub(super) fn pack(matrix: &Array2<f64>) -> Self {
        let d = matrix.nrows();
        Self::Full(
            (0..d)
                .flat_map(|i| (0..=i).map(move |j| matrix[[i, j]]))
                .collect(),
        )
    }

    fn entry(lower: &[f64], i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j), i.min(j));
        lower[i * (i + 1) / 2 + j]
    }

    /// The covariance of some columns.
    pub(super) fn select(&self, columns: &[usize], dimension: usize) -> Result<Self, Error> {
        expect_columns(columns, dimension)?;
        Ok(match self {
            Self::Diagonal(v) => Self::Diagonal(columns.iter().map(|&c| v[c]).collect()),
            Self::Full(lower) => {
                let mut packed = Vec::new();
                for (i, &a) in columns.iter().enumerate() {
                    packed.extend(columns[..=i].iter().map(|&b| Self::entry(lower, a, b)));
                }
                Self::Full(packed)
            }
        })
    }

    /// Inverse of the Cholesky factor and half the log-determinant.
    pub(super) fn factor(&self, dimension: usize) -> Result<Factor, Error> {
        let not_positive = || Error::NotPositiveDefinite {
            what: "a covariance of a density",
        };
        match self {
            Self::Diagonal(variances) => {
                crate::error::expect_len("variances", dimension, variances.len())?;
                expect_finite("variances", variances)?;
                if variances.iter().any(|&v| v <= 0.0) {
                    return Err(not_positive());
                }
                Ok(Factor {
                    half_log_det: variances.iter().map(|v| 0.5 * v.ln()).sum(),
                    inverse: Inverse::Diagonal(
                        variances.iter().map(|v| v.sqrt().recip()).collect(),
                    ),
                })
            }
            Self::Full(lower) => {
                let entries = dimension * (dimension + 1) / 2;
                crate::error::expect_len("entries of a covariance", entries, lower.len())?;
                expect_finite("a covariance", lower)?;
                let (inverse, half_log_det) =
                    inverse_factor(lower, dimension).ok_or_else(not_positive)?;
                Ok(Factor {
                    half_log_det,
                    inverse: Inverse::Lower(inverse),
                })
            }
        }
    }
}

/// `L^-1` of a covariance `L L^T`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Factor {
    inverse: Inverse,
    /// ln det(L).
    pub half_log_det: f64,
}

#[derive(Clone, Debug, PartialEq)]
enum Inverse {
    Lower(Array2<f64>),
    Diagonal(Array1<f64>),
}

impl Factor {
    /// `L^-1 x`, whose squared norm is the squared Mahalanobis distance.
    pub fn whiten(&self, x: &[f64]) -> Vec<f64> {
        match &self.inverse {
            Inverse::Diagonal(inverse) => x.iter().zip(inverse).map(|(x, s)| x * s).collect(),
            Inverse::Lower(inverse) => (0..x.len())
                .map(|i| {
                    let row = inverse.row(i);
                    x[..=i].iter().zip(row).map(|(x, l)| x * l).sum()
                })
                .collect(),
        }
    }

    /// The squared norm of [`whiten`](Self::whiten), summed in the same order without a vector.
    pub fn squared_distance(&self, x: &[f64]) -> f64 {
        match &self.inverse {
            Inverse::Diagonal(inverse) => {
                let whitened = x.iter().zip(inverse).map(|(x, s)| x * s);
                whitened.map(|y| y * y).sum()
            }
            Inverse::Lower(inverse) => (0..x.len())
                .map(|i| {
                    let row = inverse.row(i);
                    let y: f64 = x[..=i].iter().zip(row).map(|(x, l)| x * l).sum();
                    y * y
                })
                .sum(),
        }
    }

    /// `L^-1 x` for every row `x`.
    pub fn whiten_all(&self, rows: &Array2<f64>) -> Array2<f64> {
        match &self.inverse {
            Inverse::Diagonal(inverse) => rows * inverse,
            Inverse::Lower(inverse) => rows.dot(&inverse.t()),
        }
    }
}

/// Weighted covariance of `centred` rows (mean already taken off), shrunk, with `floor` added to
/// each variance. `weights` need not sum to 1.
pub(super) fn estimate(
    centred: &Array2<f64>,
    weights: ArrayView1<'_, f64>,
    kind: CovarianceKind,
    shrinkage: Shrinkage,
    floor: f64,
) -> Covariance {
    let total = weights.sum();
    let d = centred.ncols();
    if kind == CovarianceKind::Diagonal {
        let mut variances = vec![0.0; d];
        for (row, &weight) in centred.outer_iter().zip(weights) {
            for (sum, x) in variances.iter_mut().zip(row) {
                *sum += weight * x * x;
            }
        }
        return Covariance::Diagonal(variances.iter().map(|v| v / total + floor).collect());
    }
    let mut scaled = centred.clone();
    for (mut row, &weight) in scaled.outer_iter_mut().zip(weights) {
        row *= weight.sqrt();
    }
    let mut matrix = scaled.t().dot(&scaled) / total;
    let amount = match shrinkage {
        Shrinkage::None => 0.0,
        Shrinkage::Fixed(amount) => amount,
        Shrinkage::LedoitWolf => ledoit_wolf(centred, weights, &matrix),
    };
    let mean_variance = matrix.diag().sum() / d as f64;
    matrix *= 1.0 - amount;
    for variance in matrix.diag_mut() {
        *variance += amount * mean_variance + floor;
    }
    Covariance::pack(&matrix)
}

/// The optimal amount of shrinkage towards `mean variance * I`: Ledoit and Wolf, "A well-conditioned
/// estimator for large-dimensional covariance matrices" (2004), lemma 3.2 and onwards, `b^2 / d^2`.
/// With unequal weights the number of rows becomes `(sum w)^2 / sum w^2`.
fn ledoit_wolf(centred: &Array2<f64>, weights: ArrayView1<'_, f64>, matrix: &Array2<f64>) -> f64 {
    let d = matrix.nrows() as f64;
    let total = weights.sum();
    let mean_variance = matrix.diag().sum() / d;
    let squared_norm = matrix.iter().map(|v| v * v).sum::<f64>();
    let spread = (squared_norm / d - mean_variance * mean_variance).max(0.0);
    // sum w |x x^T - S|^2 = sum w |x|^4 - W |S|^2, since sum w x x^T = W S.
    let fourth: f64 = centred
        .outer_iter()
        .zip(weights)
        .map(|(row, &w)| w * row.dot(&row).powi(2))
        .sum();
    let rows = total * total / weights.iter().map(|w| w * w).sum::<f64>();
    let error = ((fourth / total - squared_norm) / d / rows).max(0.0);
    if error >= spread { 1.0 } else { error / spread }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn whitening_gives_the_mahalanobis_distance_by_hand() {
        // [[4, 2], [2, 3]] = L L^T with L = [[2, 0], [1, sqrt 2]].
        let covariance = Covariance::Full(vec![4.0, 2.0, 3.0]);
        let factor = covariance.factor(2).unwrap();
        assert!((factor.half_log_det - 0.5 * 8.0_f64.ln()).abs() < 1e-15);
        let w = factor.whiten(&[2.0, 3.0]);
        assert!((w[0] - 1.0).abs() < 1e-15 && (w[1] - 2.0_f64.sqrt()).abs() < 1e-15);
        assert_eq!(
            factor.squared_distance(&[2.0, 3.0]),
            w.iter().map(|y| y * y).sum::<f64>()
        );
        let all = factor.whiten_all(&array![[2.0, 3.0]]);
        assert!((all[[0, 1]] - w[1]).abs() < 1e-15);
        // The marginal of the second column, and a swap.
        let second = covariance.select(&[1], 2).unwrap();
        assert_eq!(second, Covariance::Full(vec![3.0]));
        let swapped = covariance.select(&[1, 0], 2).unwrap();
        assert_eq!(swapped, Covariance::Full(vec![3.0, 2.0, 4.0]));
        assert!(Covariance::Full(vec![1.0, 2.0, 1.0]).factor(2).is_err());
        assert!(Covariance::Diagonal(vec![1.0, 0.0]).factor(2).is_err());
    }

    #[test]
    fn ledoit_wolf_by_hand() {
        // Rows (+-2, 0), (0, +-1): S = diag(2, 1/2), mean variance 5/4, |S|^2 = 17/4.
        // d^2 = 17/8 - 25/16 = 9/16. Mean |x|^4 = (16 + 1)/2 = 17/2, so
        // b^2 = (17/2 - 17/4) / 2 / 4 = 17/32. Amount 17/18.
        let rows = array![[2.0, 0.0], [-2.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        let weights = Array1::ones(4);
        let plain = rows.t().dot(&rows) / 4.0;
        let amount = ledoit_wolf(&rows, weights.view(), &plain);
        assert!((amount - 17.0 / 18.0).abs() < 1e-12, "{amount}");
        let Covariance::Full(entries) = estimate(
            &rows,
            weights.view(),
            CovarianceKind::Full,
            Shrinkage::LedoitWolf,
            0.0,
        ) else {
            panic!("asked for a full covariance");
        };
        assert!((entries[0] - (2.0 / 18.0 + 17.0 / 18.0 * 1.25)).abs() < 1e-12);
        assert!((entries[2] - (0.5 / 18.0 + 17.0 / 18.0 * 1.25)).abs() < 1e-12);
    }

    #[test]
    fn doubled_weights_change_nothing_and_zero_weights_drop_rows() {
        let rows = array![[1.0, 0.5], [-1.0, 2.0], [0.3, -1.0], [9.0, 9.0]];
        let of = |weights: Array1<f64>, rows: &Array2<f64>| {
            let kind = CovarianceKind::Full;
            estimate(rows, weights.view(), kind, Shrinkage::LedoitWolf, 1e-3)
        };
        let three = rows.slice(ndarray::s![..3, ..]).to_owned();
        let Covariance::Full(a) = of(array![1.0, 1.0, 1.0], &three) else {
            panic!()
        };
        let Covariance::Full(b) = of(array![2.0, 2.0, 2.0, 0.0], &rows) else {
            panic!()
        };
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < 1e-12);
        }
    }
}
