//! Gaussian mixture: the fitted density.

use super::covariance::{Covariance, Factor};
use super::standardizer::Standardizer;
use super::{Density, DensityWorkspace, expect_columns, floored, log_sum_exp};
use crate::error::{Error, expect_finite, expect_len};
use serde::{Deserialize, Serialize};

/// A Gaussian mixture over standardised statistics. Fitted by
/// [`GaussianMixtureParams`](super::GaussianMixtureParams); reading one from a file checks it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct GaussianMixture {
    standardizer: Standardizer,
    components: Vec<Component>,
    factors: Vec<Factor>,
}

/// One Gaussian of a mixture, in standardised columns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Component {
    /// Share of the mixture, in (0, 1].
    pub weight: f64,
    /// Mean.
    pub mean: Vec<f64>,
    /// Covariance.
    pub covariance: Covariance,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    standardizer: Standardizer,
    components: Vec<Component>,
}

impl GaussianMixture {
    /// A mixture from its parts: components live in the columns that `standardizer` makes.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::NotFinite`], [`Error::NotPositiveDefinite`], or
    /// [`Error::Inconsistent`] for weights that are not positive or do not sum to 1.
    pub fn new(standardizer: Standardizer, components: Vec<Component>) -> Result<Self, Error> {
        standardizer.validate()?;
        let d = standardizer.dimension();
        let mut factors = Vec::with_capacity(components.len());
        for component in &components {
            expect_len("mean of a component", d, component.mean.len())?;
            expect_finite("mean of a component", &component.mean)?;
            factors.push(component.covariance.factor(d)?);
        }
        let total: f64 = components.iter().map(|c| c.weight).sum();
        let positive = components.iter().all(|c| c.weight > 0.0);
        if !positive || (total - 1.0).abs() > 1e-6 {
            return Err(Error::Inconsistent {
                part: "mixture",
                reason: format!("weights must be positive and sum to 1, not {total}"),
            });
        }
        Ok(Self {
            standardizer,
            components,
            factors,
        })
    }

    /// The components, in standardised columns.
    #[must_use]
    pub fn components(&self) -> &[Component] {
        &self.components
    }

    /// What brings raw statistics to the components' columns.
    #[must_use]
    pub fn standardizer(&self) -> &Standardizer {
        &self.standardizer
    }

    /// The mixture of some columns: sub-means and sub-covariances.
    ///
    /// # Errors
    /// As [`Density::marginal`].
    pub fn marginal(&self, columns: &[usize]) -> Result<Self, Error> {
        let d = self.standardizer.dimension();
        expect_columns(columns, d)?;
        let components = self.components.iter().map(|component| {
            Ok(Component {
                weight: component.weight,
                mean: columns.iter().map(|&c| component.mean[c]).collect(),
                covariance: component.covariance.select(columns, d)?,
            })
        });
        Self::new(
            self.standardizer.select(columns)?,
            components.collect::<Result<_, Error>>()?,
        )
    }
}

impl GaussianMixture {
    /// As [`Density::log_density`], without an allocation once `work` has been used.
    ///
    /// # Panics
    /// As [`Density::log_density`].
    pub fn log_density_with(&self, x: &[f64], work: &mut DensityWorkspace) -> f64 {
        assert_eq!(
            x.len(),
            self.dimension(),
            "entries of a vector of statistics"
        );
        let DensityWorkspace { z, centred, terms } = work;
        self.standardizer.apply_into(x, z);
        let constant = -0.5 * x.len() as f64 * std::f64::consts::TAU.ln();
        terms.clear();
        for (component, factor) in self.components.iter().zip(&self.factors) {
            centred.clear();
            centred.extend(z.iter().zip(&component.mean).map(|(z, m)| z - m));
            let squared = factor.squared_distance(centred);
            terms.push(component.weight.ln() + constant - factor.half_log_det - 0.5 * squared);
        }
        floored(log_sum_exp(terms) - self.standardizer.log_jacobian())
    }
}

