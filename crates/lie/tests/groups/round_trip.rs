//! `exp` and `log` undo each other: near 0, near and at pi, beyond 2 pi.

use std::f64::consts::{PI, TAU};

use dose3_lie::{Vector, so3};
use proptest::prelude::*;

use crate::group::{Group, config, element, gap, tangent, tangent_gap};

/// Angles at which textbook formulas divide 0 by 0 or lose half their digits.
const SPECIAL_ANGLES: [f64; 8] = [
    0.0,
    1e-12,
    1e-8,
    1e-4,
    1.0,
    PI - 1e-4,
    PI - 1e-8,
    PI - 1e-12,
];

/// Both directions along each coordinate axis.
fn signed_axes() -> [Vector; 6] {
    let [x, y, z] = [Vector::x(), Vector::y(), Vector::z()];
    [x, y, z, -x, -y, -z]
}

/// An oracle that shares no formula with the crate.
pub fn exp_equals_the_matrix_exponential<G: Group>() {
    proptest!(config(), |(v in tangent::<G>(0.0..9.0))| {
        let expected = G::algebra(&v).exp();
        prop_assert!((G::matrix(&G::exp(&v)) - expected).amax() < 5e-14);
    });
}

pub fn special_angles_on_the_axes<G: Group>() {
    for angle in SPECIAL_ANGLES {
        for axis in signed_axes() {
            let v = G::tangent(Vector::new(0.3, -0.7, 0.2), axis * angle);
            let element = G::exp(&v);
            let log = G::log(&element);
            let error = tangent_gap::<G>(&log, &v);
            assert!(error < 1e-15, "{v:?}: {error:e}");
            assert!(gap::<G>(&G::exp(&log), &element) < 1e-15, "{v:?}");
        }
    }
}

/// With every entry of the matrix rounded, as after a product.
pub fn special_angles_conjugated<G: Group>() {
    proptest!(config(), |(by in element::<G>(), rho in prop::array::uniform3(-1.0..1.0))| {
        for angle in SPECIAL_ANGLES {
            for axis in signed_axes() {
                let v = G::tangent(Vector::from(rho), axis * angle);
                let conjugated = G::compose(&G::compose(&by, &G::exp(&v)), &G::inverse(&by));
                let log = G::log(&conjugated);
                let expected = G::adjoint(&by, &v);
                let error = tangent_gap::<G>(&log, &expected);
                // Within rounding of pi the matrix no longer tells which of the two half turns it was.
                let other_half_turn = PI - angle < 1e-11 && G::phi(&log).dot(&G::phi(&expected)) < 0.0;
                prop_assert!(error < 1e-13 || other_half_turn, "{angle} {axis:?}: {error:e}");
                prop_assert!(gap::<G>(&G::exp(&log), &conjugated) < 5e-14, "{angle} {axis:?}");
            }
        }
    });
}

/// At pi the tangent is known only up to sign, but its length and the element are not.
pub fn exactly_pi<G: Group>() {
    let check = |half_turn: &G::Element| {
        let log = G::log(half_turn);
        // Rounding of a matrix's entries moves its angle by a few times as much.
        assert!((G::phi(&log).norm() - PI).abs() < 5e-15, "{log:?}");
        assert!(gap::<G>(&G::exp(&log), half_turn) < 5e-14, "{log:?}");
    };
    // An axis about which the angle comes out three roundings short.
    let oblique = Vector::new(-2.5140669763882078, 1.725392415434648, 0.7563680665418104);
    check(&G::exp(&G::tangent(
        Vector::zeros(),
        oblique.normalize() * PI,
    )));
    for axis in signed_axes() {
        check(&G::exp(&G::tangent(Vector::new(0.3, -0.7, 0.2), axis * PI)));
    }
    proptest!(config(), |(by in element::<G>(), v in tangent::<G>(1.0..2.0))| {
        for phi in [Vector::x(), Vector::y(), Vector::z(), G::phi(&v).normalize()] {
            let half_turn = G::exp(&G::tangent(Vector::new(0.3, -0.7, 0.2), phi * PI));
            check(&half_turn);
            check(&G::compose(&G::compose(&by, &half_turn), &G::inverse(&by)));
        }
    });
}

/// Relative accuracy does not depend on how short the tangent is.
pub fn short_tangents<G: Group>() {
    proptest!(config(), |(v in tangent::<G>(0.1..1.0), exponent in -200..-3)| {
        let short = G::times(10_f64.powi(exponent), &v);
        let error = tangent_gap::<G>(&G::log(&G::exp(&short)), &short);
        prop_assert!(error < 1e-15 * G::largest(&short), "{short:?}: {error:e}");
    });
}

/// Rotation vectors longer than 2 pi wrap around.
pub fn beyond_two_pi<G: Group>() {
    proptest!(config(), |(v in tangent::<G>(TAU..50.0))| {
        let element = G::exp(&v);
        let log = G::log(&element);
        let (long, short) = (G::phi(&v), G::phi(&log));
        prop_assert!(short.norm() <= PI);
        prop_assert!(gap::<G>(&G::exp(&log), &element) < 1e-13);

        let wrapped = long * (1.0 - (long.norm() / TAU).round() * TAU / long.norm());
        prop_assert!((so3::exp(&short).matrix() - so3::exp(&wrapped).matrix()).amax() < 1e-13);

        let mut doubled = G::exp(&G::times(1.0 / 16.0, &v));
        for _ in 0..4 {
            doubled = G::compose(&doubled, &doubled);
        }
        prop_assert!(gap::<G>(&doubled, &element) < 1e-12);
    });
}

pub fn log_then_exp<G: Group>() {
    proptest!(config(), |(a in element::<G>(), b in element::<G>())| {
        let product = G::compose(&a, &b);
        let log = G::log(&product);
        prop_assert!(G::phi(&log).norm() <= PI);
        prop_assert!(gap::<G>(&G::exp(&log), &product) < 5e-14);
    });
}

pub fn equivariance_under_conjugation<G: Group>() {
    proptest!(config(), |(by in element::<G>(), v in tangent::<G>(0.0..3.1))| {
        let conjugated = G::compose(&G::compose(&by, &G::exp(&v)), &G::inverse(&by));
        prop_assert!(tangent_gap::<G>(&G::log(&conjugated), &G::adjoint(&by, &v)) < 1e-12);
    });
}
