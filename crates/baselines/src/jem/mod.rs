//! JEM: a classifier whose logits are also an energy.
//!
//! Source: Grathwohl et al. 2020, "Your classifier is secretly an energy based model and you
//! should treat it like one" (arXiv 1912.03263). With logits `f(x)`, `p(y|x)` is their softmax
//! and `E(x) = -logsumexp f(x)` an unnormalised negative log-density. Tensors are
//! `[batch, length, channels]`.

mod classifier;
mod config;
mod langevin;
mod manoeuvres;
mod model;
mod train;

pub use config::JemConfig;
pub use manoeuvres::{Manoeuvres, Motion};
pub use model::Jem;
pub use train::{Divergence, Outcome, TrainReport};
