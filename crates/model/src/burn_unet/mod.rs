//! The networks on burn: their definition, the reference for faster implementations, and the road to GPUs.
//!
//! One file per block. Tensors inside are `[batch, channels, length]`, as in PyTorch;
//! field names and their order are those of the [`ParameterLayout`](crate::ParameterLayout),
//! so that a module's path is the parameter's name.

mod attention;
mod backend;
mod block;
mod conv;
mod gradients;
mod joint;
mod model;
mod norm;
mod resample;
mod source;
mod time;
mod unet;

pub use backend::Backend;
pub use joint::{BurnJoint, JointNetwork};
pub use model::BurnModel;
pub use unet::UNet;
