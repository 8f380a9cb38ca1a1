//! The rotation group SO(3).
//!
//! Tangent vectors are rotation vectors: axis times angle, in radians. Formulas and signs follow
//! Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (arXiv 1812.01537).

use nalgebra::UnitQuaternion;

use crate::coefficients::{cotangent_ratio, sinc, sine_defect_ratio, versine_ratio};
pub use crate::project::project;
use crate::{Matrix, Rotation, Vector};

/// Skew-symmetric matrix of `v`: `hat(v) * w` is the cross product of `v` and `w`.
pub fn hat(v: &Vector) -> Matrix {
    v.cross_matrix()
}

/// Inverse of [`hat`]; of any other matrix it reads the skew-symmetric part.
pub fn vee(m: &Matrix) -> Vector {
    0.5 * Vector::new(
        m[(2, 1)] - m[(1, 2)],
        m[(0, 2)] - m[(2, 0)],
        m[(1, 0)] - m[(0, 1)],
    )
}

/// Rotation about the direction of `tangent` by its norm in radians (Rodrigues' formula).
///
/// Norms above pi wrap around. A rotation vector is known only to about `norm * 1e-16` radians, so wrapping
/// costs digits in proportion to the norm; above 1e154, where the norm overflows, the result is NaN.
///
/// ```
/// use dose3_lie::{Vector, so3};
/// let quarter_turn = so3::exp(&Vector::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
/// assert!((quarter_turn * Vector::x() - Vector::y()).norm() < 1e-15);
/// ```
pub fn exp(tangent: &Vector) -> Rotation {
    let angle = tangent.norm();
    let k = hat(tangent);
    Rotation::from_matrix_unchecked(
        Matrix::identity() + k * sinc(angle) + k * k * versine_ratio(angle),
    )
}

/// The shortest rotation vector whose [`exp`] is `rotation`; its norm is in `[0, pi]` radians.
///
/// At an angle of exactly pi two vectors are equally short, `v` and `-v`, and either may come back.
/// Accurate to rounding at every angle, because it goes through the unit quaternion and `atan2`; the
/// printed `theta / (2 sin theta) (R - R^T)` is 0/0 both at 0 and at pi.
///
/// ```
/// use dose3_lie::{Vector, so3};
/// let tiny = Vector::new(1e-12, -2e-12, 0.0);
/// assert!((so3::log(&so3::exp(&tiny)) - tiny).norm() < 1e-27);
/// ```
pub fn log(rotation: &Rotation) -> Vector {
    let (imaginary, real) = half_angle_quaternion(rotation);
    let sine = imaginary.norm();
    // angle / sine of the half angle; 2 atan(x) / x = 2 (1 - x^2 / 3 + ..) is 2 to rounding below 1e-8.
    let ratio = if sine < 1e-8 {
        2.0 / real
    } else {
        2.0 * sine.atan2(real) / sine
    };
    imaginary * ratio
}

/// Unit quaternion of the rotation as (imaginary part, real part), of the two signs the one with real part >= 0.
fn half_angle_quaternion(rotation: &Rotation) -> (Vector, f64) {
    let quaternion = UnitQuaternion::from_rotation_matrix(rotation);
    let (imaginary, real) = (quaternion.imag(), quaternion.w);
    if real < 0.0 {
        (-imaginary, -real)
    } else {
        (imaginary, real)
    }
}

/// Group product `a b`, the paper's (+): first `b`, then `a`, both in fixed axes.
pub fn compose(a: &Rotation, b: &Rotation) -> Rotation {
    a * b
}

/// The inverse rotation.
pub fn inverse(rotation: &Rotation) -> Rotation {
    rotation.inverse()
}

/// `exp(factor * log(rotation))`, the paper's (x): the same axis, `factor` times the angle.
///
/// ```
/// use dose3_lie::{Vector, so3};
/// let turn = so3::exp(&Vector::new(0.3, -0.8, 0.1));
/// let half = so3::scale(0.5, &turn);
/// assert!(so3::distance(&so3::compose(&half, &half), &turn) < 1e-15);
/// ```
pub fn scale(factor: f64, rotation: &Rotation) -> Rotation {
    exp(&(log(rotation) * factor))
}

/// Geodesic distance: the angle of `a^-1 b` in radians, in `[0, pi]`. Bi-invariant.
pub fn distance(a: &Rotation, b: &Rotation) -> f64 {
    let (imaginary, real) = half_angle_quaternion(&compose(&inverse(a), b));
    2.0 * imaginary.norm().atan2(real)
}

/// Left Jacobian of [`exp`]: `exp(v + d) = exp(left_jacobian(v) d) exp(v)` to first order in `d`.
pub fn left_jacobian(tangent: &Vector) -> Matrix {
    let angle = tangent.norm();
    let k = hat(tangent);
    Matrix::identity() + k * versine_ratio(angle) + k * k * sine_defect_ratio(angle)
}

/// Right Jacobian of [`exp`]: `exp(v + d) = exp(v) exp(right_jacobian(v) d)` to first order in `d`.
pub fn right_jacobian(tangent: &Vector) -> Matrix {
    left_jacobian(&-tangent)
}

/// Inverse of [`left_jacobian`]. Exists for norms below 2 pi, so for everything [`log`] returns; at a
/// non-zero multiple of 2 pi the Jacobian is singular and the entries grow without bound.
pub fn left_jacobian_inverse(tangent: &Vector) -> Matrix {
    let k = hat(tangent);
    Matrix::identity() - k * 0.5 + k * k * cotangent_ratio(tangent.norm())
}

/// Inverse of [`right_jacobian`], with the same domain as [`left_jacobian_inverse`].
pub fn right_jacobian_inverse(tangent: &Vector) -> Matrix {
    left_jacobian_inverse(&-tangent)
}
