//! Densities over vectors of statistics, all behind [`Density`] and one storable [`DensityModel`].
//!
//! All take raw statistics: the standardisation is part of the density, its Jacobian included, so a
//! log-density is one in the units of the statistics.

mod config;
mod covariance;
mod em;
mod factor;
mod kernel;
mod mixture;
mod neighbours;
mod points;
mod seeding;
mod selection;
mod standardizer;

pub use config::DensityConfig;
pub use covariance::{Covariance, CovarianceKind, Shrinkage};
pub use em::{Components, GaussianMixtureParams, GaussianMixtureValidParams};
pub use kernel::{Bandwidth, KernelDensity, KernelParams};
pub use mixture::{Component, GaussianMixture};
pub use neighbours::{NeighbourDensity, NeighbourParams};
pub use points::Metric;
pub(crate) use seeding::Start;
pub use standardizer::Standardizer;

use crate::error::{Error, expect_finite, expect_len};
use crate::score::Score;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// No log-density is lower: a point so far out that its square overflows, or one that is not a
/// number, gets this value. It is finite, so that means over a log stay finite.
pub const LOG_DENSITY_FLOOR: f64 = -1e300;

/// A density over vectors of statistics.
pub trait Density: Send + Sync {
    /// Entries of a vector.
    fn dimension(&self) -> usize;

    /// Natural logarithm of the density at `x`, raw statistics; never NaN nor infinite, at least
    /// [`LOG_DENSITY_FLOOR`].
    ///
    /// # Panics
    /// If `x` does not have [`dimension`](Self::dimension) entries. Where `x` comes from outside,
    /// use [`DensityModel::score`], which checks.
    fn log_density(&self, x: &[f64]) -> f64;

    /// The density of some of the columns, in the order given.
    ///
    /// # Errors
    /// [`Error::Column`] for an index out of range or named twice, [`Error::TooFew`] for none.
    fn marginal(&self, columns: &[usize]) -> Result<Box<dyn Density>, Error>;
}

/// Buffers that a log-density is computed in; holds nothing that a result depends on.
#[derive(Clone, Debug, Default)]
pub struct DensityWorkspace {
    z: Vec<f64>,
    centred: Vec<f64>,
    terms: Vec<f64>,
}

/// Any of the densities, as stored in a detector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum DensityModel {
    /// Gaussian mixture.
    Mixture(GaussianMixture),
    /// Gaussian kernels at the trusted rows.
    Kernel(KernelDensity),
    /// Distance to the k-th nearest trusted row.
    Neighbours(NeighbourDensity),
}

impl DensityModel {
    /// Fits to the rows of trusted windows. `logs[i]` names the log that row `i` comes from; rows of
    /// one log must be in order of time. Same input, same result, for any number of threads.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::NotFinite`], [`Error::TooFew`] for bad rows, [`Error::Parameter`]
    /// for bad settings.
    pub fn fit(rows: &[Vec<f64>], logs: &[usize], config: &DensityConfig) -> Result<Self, Error> {
        Ok(config.fit_from(rows, logs, &Start::default())?.0)
    }

    /// The score of one vector: minus its log-density.
    ///
    /// # Errors
    /// [`Error::Shape`] and [`Error::NotFinite`].
    pub fn score(&self, x: &[f64]) -> Result<Score, Error> {
        self.score_with(x, &mut DensityWorkspace::default())
    }

    /// As [`score`](Self::score); for a mixture without an allocation once `work` has been used.
    ///
    /// # Errors
    /// As [`score`](Self::score).
    pub fn score_with(&self, x: &[f64], work: &mut DensityWorkspace) -> Result<Score, Error> {
        expect_len("a vector of statistics", self.dimension(), x.len())?;
        expect_finite("a vector of statistics", x)?;
        let log_density = match self {
            Self::Mixture(mixture) => mixture.log_density_with(x, work),
            Self::Kernel(_) | Self::Neighbours(_) => self.log_density(x),
        };
        Ok(Score::from_log_density(log_density))
    }

    /// Scores of many vectors, in parallel.
    ///
    /// # Errors
    /// [`Error::Shape`] and [`Error::NotFinite`].
    pub fn scores(&self, rows: &[Vec<f64>]) -> Result<Vec<Score>, Error> {
        rows.par_iter().map(|row| self.score(row)).collect()
    }

    /// The density of some of the columns, as a model that can be stored.
    ///
    /// # Errors
    /// As [`Density::marginal`].
    pub fn marginal_model(&self, columns: &[usize]) -> Result<Self, Error> {
        Ok(match self {
            Self::Mixture(m) => Self::Mixture(m.marginal(columns)?),
            Self::Kernel(m) => Self::Kernel(m.marginal(columns)?),
            Self::Neighbours(m) => Self::Neighbours(m.marginal(columns)?),
        })
    }

    fn inner(&self) -> &dyn Density {
        match self {
            Self::Mixture(m) => m,
            Self::Kernel(m) => m,
            Self::Neighbours(m) => m,
        }
    }
}

impl Density for DensityModel {
    fn dimension(&self) -> usize {
        self.inner().dimension()
    }

    fn log_density(&self, x: &[f64]) -> f64 {
        self.inner().log_density(x)
    }

    fn marginal(&self, columns: &[usize]) -> Result<Box<dyn Density>, Error> {
        Ok(Box::new(self.marginal_model(columns)?))
    }
}

/// Checks the columns of a marginal.
fn expect_columns(columns: &[usize], dimension: usize) -> Result<(), Error> {
    if columns.is_empty() {
        return Err(Error::TooFew {
            what: "columns of a marginal density",
            needed: 1,
            found: 0,
            hint: "name at least one column",
        });
    }
    for (i, &column) in columns.iter().enumerate() {
        if column >= dimension || columns[..i].contains(&column) {
            return Err(Error::Column { column, dimension });
        }
    }
    Ok(())
}

/// ln(sum(exp(terms))) without overflow; minus infinity for no terms.
pub(crate) fn log_sum_exp(terms: &[f64]) -> f64 {
    log_sum_exp_of(terms.iter().copied())
}

/// The same of terms that are not kept.
pub(crate) fn log_sum_exp_of(terms: impl Iterator<Item = f64> + Clone) -> f64 {
    let max = terms.clone().fold(f64::NEG_INFINITY, f64::max);
    if max == f64::NEG_INFINITY {
        return max;
    }
    max + terms.map(|t| (t - max).exp()).sum::<f64>().ln()
}

/// Keeps a log-density within its range; NaN becomes the floor.
fn floored(log_density: f64) -> f64 {
    log_density.max(LOG_DENSITY_FLOOR)
}
