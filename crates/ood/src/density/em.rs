//! Fitting a Gaussian mixture: expectation-maximisation behind linfa's `Fit`.
//!
//! linfa-clustering's own mixture has no public log-density, no log-sum-exp (a far point becomes an
//! infinite responsibility) and restarts that do not start anew, so the iteration is written here and
//! linfa gives the traits, the data set and k-means.

use super::covariance::{Covariance, CovarianceKind, Factor, Shrinkage, estimate};
use super::mixture::{Component, GaussianMixture};
use super::standardizer::Standardizer;
use super::{log_sum_exp, seeding, selection};
use crate::error::{Error, expect_len};
use linfa::prelude::{DatasetBase, Fit};
use ndarray::{Array1, Array2, ArrayBase, Axis, Data, Ix2};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A responsibility below this changes no digit of a component.
const NO_PART: f64 = 1e-16;

/// How many Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Components {
    /// This many.
    Fixed(usize),
    /// Out of 1, 2, 3, 5, 8, 13, ... up to this many, the smallest number that comes within one
    /// standard error of the highest log-likelihood of rows held out by log.
    HeldOut(usize),
}

/// Settings of a mixture fit, not yet checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GaussianMixtureParams {
    /// Number of components; `Fixed(5)` unless said otherwise.
    pub components: Components,
    /// Shape of the covariances.
    pub covariance: CovarianceKind,
    /// Shrinkage of full covariances.
    pub shrinkage: Shrinkage,
    /// Added to every variance of the standardised columns; in (0, 1], 1e-3 unless said otherwise.
    pub variance_floor: f64,
    /// Starts from different seeds, of which the likeliest is kept; at least 1.
    pub restarts: usize,
    /// Most EM iterations of a start; at least 1.
    pub max_iterations: usize,
    /// A start has converged when the mean log-likelihood of a row changes by less; positive.
    pub tolerance: f64,
    /// Seed of the starts.
    pub seed: u64,
}

impl Default for GaussianMixtureParams {
    fn default() -> Self {
        Self {
            components: Components::Fixed(5),
            covariance: CovarianceKind::Full,
            shrinkage: Shrinkage::LedoitWolf,
            variance_floor: 1e-3,
            restarts: 3,
            max_iterations: 200,
            tolerance: 1e-4,
            seed: 0,
        }
    }
}

/// Checked settings: only these can be fitted with.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianMixtureValidParams(GaussianMixtureParams);

impl GaussianMixtureValidParams {
    /// The settings.
    #[must_use]
    pub fn params(&self) -> &GaussianMixtureParams {
        &self.0
    }
}

impl GaussianMixtureParams {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming the setting and its range.
    pub fn check(self) -> Result<GaussianMixtureValidParams, Error> {
        let (Components::Fixed(count) | Components::HeldOut(count)) = self.components;
        at_least_one("components of a mixture", count)?;
        at_least_one("restarts of a mixture", self.restarts)?;
        at_least_one("iterations of a mixture", self.max_iterations)?;
        // Written so that NaN fails as well.
        let floor = self.variance_floor;
        if !(floor > 0.0 && floor <= 1.0) {
            return Err(out_of_range("variance_floor", floor, "must lie in (0, 1]"));
        }
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return Err(out_of_range(
                "tolerance",
                self.tolerance,
                "must be positive",
            ));
        }
        self.shrinkage.check()?;
        Ok(GaussianMixtureValidParams(self))
    }
}

/// A count that must not be zero.
pub(super) fn at_least_one(name: &'static str, value: usize) -> Result<(), Error> {
    if value == 0 {
        return Err(Error::Parameter {
            name,
            value: value.to_string(),
            expected: "must be at least 1",
        });
    }
    Ok(())
}

/// The error of a real setting.
pub(super) fn out_of_range(name: &'static str, value: f64, expected: &'static str) -> Error {
    Error::Parameter {
        name,
        value: value.to_string(),
        expected,
    }
}

/// Raw rows as records, the log that each row comes from as target.
impl<D: Data<Elem = f64>> Fit<ArrayBase<D, Ix2>, Array1<usize>, Error>
    for GaussianMixtureValidParams
{
    type Object = GaussianMixture;

    fn fit(
        &self,
        dataset: &DatasetBase<ArrayBase<D, Ix2>, Array1<usize>>,
    ) -> Result<GaussianMixture, Error> {
        let rows: Vec<Vec<f64>> = dataset.records().outer_iter().map(|r| r.to_vec()).collect();
        self.fit_rows(&rows, &dataset.targets().to_vec())
    }
}

impl GaussianMixtureValidParams {
    /// As [`Fit::fit`], from rows.
    pub(super) fn fit_rows(
        &self,
        rows: &[Vec<f64>],
        logs: &[usize],
    ) -> Result<GaussianMixture, Error> {
        Ok(self.fit_from(rows, logs, None)?.0)
    }

