//! Sums over time from which every regression of the predictor is solved.
//!
//! All of them regress one entry of the same vector on some of its others: every channel at every lag. So one
//! matrix of products a group of logs holds them all, and leaving a group out costs a sum of matrices.

use super::{CHANNELS_IN, Channels, Features, LAGS, REACH};
use nalgebra::{DMatrix, DVector};

/// Entries of the vector: channel by channel, lags -3 to 3.
pub(super) const ENTRIES: usize = CHANNELS_IN * LAGS;

/// Share of the mean variance of the regressors that is added to each (ridge).
const RIDGE: f64 = 1e-3;
/// Least ridge, in squared scaled units: regressors that never vary get weight 0, not a singular system.
const LEAST_RIDGE: f64 = 1e-9;

/// The vector at `t`; beyond either end of the series its first or last element stands in.
pub(super) fn entries(series: &[Channels], t: usize) -> [f64; ENTRIES] {
    let last = series.len() - 1;
    let mut entries = [0.0; ENTRIES];
    for lag in 0..LAGS {
        let at = (t + lag).saturating_sub(REACH).min(last);
        for (channel, value) in series[at].iter().enumerate() {
            entries[channel * LAGS + lag] = *value;
        }
    }
    entries
}

/// Count, sums and sums of products (upper triangle, rows first) of the vectors.
#[derive(Clone)]
pub(super) struct Sums {
    pub rows: usize,
    sums: Vec<f64>,
    products: Vec<f64>,
}

impl Sums {
    pub fn none() -> Self {
        Self {
            rows: 0,
            sums: vec![0.0; ENTRIES],
            products: vec![0.0; ENTRIES * ENTRIES],
        }
    }

    /// Adds every element of a series whose lags all lie within it.
    pub fn push(&mut self, series: &[Channels]) {
        for t in REACH..series.len().saturating_sub(REACH) {
            let row = entries(series, t);
            self.rows += 1;
            for (i, x) in row.iter().enumerate() {
                self.sums[i] += x;
                let products = &mut self.products[i * ENTRIES + i..(i + 1) * ENTRIES];
                for (sum, y) in products.iter_mut().zip(&row[i..]) {
                    *sum += x * y;
                }
            }
        }
    }

    pub fn add(&mut self, other: &Self) {
        self.rows += other.rows;
        let sums = self.sums.iter_mut().zip(&other.sums);
        let products = self.products.iter_mut().zip(&other.products);
        sums.chain(products).for_each(|(a, b)| *a += b);
    }

    fn mean(&self, i: usize) -> f64 {
        self.sums[i] / self.rows as f64
    }

    fn covariance(&self, i: usize, j: usize) -> f64 {
        let (i, j) = (i.min(j), i.max(j));
        self.products[i * ENTRIES + j] / self.rows as f64 - self.mean(i) * self.mean(j)
    }

    /// Ridge regression of entry `target` on those named: intercept, weights, and the root mean square of
    /// what is left. There must be rows.
    pub fn regress(&self, target: usize, features: &Features) -> (f64, Vec<f64>, f64) {
        let d = features.len();
        let mut matrix = DMatrix::from_fn(d, d, |i, j| self.covariance(features[i], features[j]));
        let right = DVector::from_fn(d, |i, _| self.covariance(features[i], target));
        let plain = matrix.clone();
        let ridge = (RIDGE * matrix.trace() / d as f64).max(LEAST_RIDGE);
        for i in 0..d {
            matrix[(i, i)] += ridge;
        }
        // A covariance plus a ridge is positive definite; should rounding say otherwise, predict the mean.
        let weights = match matrix.cholesky() {
            Some(factor) => factor.solve(&right),
            None => DVector::zeros(d),
        };
        let explained = features.iter().zip(weights.iter());
        let intercept = self.mean(target) - explained.map(|(&f, w)| w * self.mean(f)).sum::<f64>();
        let left = self.covariance(target, target) - 2.0 * weights.dot(&right)
            + weights.dot(&(&plain * &weights));
        (
            intercept,
            weights.iter().copied().collect(),
            left.max(0.0).sqrt(),
        )
    }
}
