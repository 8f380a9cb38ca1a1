//! The networks on burn: their definition, the reference for faster implementations, and the road to GPUs.
//!
//! One file per block. Tensors inside are `[batch, length, channels]`, so that a convolution is one matrix product;
//! field names and their order are those of the [`ParameterLayout`](crate::ParameterLayout),
//! so that a module's path is the parameter's name.

mod attention;
mod backend;
mod block;
mod conv;
mod flat;
mod gradients;
mod joint;
mod model;
mod norm;
mod resample;
mod source;
mod time;
mod unet;

pub use backend::Backend;
pub use flat::{Flat, FlatNetwork};
pub use gradients::gradient;
pub use joint::{BurnJoint, JointNetwork};
pub use model::{BurnModel, BurnNetwork, download};
pub use unet::UNet;
