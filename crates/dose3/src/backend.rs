//! Where the networks run.

use crate::error::{Error, Result};
use dose3_diffusion::ModelPair;
use dose3_engine::{Engine, EngineOptions};
use dose3_model::{NoiseModel, PairParameters, Parameters};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A place to run the networks on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// The built-in CPU engine.
    #[default]
    Engine,
    /// burn on burn-flex (CPU); needs the feature `flex`.
    BurnFlex,
    /// burn on ndarray (CPU); needs the feature `ndarray`.
    Ndarray,
    /// burn on wgpu (Vulkan, Metal, DirectX); needs the feature `wgpu`.
    Wgpu,
    /// burn on CUDA; needs the feature `cuda`.
    Cuda,
}

impl Backend {
    /// Every backend, whether or not this build holds it.
    pub const ALL: [Self; 5] = [
        Self::Engine,
        Self::BurnFlex,
        Self::Ndarray,
        Self::Wgpu,
        Self::Cuda,
    ];
}

impl FromStr for Backend {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let found = Self::ALL.into_iter().find(|b| b.to_string() == text);
        found.ok_or_else(|| Error::UnknownName {
            what: "backend",
            found: text.to_owned(),
            known: Self::ALL.map(|b| b.to_string()).join(", "),
        })
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Engine => "engine",
            Self::BurnFlex => "burn-flex",
            Self::Ndarray => "ndarray",
            Self::Wgpu => "wgpu",
            Self::Cuda => "cuda",
        })
    }
}

/// Where and on how many threads something is computed. Results do not depend on the threads; backends agree to
/// rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Computing {
    /// Where the networks run.
    pub backend: Backend,
    /// Most threads of rayon's current pool that the engine uses at once; 0 for all of them.
    pub threads: usize,
}

impl Computing {
    /// Puts both networks there.
    ///
    /// # Errors
    /// As [`Backend::load`].
    pub fn load(self, parameters: &PairParameters) -> Result<ModelPair> {
        self.backend.load(parameters, self.threads)
    }
}

impl Backend {
    /// Puts both networks on this backend; the engine uses at most `threads` (0: all)
    /// of rayon's current pool.
    ///
    /// # Errors
    /// A backend that this build does not hold, or whose device cannot be had.
    pub fn load(self, parameters: &PairParameters, threads: usize) -> Result<ModelPair> {
        let one = |p: &Parameters| -> Result<Box<dyn NoiseModel>> {
            match self {
                Self::Engine => {
                    let options = EngineOptions {
                        threads,
                        ..EngineOptions::default()
                    };
                    Ok(Box::new(Engine::new(p, options)?))
                }
                other => other.load_burn(p),
            }
        };
        let context = |reason: Error| match reason {
            Error::MissingBackend { .. } => reason,
            reason => Error::Backend {
                backend: self,
                reason: Box::new(reason),
            },
        };
        Ok(ModelPair {
            translation: one(&parameters.translation).map_err(context)?,
            rotation: one(&parameters.rotation).map_err(context)?,
        })
    }

    /// The feature that builds this backend in, and whether this build has it.
    fn feature(self) -> (&'static str, bool) {
        match self {
            Self::Engine => ("", true),
            Self::BurnFlex => ("flex", cfg!(feature = "flex")),
            Self::Ndarray => ("ndarray", cfg!(feature = "ndarray")),
            Self::Wgpu => ("wgpu", cfg!(feature = "wgpu")),
            Self::Cuda => ("cuda", cfg!(feature = "cuda")),
        }
    }

    fn load_burn(self, parameters: &Parameters) -> Result<Box<dyn NoiseModel>> {
        let (feature, built) = self.feature();
        if !built {
            return Err(Error::MissingBackend {
                backend: self,
                feature,
            });
        }
        self.build_burn(parameters)
    }

    #[cfg(any(
        feature = "flex",
        feature = "ndarray",
        feature = "wgpu",
        feature = "cuda"
    ))]
    fn build_burn(self, parameters: &Parameters) -> Result<Box<dyn NoiseModel>> {
        use dose3_model::burn_unet::{Backend as Burn, BurnModel};
        let backend = match self {
            Self::Engine | Self::BurnFlex => Burn::Flex,
            Self::Ndarray => Burn::Ndarray,
            Self::Wgpu => Burn::Wgpu,
            Self::Cuda => Burn::Cuda,
        };
        Ok(Box::new(BurnModel::new(parameters, backend)?))
    }

    #[cfg(not(any(
        feature = "flex",
        feature = "ndarray",
        feature = "wgpu",
        feature = "cuda"
    )))]
    fn build_burn(self, _: &Parameters) -> Result<Box<dyn NoiseModel>> {
        Err(Error::MissingBackend {
            backend: self,
            feature: self.feature().0,
        })
    }
}
