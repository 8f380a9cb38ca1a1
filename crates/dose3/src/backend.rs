//! Where the networks run.

use crate::error::{Error, Result};
use dose3_diffusion::ModelPair;
use dose3_diffusion::joint::{JointSet, JointTrainConfig, JointTrainer};
use dose3_diffusion::trainer::LearnerPair;
use dose3_engine::{Engine, EngineOptions, JointEngine};
use dose3_model::joint::{JointConfig, JointParameters};
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
}

impl Backend {
    /// Every backend, whether or not this build holds it.
    pub const ALL: [Self; 4] = [Self::Engine, Self::BurnFlex, Self::Ndarray, Self::Wgpu];
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

    /// Puts both networks there to be trained, with optimisers that clip gradients to a norm of `clip`: on the host for
    /// the engine, on its device for every other backend.
    ///
    /// # Errors
    /// As [`Backend::load`].
    pub fn learners(self, initial: PairParameters, clip: f64) -> Result<LearnerPair> {
        match self.backend {
            Backend::Engine => Ok(LearnerPair::on_host(self.load(&initial)?, initial, clip)),
            other => other.burn_learners(&initial, clip),
        }
    }

    /// Starts training of a joint network there, with its optimiser on the host for the engine, on its device for every
    /// other backend.
    ///
    /// # Errors
    /// As [`Backend::load`]; settings out of range, no sequence as long as the longest that is drawn.
    pub fn joint_trainer<'a>(
        self,
        config: JointTrainConfig,
        network: &JointConfig,
        sets: &'a [JointSet],
    ) -> Result<JointTrainer<'a>> {
        match self.backend {
            Backend::Engine => {
                let initial = JointParameters::init(network, config.seed)?;
                let engine = JointEngine::new(&initial, self.options())?;
                Ok(JointTrainer::new(config, Box::new(engine), sets)?)
            }
            other => other.burn_joint_trainer(config, network, sets),
        }
    }

    fn options(self) -> EngineOptions {
        EngineOptions {
            threads: self.threads,
            ..EngineOptions::default()
        }
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
                other => other.burn_model(p),
            }
        };
        Ok(ModelPair {
            translation: one(&parameters.translation).map_err(|e| self.refused(e))?,
            rotation: one(&parameters.rotation).map_err(|e| self.refused(e))?,
        })
    }

    fn refused(self, reason: Error) -> Error {
        match reason {
            Error::MissingBackend { .. } => reason,
            reason => Error::Backend {
                backend: self,
                reason: Box::new(reason),
            },
        }
    }

    /// That this build does not hold the backend, and which feature it wants.
    fn missing(self) -> Error {
        Error::MissingBackend {
            backend: self,
            feature: match self {
                Self::Engine => "",
                Self::BurnFlex => "flex",
                Self::Ndarray => "ndarray",
                Self::Wgpu => "wgpu",
            },
        }
    }
}

#[cfg(any(feature = "flex", feature = "ndarray", feature = "wgpu"))]
mod burn {
    use super::*;
    use dose3_model::burn_unet::{Backend as Burn, BurnModel};

    impl Backend {
        fn burn(self) -> Result<Burn> {
            let backend = match self {
                Self::Engine | Self::BurnFlex => Burn::Flex,
                Self::Ndarray => Burn::Ndarray,
                Self::Wgpu => Burn::Wgpu,
            };
            match backend.is_compiled() {
                true => Ok(backend),
                false => Err(self.missing()),
            }
        }

        pub(super) fn burn_model(self, parameters: &Parameters) -> Result<Box<dyn NoiseModel>> {
            Ok(Box::new(BurnModel::new(parameters, self.burn()?)?))
        }

        pub(super) fn burn_joint_trainer<'a>(
            self,
            config: JointTrainConfig,
            network: &JointConfig,
            sets: &'a [JointSet],
        ) -> Result<JointTrainer<'a>> {
            let trainer = JointTrainer::on_device(config, network, self.burn()?, sets);
            trainer.map_err(|error| match error {
                dose3_diffusion::Error::Model(reason) => self.refused(reason.into()),
                other => other.into(),
            })
        }

        pub(super) fn burn_learners(
            self,
            initial: &PairParameters,
            clip: f64,
        ) -> Result<LearnerPair> {
            let learners = LearnerPair::on_device(self.burn()?, initial, clip);
            learners.map_err(|e| self.refused(e.into()))
        }
    }
}

#[cfg(not(any(feature = "flex", feature = "ndarray", feature = "wgpu")))]
impl Backend {
    fn burn_joint_trainer<'a>(
        self,
        _: JointTrainConfig,
        _: &JointConfig,
        _: &'a [JointSet],
    ) -> Result<JointTrainer<'a>> {
        Err(self.missing())
    }

    fn burn_model(self, _: &Parameters) -> Result<Box<dyn NoiseModel>> {
        Err(self.missing())
    }

    fn burn_learners(self, _: &PairParameters, _: f64) -> Result<LearnerPair> {
        Err(self.missing())
    }
}
