//! Every column to mean 0 and standard deviation 1.

use super::expect_columns;
use crate::error::{Error, expect_finite, expect_len, expect_table};
use ndarray::Array2;
use serde::{Deserialize, Serialize};

/// A standardised value is clipped to this size: its square and sums of its squares stay finite,
/// whatever the estimator said.
const LIMIT: f64 = 1e100;

/// Column means and scales of the trusted rows.
///
/// A column that does not vary among the trusted rows gets the scale `1e-6 max(1, |mean|)`: equal
/// values stay at 0, rounding does not matter, and a value that does differ is far out, as it should
/// be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Standardizer {
    /// Column means.
    pub mean: Vec<f64>,
    /// Column scales, all positive.
    pub scale: Vec<f64>,
}

impl Standardizer {
    /// Mean and population standard deviation of each column.
    ///
    /// # Errors
    /// As for a bad table: no rows, rows of different lengths, entries that are not finite.
    pub fn fit(rows: &[Vec<f64>]) -> Result<Self, Error> {
        let columns = expect_table("trusted rows", rows)?;
        let count = rows.len() as f64;
        let (mut mean, mut scale) = (Vec::new(), Vec::new());
        for column in 0..columns {
            // Dividing first keeps the sum of huge values finite.
            let average = rows.iter().map(|r| r[column] / count).sum::<f64>();
            let variance = rows
                .iter()
                .map(|r| (r[column] - average).powi(2) / count)
                .sum::<f64>();
            let smallest = 1e-6 * average.abs().max(1.0);
            mean.push(average);
            // An overflowing variance belongs to values near the end of f64; the range is as good.
            let deviation = if variance.is_finite() {
                variance.sqrt()
            } else {
                f64::MAX.sqrt()
            };
            scale.push(deviation.max(smallest));
        }
        Ok(Self { mean, scale })
    }

    /// Number of columns.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.mean.len()
    }

    /// The standardised vector.
    #[must_use]
    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        let mut z = Vec::with_capacity(x.len());
        self.apply_into(x, &mut z);
        z
    }

    /// As [`apply`](Self::apply), in the place of what `out` held.
    pub fn apply_into(&self, x: &[f64], out: &mut Vec<f64>) {
        let columns = x.iter().zip(self.mean.iter().zip(&self.scale));
        out.clear();
        out.extend(columns.map(|(x, (mean, scale))| ((x - mean) / scale).clamp(-LIMIT, LIMIT)));
    }

    /// The standardised table, `[rows, columns]`.
    #[must_use]
    pub fn apply_all(&self, rows: &[Vec<f64>]) -> Array2<f64> {
        let mut table = Array2::zeros((rows.len(), self.dimension()));
        for (mut to, row) in table.outer_iter_mut().zip(rows) {
            to.assign(&ndarray::Array1::from_vec(self.apply(row)));
        }
        table
    }

    /// Sum of the logarithms of the scales: what a standardised log-density is above the raw one.
    #[must_use]
    pub fn log_jacobian(&self) -> f64 {
        self.scale.iter().map(|s| s.ln()).sum()
    }

    /// The standardizer of some columns.
    ///
    /// # Errors
    /// [`Error::Column`], [`Error::TooFew`].
    pub fn select(&self, columns: &[usize]) -> Result<Self, Error> {
        expect_columns(columns, self.dimension())?;
        Ok(Self {
            mean: columns.iter().map(|&c| self.mean[c]).collect(),
            scale: columns.iter().map(|&c| self.scale[c]).collect(),
        })
    }

    /// Checks what a file may have broken.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::NotFinite`], [`Error::Inconsistent`].
    pub fn validate(&self) -> Result<(), Error> {
        expect_len(
            "scales of a standardizer",
            self.mean.len(),
            self.scale.len(),
        )?;
        expect_finite("means of a standardizer", &self.mean)?;
        expect_finite("scales of a standardizer", &self.scale)?;
        if self.mean.is_empty() || self.scale.iter().any(|&s| s <= 0.0) {
            return Err(Error::Inconsistent {
                part: "standardizer",
                reason: "it needs columns, and all scales must be positive".to_owned(),
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_come_out_with_mean_0_and_variance_1() {
        let rows = vec![vec![1.0, 7.0], vec![3.0, 7.0], vec![5.0, 7.0]];
        let s = Standardizer::fit(&rows).unwrap();
        assert_eq!(s.mean, [3.0, 7.0]);
        assert!((s.scale[0] - (8.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        let z = s.apply_all(&rows);
        assert!((z.column(0).sum()).abs() < 1e-12);
        assert!((z.column(0).mapv(|v| v * v).sum() - 3.0).abs() < 1e-12);
        assert!(z.column(1).iter().all(|&v| v == 0.0));
        // A constant column tells a value that differs from rounding.
        assert!(s.apply(&[3.0, 7.0 + 1e-9])[1] < 1e-3);
        assert!(s.apply(&[3.0, 8.0])[1] > 1e4);
    }

    #[test]
    fn huge_values_stay_finite() {
        let rows = vec![vec![1e200], vec![-1e200], vec![1e300]];
        let s = Standardizer::fit(&rows).unwrap();
        s.validate().unwrap();
        assert!(s.apply(&[f64::MAX])[0].is_finite());
        assert!(s.apply(&[f64::INFINITY])[0].is_finite());
    }
}
