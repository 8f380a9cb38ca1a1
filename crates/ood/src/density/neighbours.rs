//! Distance to the k-th nearest trusted row, as a density.

use super::em::{at_least_one, out_of_range};
use super::points::{Metric, Points};
use super::{Density, floored};
use crate::error::Error;
use crate::special::ln_gamma;
use serde::{Deserialize, Serialize};

/// A distance below this counts as this, so that a repeated row has a finite density.
const NEAREST: f64 = 1e-6;

/// Settings of a nearest-neighbour density.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NeighbourParams {
    /// Which neighbour; at least 1.
    pub k: usize,
    /// Metric of the distance.
    pub metric: Metric,
    /// Added to the variances of the metric; in (0, 1].
    pub variance_floor: f64,
    /// Rows kept at most, drawn by `seed`.
    pub max_rows: usize,
    /// Seed of the rows kept.
    pub seed: u64,
}

impl Default for NeighbourParams {
    fn default() -> Self {
        Self {
            k: 5,
            metric: Metric::Whitened,
            variance_floor: 1e-3,
            max_rows: 4000,
            seed: 0,
        }
    }
}

/// The density `k / (n V r_k^d)`, where `r_k` is the distance to the k-th nearest of n rows and V the
/// volume of the unit ball (Loftsgaarden and Quesenberry 1965). It falls strictly with the distance,
/// so its score ranks as the distance does. It does not integrate to 1, and its marginals are those of
/// the rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct NeighbourDensity {
    points: Points,
    k: usize,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    points: Points,
    k: usize,
}

impl NeighbourDensity {
    /// Fits to raw rows.
    ///
    /// # Errors
    /// [`Error::Parameter`] for bad settings; [`Error::Shape`], [`Error::NotFinite`],
    /// [`Error::TooFew`] for bad rows.
    pub fn fit(rows: &[Vec<f64>], params: &NeighbourParams) -> Result<Self, Error> {
        at_least_one("k of nearest neighbours", params.k)?;
        let floor = params.variance_floor;
        if !(floor > 0.0 && floor <= 1.0) {
            return Err(out_of_range("variance_floor", floor, "must lie in (0, 1]"));
        }
        let points = Points::fit(rows, params.metric, floor, params.max_rows, params.seed)?;
        Self::new(points, params.k)
    }

    fn new(points: Points, k: usize) -> Result<Self, Error> {
        if k == 0 || points.len() < k {
            return Err(Error::TooFew {
                what: "rows for the k-th nearest neighbour",
                needed: k.max(1),
                found: points.len(),
                hint: "give more trusted data or a smaller k",
            });
        }
        Ok(Self { points, k })
    }

    /// Distance to the k-th nearest row, in the metric.
    ///
    /// # Panics
    /// If `x` has the wrong number of entries.
    #[must_use]
    pub fn distance(&self, x: &[f64]) -> f64 {
        let mut squared = self.points.squared_distances(x);
        let (_, kth, _) = squared.select_nth_unstable_by(self.k - 1, f64::total_cmp);
        kth.sqrt()
    }

    /// The density of some columns.
    ///
    /// # Errors
    /// As [`Density::marginal`].
    pub fn marginal(&self, columns: &[usize]) -> Result<Self, Error> {
        Self::new(self.points.select(columns)?, self.k)
    }
}

impl Density for NeighbourDensity {
    fn dimension(&self) -> usize {
        self.points.dimension()
    }

    fn log_density(&self, x: &[f64]) -> f64 {
        let distance = self.distance(x);
        if distance.is_nan() {
            return super::LOG_DENSITY_FLOOR;
        }
        let d = self.dimension() as f64;
        let volume = 0.5 * d * std::f64::consts::PI.ln() - ln_gamma(0.5 * d + 1.0);
        let share = (self.k as f64 / self.points.len() as f64).ln();
        floored(share - volume - d * distance.max(NEAREST).ln() - self.points.log_jacobian())
    }

    fn marginal(&self, columns: &[usize]) -> Result<Box<dyn Density>, Error> {
        Ok(Box::new(NeighbourDensity::marginal(self, columns)?))
    }
}

impl TryFrom<Stored> for NeighbourDensity {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        Self::new(stored.points, stored.k)
    }
}

impl From<NeighbourDensity> for Stored {
    fn from(density: NeighbourDensity) -> Self {
        Self {
            points: density.points,
            k: density.k,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params(k: usize) -> NeighbourParams {
        NeighbourParams {
            k,
            metric: Metric::Standardised,
            ..NeighbourParams::default()
        }
    }

    #[test]
    fn distance_and_density_by_hand() {
        // Rows -1 and 1 have mean 0 and scale 1.
        let rows = [vec![-1.0], vec![1.0]];
        let first = NeighbourDensity::fit(&rows, &params(1)).unwrap();
        let second = NeighbourDensity::fit(&rows, &params(2)).unwrap();
        assert_eq!(first.distance(&[4.0]), 3.0);
        assert_eq!(second.distance(&[4.0]), 5.0);
        // k / (n V r) = 1 / (2 * 2 * 3).
        assert!((first.log_density(&[4.0]) - (1.0_f64 / 12.0).ln()).abs() < 1e-12);
        assert!(NeighbourDensity::fit(&rows, &params(3)).is_err());
        assert!(NeighbourDensity::fit(&rows, &params(0)).is_err());
    }

    #[test]
    fn repeated_rows_and_outliers_stay_finite() {
        let rows = vec![vec![2.0, 3.0]; 8];
        let density = NeighbourDensity::fit(&rows, &NeighbourParams::default()).unwrap();
        let at = density.log_density(&[2.0, 3.0]);
        assert!(at.is_finite());
        for x in [3.0, 1e12, f64::MAX, f64::NAN] {
            let value = density.log_density(&[x, 3.0]);
            assert!(value.is_finite() && value < at, "{x}: {value}");
        }
    }
}