impl Density for GaussianMixture {
    fn dimension(&self) -> usize {
        self.standardizer.dimension()
    }

    fn log_density(&self, x: &[f64]) -> f64 {
        self.log_density_with(x, &mut DensityWorkspace::default())
    }

    fn marginal(&self, columns: &[usize]) -> Result<Box<dyn Density>, Error> {
        Ok(Box::new(GaussianMixture::marginal(self, columns)?))
    }
}

impl TryFrom<Stored> for GaussianMixture {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        Self::new(stored.standardizer, stored.components)
    }
}

impl From<GaussianMixture> for Stored {
    fn from(mixture: GaussianMixture) -> Self {
        Self {
            standardizer: mixture.standardizer,
            components: mixture.components,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> GaussianMixture {
        GaussianMixture::new(
            Standardizer {
                mean: vec![1.0, 0.0],
                scale: vec![2.0, 1.0],
            },
            vec![
                Component {
                    weight: 0.25,
                    mean: vec![0.0, 0.0],
                    covariance: Covariance::Full(vec![1.0, 0.0, 1.0]),
                },
                Component {
                    weight: 0.75,
                    mean: vec![3.0, 1.0],
                    covariance: Covariance::Full(vec![4.0, 2.0, 3.0]),
                },
            ],
        )
        .unwrap()
    }

    #[test]
    fn log_density_by_hand() {
        // At x = (1, 0), z = (0, 0): first term 0.25 / (2 pi); second: z - m = (-3, -1), whitened
        // (-1.5, 0.5 / sqrt 2), squared 2.375, determinant 8.
        let first = 0.25 / std::f64::consts::TAU;
        let second = 0.75 / (std::f64::consts::TAU * 8.0_f64.sqrt()) * (-0.5 * 2.375_f64).exp();
        let expected = ((first + second) / 2.0).ln();
        assert!((two().log_density(&[1.0, 0.0]) - expected).abs() < 1e-14);
    }

    #[test]
    fn a_marginal_is_the_integral_over_the_other_column() {
        let mixture = two();
        let marginal = mixture.marginal(&[1]).unwrap();
        let step = 0.01;
        for y in [-1.0, 0.0, 2.5] {
            let integral: f64 = (-4000..6000)
                .map(|i| mixture.log_density(&[f64::from(i) * step, y]).exp() * step)
                .sum();
            assert!((marginal.log_density(&[y]) - integral.ln()).abs() < 1e-6);
        }
        assert!(mixture.marginal(&[2]).is_err());
        assert!(mixture.marginal(&[0, 0]).is_err());
        assert!(mixture.marginal(&[]).is_err());
    }

    #[test]
    fn a_far_outlier_is_finite_and_very_low() {
        let mixture = two();
        let near = mixture.log_density(&[1.0, 0.0]);
        let far = mixture.log_density(&[1e9, 0.0]);
        assert!(far.is_finite() && far < -1e15 && far < near);
        // Further out is lower still: the score does not saturate at once.
        assert!(mixture.log_density(&[1e12, 0.0]) < far);
        for x in [f64::MAX, f64::INFINITY, f64::NAN] {
            let value = mixture.log_density(&[x, 0.0]);
            assert!(value.is_finite() && value < -1e100, "{x}: {value}");
        }
    }

    #[test]
    fn a_broken_file_is_an_error() {
        let good = serde_json::to_value(two()).unwrap();
        assert!(serde_json::from_value::<GaussianMixture>(good.clone()).is_ok());
        for (pointer, value) in [
            ("/components/0/weight", serde_json::json!(0.5)),
            ("/components/0/mean", serde_json::json!([0.0])),
            (
                "/components/1/covariance/full",
                serde_json::json!([1.0, 2.0, 1.0]),
            ),
            ("/standardizer/scale/0", serde_json::json!(0.0)),
        ] {
            let mut bad = good.clone();
            *bad.pointer_mut(pointer).unwrap() = value;
            assert!(
                serde_json::from_value::<GaussianMixture>(bad).is_err(),
                "{pointer}"
            );
        }
    }
}
