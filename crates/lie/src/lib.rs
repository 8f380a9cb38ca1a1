#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod coefficients;
pub mod pose;
pub mod project;
pub mod se3;
pub mod so3;

pub use pose::Pose;
pub use project::{Projected, ProjectionError};

/// A rotation, stored as its 3x3 matrix.
pub type Rotation = nalgebra::Rotation3<f64>;

/// A vector of R^3: a position or translation in metres, or a rotation vector (tangent of SO(3)) in radians.
pub type Vector = nalgebra::Vector3<f64>;

/// A 3x3 matrix, not necessarily a rotation.
pub type Matrix = nalgebra::Matrix3<f64>;

/// A tangent vector of SE(3), `[rho, phi]`: three entries in metres, then three in radians.
pub type Twist = nalgebra::Vector6<f64>;
