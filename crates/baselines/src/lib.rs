//! The learned baselines that the paper compares with, on burn: [`GlowRatio`] and [`Jem`].
//!
//! Both see windows of poses as plain numbers ([`Sequences`]): they know no poses and no files.
//! Scores follow the project's convention, higher = more out of distribution. Everything random
//! comes from ChaCha8 generators seeded by the caller (burn's own generator is never drawn from),
//! so the same windows, configuration and seed give the same bytes.
#![doc = include_str!("../README.md")]

mod error;
pub mod glow;
pub mod jem;
mod layers;
mod optimise;
mod progress;
mod random;
mod sequences;
mod source;
mod standardise;
mod store;

pub use dose3_model::Precision;
pub use error::Error;
pub use glow::{Glow, GlowConfig, GlowRatio};
pub use jem::{Divergence, Jem, JemConfig, Manoeuvres, Motion, Outcome, TrainReport};
pub use progress::Progress;
pub use sequences::Sequences;
pub use standardise::Standardizer;
pub use store::{annotate, annotation};

/// The score of a window so far away that f32 overflows on the way to its density or energy.
///
/// Finite, so that it can be ranked and written, and beyond any score that can be computed.
pub const FAR: f64 = 1e30;
