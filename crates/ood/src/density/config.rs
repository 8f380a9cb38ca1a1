//! Which density, with its settings.

use super::em::Components;
use super::{
    Bandwidth, CovarianceKind, DensityModel, GaussianMixtureParams, KernelDensity, KernelParams,
    NeighbourDensity, NeighbourParams, Start, selection,
};
use crate::error::{Error, expect_len, expect_table};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// A density before it is fitted. Short forms for the command line: `mixture`, `mixture:8`,
/// `mixture:auto`, `mixture:5:diagonal`, `kernel`, `kernel:silverman`, `kernel:0.4`, `neighbours`,
/// `neighbours:3`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum DensityConfig {
    /// Gaussian mixture.
    Mixture(GaussianMixtureParams),
    /// Gaussian kernels at the trusted rows.
    Kernel(KernelParams),
    /// Distance to the k-th nearest trusted row.
    Neighbours(NeighbourParams),
}

impl Default for DensityConfig {
    fn default() -> Self {
        Self::Mixture(GaussianMixtureParams::default())
    }
}

impl DensityConfig {
    /// Largest number of components that `mixture:auto` considers.
    pub const AUTO_COMPONENTS: usize = 13;

    /// The same with another seed.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        match &mut self {
            Self::Mixture(p) => p.seed = seed,
            Self::Kernel(p) => p.seed = seed,
            Self::Neighbours(p) => p.seed = seed,
        }
        self
    }

    /// Settles what is chosen by the data (the number of components of a mixture), so that folds
    /// and the final fit share the choice.
    ///
    /// # Errors
    /// As [`DensityModel::fit`].
    pub fn resolve(&self, rows: &[Vec<f64>], logs: &[usize]) -> Result<Self, Error> {
        expect_table("trusted rows", rows)?;
        expect_len("logs of the trusted rows", rows.len(), logs.len())?;
        let mut resolved = self.clone();
        if let Self::Mixture(params) = &mut resolved {
            let checked = params.clone().check()?;
            params.components = Components::Fixed(selection::count(checked.params(), rows, logs)?);
        }
        Ok(resolved)
    }

    /// See [`DensityModel::fit`]; from `start` where it holds one. The start is that of the fit.
    pub(crate) fn fit_from(
        &self,
        rows: &[Vec<f64>],
        logs: &[usize],
        start: &Start,
    ) -> Result<(DensityModel, Start), Error> {
        expect_len("logs of the trusted rows", rows.len(), logs.len())?;
        let model = match self {
            Self::Mixture(params) => {
                let params = params.clone().check()?;
                let (mixture, clusters) = params.fit_from(rows, logs, start.clusters())?;
                return Ok((DensityModel::Mixture(mixture), Start::of(clusters)));
            }
            Self::Kernel(params) => DensityModel::Kernel(KernelDensity::fit(rows, params)?),
            Self::Neighbours(params) => {
                DensityModel::Neighbours(NeighbourDensity::fit(rows, params)?)
            }
        };
        Ok((model, Start::default()))
    }
}

impl FromStr for DensityConfig {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let wrong = || Error::Parameter {
            name: "density",
            value: text.to_owned(),
            expected: "one of mixture[:N|:auto][:full|:diagonal], kernel[:scott|:silverman|:WIDTH], neighbours[:K]",
        };
        let mut parts = text.trim().split(':');
        let kind = parts.next().unwrap_or_default();
        let mut config = match kind {
            "mixture" => Self::Mixture(GaussianMixtureParams::default()),
            "kernel" => Self::Kernel(KernelParams::default()),
            "neighbours" => Self::Neighbours(NeighbourParams::default()),
            _ => return Err(wrong()),
        };
        for part in parts {
            match (&mut config, part) {
                (Self::Mixture(p), "auto") => {
                    p.components = Components::HeldOut(Self::AUTO_COMPONENTS);
                }
                (Self::Mixture(p), "full") => p.covariance = CovarianceKind::Full,
                (Self::Mixture(p), "diagonal") => p.covariance = CovarianceKind::Diagonal,
                (Self::Mixture(p), n) => {
                    p.components = Components::Fixed(n.parse().map_err(|_| wrong())?);
                }
                (Self::Kernel(p), "scott") => p.bandwidth = Bandwidth::Scott,
                (Self::Kernel(p), "silverman") => p.bandwidth = Bandwidth::Silverman,
                (Self::Kernel(p), width) => {
                    p.bandwidth = Bandwidth::Fixed(width.parse().map_err(|_| wrong())?);
                }
                (Self::Neighbours(p), k) => p.k = k.parse().map_err(|_| wrong())?,
            }
        }
        Ok(config)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_forms() {
        let mixture = |text: &str| match text.parse() {
            Ok(DensityConfig::Mixture(p)) => p,
            other => panic!("{text}: {other:?}"),
        };
        assert_eq!(mixture("mixture").components, Components::Fixed(5));
        assert_eq!(
            mixture("mixture:8:diagonal").components,
            Components::Fixed(8)
        );
        assert_eq!(
            mixture("mixture:8:diagonal").covariance,
            CovarianceKind::Diagonal
        );
        assert_eq!(mixture("mixture:auto").components, Components::HeldOut(13));
        assert!(
            matches!("kernel:0.5".parse(), Ok(DensityConfig::Kernel(KernelParams { bandwidth: Bandwidth::Fixed(w), .. })) if w == 0.5)
        );
        assert!(matches!(
            "neighbours:3".parse(),
            Ok(DensityConfig::Neighbours(NeighbourParams { k: 3, .. }))
        ));
        for bad in ["", "gmm", "mixture:x", "neighbours:-1", "kernel:wide"] {
            assert!(bad.parse::<DensityConfig>().is_err(), "{bad}");
        }
    }
}
