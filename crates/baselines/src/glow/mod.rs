//! Glow over 1-D sequences, and the likelihood ratio of two of them.
//!
//! Sources: Kingma and Dhariwal 2018, "Glow: generative flow with invertible 1x1 convolutions"
//! (arXiv 1807.03039); Ren et al. 2019, "Likelihood ratios for out-of-distribution detection"
//! (arXiv 1906.02845). Tensors are `[batch, length, channels]`.

mod actnorm;
mod config;
mod coupling;
mod flow;
mod mixing;
mod model;
mod ratio;
mod split;
mod train;

pub use config::GlowConfig;
pub use model::{Glow, Latents};
pub use ratio::GlowRatio;
