#![doc = include_str!("../README.md")]

mod config;
mod error;
pub mod joint;
mod layout;
mod noise_model;
mod parameters;
mod tensors;
mod time_features;
mod weights;

pub use config::{PairConfig, UNetConfig};
pub use error::ModelError;
pub use layout::{Init, ParameterLayout, ParameterSpec};
pub use noise_model::{Input, LossGradient, NoiseModel};
pub use parameters::{NetworkConfig, PairParameters, Parameters, check_count, check_values};
pub use tensors::{NamedTensor, Precision, TensorFile, write_tensors};
pub use time_features::{sinusoidal, sinusoidal_into};
pub use weights::CONFIG_KEY;

#[cfg(feature = "burn")]
pub mod burn_unet;
