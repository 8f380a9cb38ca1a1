//! What the properties need to know of a group.

use std::f64::consts::PI;
use std::fmt::Debug;

use dose3_lie::{Pose, Rotation, Twist, Vector, se3, so3};
use nalgebra::Matrix4;
use proptest::prelude::*;
use proptest::test_runner::Config;

use crate::property_cases::cases;

/// A matrix Lie group with a rotation in every element.
pub trait Group {
    type Element: Clone + Debug;
    type Tangent: Clone + Debug;
    /// Whether the distance is right-invariant too.
    const BI_INVARIANT: bool;

    fn identity() -> Self::Element;
    fn exp(tangent: &Self::Tangent) -> Self::Element;
    fn log(element: &Self::Element) -> Self::Tangent;
    fn compose(a: &Self::Element, b: &Self::Element) -> Self::Element;
    fn inverse(element: &Self::Element) -> Self::Element;
    fn scale(factor: f64, element: &Self::Element) -> Self::Element;
    fn distance(a: &Self::Element, b: &Self::Element) -> f64;

    /// The tangent with this rotation part; groups without a translation ignore `rho`.
    fn tangent(rho: Vector, phi: Vector) -> Self::Tangent;
    /// Rotation part of a tangent.
    fn phi(tangent: &Self::Tangent) -> Vector;
    fn add(a: &Self::Tangent, b: &Self::Tangent) -> Self::Tangent;
    fn times(factor: f64, tangent: &Self::Tangent) -> Self::Tangent;
    /// Largest absolute entry.
    fn largest(tangent: &Self::Tangent) -> f64;
    /// Length of a short tangent as the distance measures it.
    fn length(tangent: &Self::Tangent) -> f64;

    /// The element as a homogeneous matrix.
    fn matrix(element: &Self::Element) -> Matrix4<f64>;
    /// The tangent as an element of the matrix Lie algebra.
    fn algebra(tangent: &Self::Tangent) -> Matrix4<f64>;
    /// `tangent` carried along by `by`: `by exp(tangent) by^-1 = exp(adjoint(by, tangent))`.
    fn adjoint(by: &Self::Element, tangent: &Self::Tangent) -> Self::Tangent;
}

pub struct So3;

impl Group for So3 {
    type Element = Rotation;
    type Tangent = Vector;
    const BI_INVARIANT: bool = true;

    fn identity() -> Rotation {
        Rotation::identity()
    }
    fn exp(tangent: &Vector) -> Rotation {
        so3::exp(tangent)
    }
    fn log(element: &Rotation) -> Vector {
        so3::log(element)
    }
    fn compose(a: &Rotation, b: &Rotation) -> Rotation {
        so3::compose(a, b)
    }
    fn inverse(element: &Rotation) -> Rotation {
        so3::inverse(element)
    }
    fn scale(factor: f64, element: &Rotation) -> Rotation {
        so3::scale(factor, element)
    }
    fn distance(a: &Rotation, b: &Rotation) -> f64 {
        so3::distance(a, b)
    }
    fn tangent(_rho: Vector, phi: Vector) -> Vector {
        phi
    }
    fn phi(tangent: &Vector) -> Vector {
        *tangent
    }
    fn add(a: &Vector, b: &Vector) -> Vector {
        a + b
    }
    fn times(factor: f64, tangent: &Vector) -> Vector {
        tangent * factor
    }
    fn largest(tangent: &Vector) -> f64 {
        tangent.amax()
    }
    fn length(tangent: &Vector) -> f64 {
        tangent.norm()
    }
    fn matrix(element: &Rotation) -> Matrix4<f64> {
        element.to_homogeneous()
    }
    fn algebra(tangent: &Vector) -> Matrix4<f64> {
        let mut matrix = Matrix4::zeros();
        matrix
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&so3::hat(tangent));
        matrix
    }
    fn adjoint(by: &Rotation, tangent: &Vector) -> Vector {
        by * tangent
    }
}

pub struct Se3;

/// Metres that count as much as a radian in the distances of the suite.
pub const METRES_PER_RADIAN: f64 = 2.5;

impl Group for Se3 {
    type Element = Pose;
    type Tangent = Twist;
    const BI_INVARIANT: bool = false;

    fn identity() -> Pose {
        Pose::identity()
    }
    fn exp(tangent: &Twist) -> Pose {
        se3::exp(tangent)
    }
    fn log(element: &Pose) -> Twist {
        se3::log(element)
    }
    fn compose(a: &Pose, b: &Pose) -> Pose {
        se3::compose(a, b)
    }
    fn inverse(element: &Pose) -> Pose {
        se3::inverse(element)
    }
    fn scale(factor: f64, element: &Pose) -> Pose {
        se3::scale(factor, element)
    }
    fn distance(a: &Pose, b: &Pose) -> f64 {
        se3::distance(a, b, METRES_PER_RADIAN)
    }
    fn tangent(rho: Vector, phi: Vector) -> Twist {
        Twist::new(rho.x, rho.y, rho.z, phi.x, phi.y, phi.z)
    }
    fn phi(tangent: &Twist) -> Vector {
        se3::split(tangent).1
    }
    fn add(a: &Twist, b: &Twist) -> Twist {
        a + b
    }
    fn times(factor: f64, tangent: &Twist) -> Twist {
        tangent * factor
    }
    fn largest(tangent: &Twist) -> f64 {
        tangent.amax()
    }
    fn length(tangent: &Twist) -> f64 {
        let (rho, phi) = se3::split(tangent);
        rho.norm().hypot(METRES_PER_RADIAN * phi.norm())
    }
    fn matrix(element: &Pose) -> Matrix4<f64> {
        element.matrix()
    }
    fn algebra(tangent: &Twist) -> Matrix4<f64> {
        let (rho, phi) = se3::split(tangent);
        let mut matrix = So3::algebra(&phi);
        matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&rho);
        matrix
    }
    fn adjoint(by: &Pose, tangent: &Twist) -> Twist {
        let (rho, phi) = se3::split(tangent);
        let turned = by.rotation * phi;
        Self::tangent(by.rotation * rho + by.translation.cross(&turned), turned)
    }
}

/// Largest absolute difference of the matrices of two elements: an equality that needs no `log`.
pub fn gap<G: Group>(a: &G::Element, b: &G::Element) -> f64 {
    (G::matrix(a) - G::matrix(b)).amax()
}

/// Largest absolute difference of two tangents.
pub fn tangent_gap<G: Group>(a: &G::Tangent, b: &G::Tangent) -> f64 {
    G::largest(&G::add(a, &G::times(-1.0, b)))
}

/// Unit vectors.
pub fn axis() -> impl Strategy<Value = Vector> {
    (-1.0..1.0, 0.0..2.0 * PI).prop_map(|(z, longitude): (f64, f64)| {
        let radius = (1.0 - z * z).sqrt();
        Vector::new(radius * longitude.cos(), radius * longitude.sin(), z)
    })
}

/// Tangents with a rotation angle in `angles` and a translation part within 5 metres on each axis.
pub fn tangent<G: Group>(angles: std::ops::Range<f64>) -> impl Strategy<Value = G::Tangent> {
    let rho = prop::array::uniform3(-5.0..5.0);
    (axis(), angles, rho).prop_map(|(axis, angle, rho)| G::tangent(Vector::from(rho), axis * angle))
}

/// Elements with any rotation.
pub fn element<G: Group>() -> impl Strategy<Value = G::Element> {
    tangent::<G>(0.0..PI).prop_map(|tangent| G::exp(&tangent))
}

/// The settings of every property.
pub fn config() -> Config {
    cases(512)
}
