//! The group of rigid motions SE(3).
//!
//! Tangent vectors are twists `[rho, phi]`: the translation part in metres first, then the rotation
//! vector in radians. Formulas follow Sola, Deray, Atchuthan (arXiv 1812.01537), appendix D.

use crate::{Pose, Twist, Vector, so3};

/// Pose reached by following `twist` for one unit of time, both parts acting at once (a screw motion).
///
/// ```
/// use dose3_lie::{Twist, se3};
/// // One metre of arc while turning left by half a circle ends 2 / pi metres to the left.
/// let half_circle = se3::exp(&Twist::new(1.0, 0.0, 0.0, 0.0, 0.0, std::f64::consts::PI));
/// assert!((half_circle.translation.y - 2.0 / std::f64::consts::PI).abs() < 1e-15);
/// ```
pub fn exp(twist: &Twist) -> Pose {
    let (rho, phi) = split(twist);
    Pose::new(so3::exp(&phi), so3::left_jacobian(&phi) * rho)
}

/// The twist with the smallest rotation whose [`exp`] is `pose`; its rotation part has norm in `[0, pi]`.
pub fn log(pose: &Pose) -> Twist {
    let phi = so3::log(&pose.rotation);
    let rho = so3::left_jacobian_inverse(&phi) * pose.translation;
    Twist::new(rho.x, rho.y, rho.z, phi.x, phi.y, phi.z)
}

/// The translation part `rho` (metres) and the rotation part `phi` (radians) of a twist.
pub fn split(twist: &Twist) -> (Vector, Vector) {
    (
        Vector::new(twist[0], twist[1], twist[2]),
        Vector::new(twist[3], twist[4], twist[5]),
    )
}

/// Group product `a b`: first `b`, then `a`.
pub fn compose(a: &Pose, b: &Pose) -> Pose {
    a.compose(b)
}

/// The inverse motion.
pub fn inverse(pose: &Pose) -> Pose {
    pose.inverse()
}

/// `exp(factor * log(pose))`: the same screw motion followed `factor` times as far.
pub fn scale(factor: f64, pose: &Pose) -> Pose {
    exp(&(log(pose) * factor))
}

/// Pose at fraction `u` of the way from `a` (`u = 0`) to `b` (`u = 1`).
///
/// The position goes in a straight line and the rotation along its geodesic, independently: the
/// shortest path under [`distance`], and what an interpolated log should show between two samples.
/// (`a scale(u, a^-1 b)` would follow a screw instead.) Values of `u` outside `[0, 1]` extrapolate.
pub fn interpolate(a: &Pose, b: &Pose, u: f64) -> Pose {
    let turn = so3::compose(&so3::inverse(&a.rotation), &b.rotation);
    Pose::new(
        so3::compose(&a.rotation, &so3::scale(u, &turn)),
        a.translation * (1.0 - u) + b.translation * u,
    )
}

/// Distance in metres: the root of squared travel plus squared turn, one radian counting as `metres_per_radian`.
///
/// A metric for `metres_per_radian > 0`, and invariant under a change of the reference frame
/// (left-invariant). No metric of this kind on SE(3) is invariant on both sides, and none comes without a length
/// that says how a turn compares with a step (Park, "Distance metrics on the rigid-body motions", 1995).
///
/// ```
/// use dose3_lie::{Pose, Twist, se3};
/// let pose = se3::exp(&Twist::new(3.0, 0.0, 0.0, 0.0, 0.0, 0.0));
/// assert_eq!(se3::distance(&Pose::identity(), &pose, 1.0), 3.0);
/// ```
pub fn distance(a: &Pose, b: &Pose, metres_per_radian: f64) -> f64 {
    let step = (b.translation - a.translation).norm();
    step.hypot(metres_per_radian * so3::distance(&a.rotation, &b.rotation))
}