    /// As [`Fit::fit`], from rows, with the cluster of each row that EM started from. Where `start` names the
    /// clusters, it is the only start; clusters without rows give no component.
    pub(super) fn fit_from(
        &self,
        rows: &[Vec<f64>],
        logs: &[usize],
        start: Option<&[usize]>,
    ) -> Result<(GaussianMixture, Vec<usize>), Error> {
        expect_len("logs of the trusted rows", rows.len(), logs.len())?;
        let standardizer = Standardizer::fit(rows)?;
        let count = match start {
            Some(clusters) => {
                expect_len("clusters of the trusted rows", rows.len(), clusters.len())?;
                clusters.iter().max().map_or(1, |&last| last + 1)
            }
            None => selection::count(&self.0, rows, logs)?,
        };
        let needed = count.max(2);
        if rows.len() < needed {
            return Err(Error::TooFew {
                what: "trusted windows for a mixture",
                needed,
                found: rows.len(),
                hint: "give more trusted data, a smaller stride or fewer components",
            });
        }
        let table = standardizer.apply_all(rows);
        let starts: Result<Vec<_>, Error> = match start {
            Some(clusters) => em(&table, count, &self.0, clusters.to_vec()).map(|f| vec![f]),
            None => (0..self.0.restarts)
                .into_par_iter()
                .map(|start| {
                    let seed = start_seed(self.0.seed, start);
                    let clusters = seeding::clusters(&table, count, seed)?;
                    em(&table, count, &self.0, clusters)
                })
                .collect(),
        };
        // The first of equals, so that the result does not hang on the order of threads.
        let mut best: Option<Fitted> = None;
        for fitted in starts? {
            if best
                .as_ref()
                .is_none_or(|b| fitted.log_likelihood > b.log_likelihood)
            {
                best = Some(fitted);
            }
        }
        let (components, clusters) = best
            .map(|best| (best.components, best.clusters))
            .unwrap_or_default();
        let components = components.into_iter().map(|(component, _)| component);
        let mixture = GaussianMixture::new(standardizer, components.collect())?;
        Ok((mixture, clusters))
    }
}

/// An own generator for every start.
fn start_seed(seed: u64, start: usize) -> u64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(start as u64);
    rng.next_u64()
}

struct Fitted {
    components: Vec<(Component, Factor)>,
    /// The cluster of each row that it started from.
    clusters: Vec<usize>,
    /// Mean log-likelihood of a standardised row.
    log_likelihood: f64,
}

/// One start: M and E steps from hard clusters until the likelihood settles.
fn em(
    rows: &Array2<f64>,
    count: usize,
    params: &GaussianMixtureParams,
    clusters: Vec<usize>,
) -> Result<Fitted, Error> {
    let mut responsibilities = Array2::zeros((rows.nrows(), count));
    for (mut row, &cluster) in responsibilities.outer_iter_mut().zip(&clusters) {
        row[cluster] = 1.0;
    }
    let mut log_likelihood = f64::NEG_INFINITY;
    let mut components = Vec::new();
    for _ in 0..params.max_iterations {
        components = maximisation(rows, &responsibilities, params)?;
        let before = log_likelihood;
        (responsibilities, log_likelihood) = expectation(rows, &components);
        if (log_likelihood - before).abs() < params.tolerance {
            break;
        }
    }
    Ok(Fitted {
        components,
        clusters,
        log_likelihood,
    })
}

/// Responsibilities `[rows, components]` and the mean log-likelihood of a row.
fn expectation(rows: &Array2<f64>, components: &[(Component, Factor)]) -> (Array2<f64>, f64) {
    let d = rows.ncols();
    let constant = -0.5 * d as f64 * std::f64::consts::TAU.ln();
    let mut terms = Array2::zeros((rows.nrows(), components.len()));
    for (mut column, (component, factor)) in terms.columns_mut().into_iter().zip(components) {
        let centred = rows - &Array1::from_vec(component.mean.clone());
        let offset = component.weight.ln() + constant - factor.half_log_det;
        let whitened = factor.whiten_all(&centred);
        for (term, y) in column.iter_mut().zip(whitened.outer_iter()) {
            *term = offset - 0.5 * y.dot(&y);
        }
    }
    let mut total = 0.0;
    for mut row in terms.outer_iter_mut() {
        let log_density = log_sum_exp(&row.to_vec());
        total += log_density;
        row.mapv_inplace(|term| (term - log_density).exp());
    }
    (terms, total / rows.nrows() as f64)
}

/// Weights, means and covariances. A component that is left with less than one row is dropped: it
/// has nothing to estimate a covariance from. In many columns components hardly share rows, so only the
/// rows that a component has a part in are looked at.
fn maximisation(
    rows: &Array2<f64>,
    responsibilities: &Array2<f64>,
    params: &GaussianMixtureParams,
) -> Result<Vec<(Component, Factor)>, Error> {
    let mut components = Vec::new();
    for column in responsibilities.columns() {
        if column.sum() < 1.0 - 1e-9 {
            continue;
        }
        let own: Vec<usize> = (0..rows.nrows()).filter(|&i| column[i] > NO_PART).collect();
        let weights = column.select(Axis(0), &own);
        let mut centred = rows.select(Axis(0), &own);
        let total = weights.sum();
        let mean = weights.dot(&centred) / total;
        centred -= &mean;
        let (covariance, factor) = floored_estimate(&centred, weights.view(), params)?;
        let component = Component {
            weight: total,
            mean: mean.to_vec(),
            covariance,
        };
        components.push((component, factor));
    }
    let total: f64 = components.iter().map(|(c, _)| c.weight).sum();
    for (component, _) in &mut components {
        component.weight /= total;
    }
    Ok(components)
}

/// The covariance of a component. Where rounding leaves it without a Cholesky factor (columns that
/// repeat each other at very different scales), the floor is raised until it has one.
fn floored_estimate(
    centred: &Array2<f64>,
    weights: ndarray::ArrayView1<'_, f64>,
    params: &GaussianMixtureParams,
) -> Result<(Covariance, Factor), Error> {
    let mut floor = params.variance_floor;
    loop {
        let covariance = estimate(centred, weights, params.covariance, params.shrinkage, floor);
        match covariance.factor(centred.ncols()) {
            Ok(factor) => return Ok((covariance, factor)),
            Err(error) if floor > 1e6 => return Err(error),
            Err(_) => floor *= 10.0,
        }
    }
}
