#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod angle_table;
mod coefficients;
mod heat_kernel;
pub mod igso3;
pub mod pose;
pub mod project;
pub mod se3;
pub mod so3;
pub mod wrapped_normal;

pub use nalgebra;

pub use igso3::{IgSo3, SigmaError};
pub use pose::Pose;
pub use project::{Projected, ProjectionError};
pub use wrapped_normal::WrappedNormal;

/// A rotation, stored as its 3x3 matrix.
pub type Rotation = nalgebra::Rotation3<f64>;

/// A vector of R^3: a position or translation in metres, or a rotation vector (tangent of SO(3)) in radians.
pub type Vector = nalgebra::Vector3<f64>;

/// A 3x3 matrix, not necessarily a rotation.
pub type Matrix = nalgebra::Matrix3<f64>;

/// A tangent vector of SE(3), `[rho, phi]`: three entries in metres, then three in radians.
pub type Twist = nalgebra::Vector6<f64>;
