//! The joint network: one noise estimator for all six axes of a body's motion.
//!
//! It sees increments as six numbers a step (translation, then rotation tangent, in units of a scale for each axis),
//! noised at a level of its own for each axis, which it is told. It is a stack of dilated convolutions along time with
//! residuals, modulated by the levels: no attention, no normalisation, so that any length will do and what a step
//! sees ends [`JointConfig::reach`] steps from it.
//!
//! ```text
//! c   = [sin(2^k pi/4 v), cos(2^k pi/4 v)]  for k = 0..4, of the seven conditions v      [56]
//! e   = silu(linear2(silu(linear1(c))))                                                  [embedding]
//! g_i, b_i = film(e), a pair for every block i                                           [width] each
//! h   = stem(x)                                     three taps                           [length, width]
//! h  += out_i(silu(conv_i(h) (1 + g_i) + b_i))      three taps d_i apart, then one       [length, width]
//! F   = last(silu(h))                                                                    [length, 6]
//! ```
//!
//! Beyond both ends of a sequence there are zeros. What F means is up to the caller (`dose3_diffusion::joint`).

mod config;
mod noise_model;
mod parameters;

pub use config::{CONDITIONS, FEATURES, JOINT_AXES, JointConfig, condition_features};
pub use noise_model::{JointInput, JointNoiseModel};
pub use parameters::JointParameters;
