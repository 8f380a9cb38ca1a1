//! The Jacobians of SO(3) against differences of `exp`.

use std::f64::consts::PI;

use dose3_lie::{Matrix, Vector, so3};
use proptest::prelude::*;

use crate::group::{axis, config};

/// Angles at every regime of the coefficients: their limit, both sides of their switch, pi, and beyond.
const ANGLES: [f64; 10] = [0.0, 1e-9, 1e-4, 0.1, 0.499, 0.501, 1.0, 3.0, PI, 5.0];

/// Column by column, the change of `exp(tangent)` seen from the left, by fourth-order central differences.
fn numeric_left_jacobian(tangent: &Vector) -> Matrix {
    let step = 1e-3;
    let base = so3::inverse(&so3::exp(tangent));
    let moved =
        |direction: Vector| so3::log(&so3::compose(&so3::exp(&(tangent + direction)), &base));
    let columns = [Vector::x(), Vector::y(), Vector::z()].map(|unit| {
        let near = moved(unit * step) - moved(unit * -step);
        let far = moved(unit * (2.0 * step)) - moved(unit * (-2.0 * step));
        (near * 8.0 - far) / (12.0 * step)
    });
    Matrix::from_columns(&columns)
}

#[test]
fn left_jacobian_is_the_derivative() {
    proptest!(config(), |(axis in axis())| {
        for angle in ANGLES {
            let v = axis * angle;
            let error = (so3::left_jacobian(&v) - numeric_left_jacobian(&v)).amax();
            prop_assert!(error < 1e-11, "angle {angle}: {error:e}");
        }
    });
}

#[test]
fn right_jacobian_is_the_left_one_seen_from_the_body() {
    proptest!(config(), |(axis in axis())| {
        for angle in ANGLES {
            let v = axis * angle;
            let turned = so3::inverse(&so3::exp(&v)).matrix() * so3::left_jacobian(&v);
            prop_assert!((so3::right_jacobian(&v) - turned).amax() < 1e-14, "angle {angle}");
        }
    });
}

#[test]
fn inverses_are_inverses() {
    proptest!(config(), |(axis in axis())| {
        for angle in ANGLES {
            let v = axis * angle;
            let left = so3::left_jacobian_inverse(&v) * so3::left_jacobian(&v);
            let right = so3::right_jacobian(&v) * so3::right_jacobian_inverse(&v);
            prop_assert!((left - Matrix::identity()).amax() < 5e-14, "angle {angle}");
            prop_assert!((right - Matrix::identity()).amax() < 5e-14, "angle {angle}");
        }
    });
}

#[test]
fn hat_and_vee() {
    proptest!(config(), |(v in axis(), w in axis())| {
        prop_assert_eq!(so3::vee(&so3::hat(&v)), v);
        prop_assert_eq!(so3::hat(&v) * w, v.cross(&w));
    });
}
