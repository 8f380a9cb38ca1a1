//! The process of the joint network: the motion of a body, a noise level of its own for each axis.
//!
//! A step is the increment of a pose: the translation u (3 numbers) and the rotation R = exp(w). With a scale s for
//! each axis (metres and radians that count as 1, of the trusted logs) and levels sigma, also one for each axis,
//!
//! ```text
//! u_t = u + s sigma eps,    R_t = R exp(s sigma eps),    eps ~ N(0, 1) for each axis,
//! ```
//!
//! a sum on R^3 and the group product on SO(3): R = R_t exp(-s sigma eps) undoes it exactly. An axis of level 0 is
//! clean; so what one branch says of the other, or all axes of one, is a choice of levels ([`Levels`]).
//!
//! The network sees `x_t = (u_t / s, log(R_t) / s)` and says F, from which the clean step is estimated (Karras et al.
//! 2022, with the data at unit size):
//!
//! ```text
//! D = c_skip x_t + c_out F(c_in x_t),    c_skip = 1 / (1 + sigma^2),    c_in = (1 + sigma^2)^-1/2,    c_out = sigma c_in.
//! ```
//!
//! Input and target `(x_0 - c_skip x_t) / c_out` are of unit size at every level; the denoising error is
//! `F - target`, which is `(D - x_0) / c_out`.

mod batch;
mod learner;
mod levels;
mod process;
mod trainer;

#[cfg(feature = "burn")]
pub(crate) use batch::Batch;
#[cfg(feature = "burn")]
pub(crate) use learner::JointLearner;
pub use levels::{Levels, time_condition};
pub use process::{AXES, JointProcess, Noised, standard_normal};
pub use trainer::{JointSet, JointTrainConfig, JointTrainRow, JointTrainer};
