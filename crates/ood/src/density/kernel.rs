//! Kernel density: a Gaussian at every trusted row.

use super::em::{at_least_one, out_of_range};
use super::points::{Metric, Points};
use super::{Density, floored, log_sum_exp};
use crate::error::Error;
use serde::{Deserialize, Serialize};

/// Width of the kernels in units of the metric, for `n` rows of `d` columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bandwidth {
    /// `n^(-1 / (d + 4))` (Scott 1992).
    #[default]
    Scott,
    /// `(n (d + 2) / 4)^(-1 / (d + 4))` (Silverman 1986).
    Silverman,
    /// This width.
    Fixed(f64),
}

impl Bandwidth {
    fn width(self, rows: usize, columns: usize) -> f64 {
        let (n, d) = (rows as f64, columns as f64);
        let power = -1.0 / (d + 4.0);
        match self {
            Self::Scott => n.powf(power),
            Self::Silverman => (n * (d + 2.0) / 4.0).powf(power),
            Self::Fixed(width) => width,
        }
    }
}

/// Settings of a kernel density.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KernelParams {
    /// Width of the kernels.
    pub bandwidth: Bandwidth,
    /// Metric of the kernels.
    pub metric: Metric,
    /// Added to the variances of the metric; in (0, 1].
    pub variance_floor: f64,
    /// Rows kept at most, drawn by `seed`.
    pub max_rows: usize,
    /// Seed of the rows kept.
    pub seed: u64,
}

impl Default for KernelParams {
    fn default() -> Self {
        Self {
            bandwidth: Bandwidth::Scott,
            metric: Metric::Whitened,
            variance_floor: 1e-3,
            max_rows: 4000,
            seed: 0,
        }
    }
}

/// A fitted kernel density. Its kernels have the metric's covariance times the width squared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct KernelDensity {
    points: Points,
    width: f64,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    points: Points,
    width: f64,
}

impl KernelDensity {
    /// Fits to raw rows.
    ///
    /// # Errors
    /// [`Error::Parameter`] for bad settings; [`Error::Shape`], [`Error::NotFinite`],
    /// [`Error::TooFew`] for bad rows.
    pub fn fit(rows: &[Vec<f64>], params: &KernelParams) -> Result<Self, Error> {
        at_least_one("rows of a kernel density", params.max_rows)?;
        let floor = params.variance_floor;
        if !(floor > 0.0 && floor <= 1.0) {
            return Err(out_of_range("variance_floor", floor, "must lie in (0, 1]"));
        }
        let points = Points::fit(rows, params.metric, floor, params.max_rows, params.seed)?;
        let width = params.bandwidth.width(points.len(), points.dimension());
        Self::new(points, width)
    }

    fn new(points: Points, width: f64) -> Result<Self, Error> {
        if !(width > 1e-6 && width < 1e6) {
            return Err(out_of_range("bandwidth", width, "must lie in (1e-6, 1e6)"));
        }
        Ok(Self { points, width })
    }

    /// Width of the kernels in units of the metric.
    #[must_use]
    pub fn width(&self) -> f64 {
        self.width
    }

    /// The density of some columns; the width stays.
    ///
    /// # Errors
    /// As [`Density::marginal`].
    pub fn marginal(&self, columns: &[usize]) -> Result<Self, Error> {
        Self::new(self.points.select(columns)?, self.width)
    }
}

impl Density for KernelDensity {
    fn dimension(&self) -> usize {
        self.points.dimension()
    }

    fn log_density(&self, x: &[f64]) -> f64 {
        let scale = -0.5 / (self.width * self.width);
        let distances = self.points.squared_distances(x);
        let terms: Vec<f64> = distances.iter().map(|d| d * scale).collect();
        let d = self.dimension() as f64;
        let constant = d * (0.5 * std::f64::consts::TAU.ln() + self.width.ln());
        let rows = (self.points.len() as f64).ln();
        floored(log_sum_exp(&terms) - rows - constant - self.points.log_jacobian())
    }

    fn marginal(&self, columns: &[usize]) -> Result<Box<dyn Density>, Error> {
        Ok(Box::new(KernelDensity::marginal(self, columns)?))
    }
}

impl TryFrom<Stored> for KernelDensity {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        Self::new(stored.points, stored.width)
    }
}

impl From<KernelDensity> for Stored {
    fn from(density: KernelDensity) -> Self {
        Self {
            points: density.points,
            width: density.width,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_kernels_by_hand() {
        // Rows 0 and 4: mean 2, scale 2, so standardised -1 and 1; width 1/2 is 1 in raw units.
        let params = KernelParams {
            bandwidth: Bandwidth::Fixed(0.5),
            metric: Metric::Standardised,
            ..KernelParams::default()
        };
        let density = KernelDensity::fit(&[vec![0.0], vec![4.0]], &params).unwrap();
        let normal = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        for x in [0.0, 1.0, 2.0, 7.0] {
            let expected = (0.5 * (normal(x) + normal(x - 4.0))).ln();
            assert!((density.log_density(&[x]) - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn it_integrates_to_one_and_so_does_its_marginal() {
        let rows: Vec<Vec<f64>> = (0..12)
            .map(|i| {
                let x = f64::from(i * 5 % 12);
                vec![x, 3.0 * x + f64::from(i * 7 % 5)]
            })
            .collect();
        let density = KernelDensity::fit(&rows, &KernelParams::default()).unwrap();
        let mut total = 0.0;
        for i in -100..200 {
            for j in -150..350 {
                let x = [f64::from(i) * 0.2, f64::from(j) * 0.3];
                total += density.log_density(&x).exp() * 0.06;
            }
        }
        assert!((total - 1.0).abs() < 1e-3, "{total}");
        let marginal = density.marginal(&[1]).unwrap();
        let integral: f64 = (-500..1000)
            .map(|i| density.log_density(&[f64::from(i) * 0.05, 20.0]).exp() * 0.05)
            .sum();
        assert!((marginal.log_density(&[20.0]) - integral.ln()).abs() < 1e-6);
    }

    #[test]
    fn widths_by_hand_and_outliers_stay_finite() {
        assert!((Bandwidth::Scott.width(32, 1) - 0.5).abs() < 1e-15);
        assert!((Bandwidth::Silverman.width(24, 2) - 24.0_f64.powf(-1.0 / 6.0)).abs() < 1e-15);
        let rows: Vec<Vec<f64>> = (0..9).map(|i| vec![f64::from(i), 1.0]).collect();
        let density = KernelDensity::fit(&rows, &KernelParams::default()).unwrap();
        for x in [1e9, f64::MAX, f64::NAN] {
            let value = density.log_density(&[x, 1.0]);
            assert!(value.is_finite() && value < -1e9, "{value}");
        }
        for bad in [0.0, -1.0, f64::NAN, 1e9] {
            let params = KernelParams {
                bandwidth: Bandwidth::Fixed(bad),
                ..KernelParams::default()
            };
            assert!(KernelDensity::fit(&rows, &params).is_err());
        }
    }
}
