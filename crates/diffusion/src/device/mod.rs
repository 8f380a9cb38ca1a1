//! Training where the network lies, on a device of burn: a GPU with `wgpu`.
//!
//! Parameters, Adam's moments and the moving average stay there. The losses are the closed forms of the host
//! ([`crate::geodesic_loss`]) as tensors, in f32.

mod adam;
mod joint;
mod learner;
mod loss;
mod network;
mod so3;

pub(crate) use joint::JointDeviceLearner;
pub use learner::DeviceLearner;
