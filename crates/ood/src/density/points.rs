//! The trusted rows themselves, in a metric: what kernels and neighbours measure distances in.

use super::covariance::{Covariance, CovarianceKind, Factor, Shrinkage, estimate};
use super::expect_columns;
use super::standardizer::Standardizer;
use crate::error::{Error, expect_len, expect_table};
use ndarray::{Array1, Array2};
use rand::SeedableRng;
use rand::seq::index::sample;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// In which metric distances between rows are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Metric {
    /// Columns divided by their standard deviation.
    Standardised,
    /// Whitened by the covariance of all rows, Ledoit-Wolf shrunk (Mahalanobis distance).
    #[default]
    Whitened,
}

/// Rows with their metric. Reading one from a file checks it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub(super) struct Points {
    standardizer: Standardizer,
    /// Of the standardised columns.
    covariance: Covariance,
    /// Standardised rows.
    rows: Vec<Vec<f64>>,
    factor: Factor,
    whitened: Array2<f64>,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    standardizer: Standardizer,
    covariance: Covariance,
    rows: Vec<Vec<f64>>,
}

impl Points {
    /// Standardises, measures the metric on all rows, and keeps at most `max_rows` of them, drawn
    /// by `seed` and left in order.
    pub fn fit(
        rows: &[Vec<f64>],
        metric: Metric,
        variance_floor: f64,
        max_rows: usize,
        seed: u64,
    ) -> Result<Self, Error> {
        let standardizer = Standardizer::fit(rows)?;
        let table = standardizer.apply_all(rows);
        let ones = Array1::ones(rows.len());
        let d = standardizer.dimension();
        let covariance = match metric {
            Metric::Standardised => Covariance::Diagonal(vec![1.0; d]),
            Metric::Whitened => estimate(
                &table,
                ones.view(),
                CovarianceKind::Full,
                Shrinkage::LedoitWolf,
                variance_floor,
            ),
        };
        let mut kept: Vec<usize> = (0..rows.len()).collect();
        if rows.len() > max_rows {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            kept = sample(&mut rng, rows.len(), max_rows).into_vec();
            kept.sort_unstable();
        }
        let rows = kept.iter().map(|&i| table.row(i).to_vec()).collect();
        Self::new(standardizer, covariance, rows)
    }

    fn new(
        standardizer: Standardizer,
        covariance: Covariance,
        rows: Vec<Vec<f64>>,
    ) -> Result<Self, Error> {
        standardizer.validate()?;
        let d = standardizer.dimension();
        expect_len(
            "columns of the stored rows",
            d,
            expect_table("stored rows", &rows)?,
        )?;
        let factor = covariance.factor(d)?;
        let whitened: Vec<f64> = rows.iter().flat_map(|row| factor.whiten(row)).collect();
        let whitened =
            Array2::from_shape_vec((rows.len(), d), whitened).map_err(linfa::Error::NdShape)?;
        Ok(Self {
            standardizer,
            covariance,
            rows,
            factor,
            whitened,
        })
    }

    pub fn dimension(&self) -> usize {
        self.standardizer.dimension()
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Squared distances of a raw vector to every row.
    pub fn squared_distances(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(
            x.len(),
            self.dimension(),
            "entries of a vector of statistics"
        );
        let y = self.factor.whiten(&self.standardizer.apply(x));
        self.whitened
            .outer_iter()
            .map(|row| row.iter().zip(&y).map(|(a, b)| (a - b).powi(2)).sum())
            .collect()
    }

    /// What has to be taken off a log-density in the metric's columns to get one in raw columns.
    pub fn log_jacobian(&self) -> f64 {
        self.standardizer.log_jacobian() + self.factor.half_log_det
    }

    /// The same rows, some columns of them.
    pub fn select(&self, columns: &[usize]) -> Result<Self, Error> {
        let d = self.dimension();
        expect_columns(columns, d)?;
        let pick = |row: &Vec<f64>| columns.iter().map(|&c| row[c]).collect();
        Self::new(
            self.standardizer.select(columns)?,
            self.covariance.select(columns, d)?,
            self.rows.iter().map(pick).collect(),
        )
    }
}

impl TryFrom<Stored> for Points {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        Self::new(stored.standardizer, stored.covariance, stored.rows)
    }
}

impl From<Points> for Stored {
    fn from(points: Points) -> Self {
        Self {
            standardizer: points.standardizer,
            covariance: points.covariance,
            rows: points.rows,
        }
    }
}
