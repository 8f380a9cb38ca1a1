//! Group axioms, and `scale` along one-parameter subgroups.

use std::f64::consts::PI;

use proptest::prelude::*;

use crate::group::{Group, config, element, gap, tangent, tangent_gap};

/// Rounding of a few products of elements with entries up to about 15.
const ROUNDING: f64 = 5e-14;

pub fn associativity<G: Group>() {
    proptest!(config(), |(a in element::<G>(), b in element::<G>(), c in element::<G>())| {
        let left = G::compose(&G::compose(&a, &b), &c);
        let right = G::compose(&a, &G::compose(&b, &c));
        prop_assert!(gap::<G>(&left, &right) < ROUNDING);
    });
}

pub fn identity<G: Group>() {
    proptest!(config(), |(a in element::<G>())| {
        prop_assert_eq!(gap::<G>(&G::compose(&a, &G::identity()), &a), 0.0);
        prop_assert_eq!(gap::<G>(&G::compose(&G::identity(), &a), &a), 0.0);
    });
}

pub fn inverse<G: Group>() {
    proptest!(config(), |(a in element::<G>())| {
        let inverse = G::inverse(&a);
        prop_assert!(gap::<G>(&G::compose(&a, &inverse), &G::identity()) < ROUNDING);
        prop_assert!(gap::<G>(&G::compose(&inverse, &a), &G::identity()) < ROUNDING);
    });
}

pub fn inverse_negates_the_tangent<G: Group>() {
    proptest!(config(), |(v in tangent::<G>(0.0..3.1))| {
        let negated = G::log(&G::inverse(&G::exp(&v)));
        prop_assert!(tangent_gap::<G>(&negated, &G::times(-1.0, &v)) < ROUNDING);
    });
}

/// The product of the elements is the product of their matrices.
pub fn matrices_multiply<G: Group>() {
    proptest!(config(), |(a in element::<G>(), b in element::<G>())| {
        let product = G::matrix(&a) * G::matrix(&b);
        prop_assert!((G::matrix(&G::compose(&a, &b)) - product).amax() < ROUNDING);
    });
}

pub fn scale_by_one_and_zero<G: Group>() {
    proptest!(config(), |(a in element::<G>())| {
        prop_assert!(gap::<G>(&G::scale(1.0, &a), &a) < ROUNDING);
        prop_assert_eq!(gap::<G>(&G::scale(0.0, &a), &G::identity()), 0.0);
    });
}

pub fn scale_is_additive<G: Group>() {
    proptest!(config(), |(a in element::<G>(), j in -2.0..2.0, k in -2.0..2.0)| {
        let separate = G::compose(&G::scale(j, &a), &G::scale(k, &a));
        prop_assert!(gap::<G>(&separate, &G::scale(j + k, &a)) < ROUNDING);
    });
}

pub fn scale_by_whole_numbers<G: Group>() {
    proptest!(config(), |(a in element::<G>())| {
        let mut power = G::identity();
        for exponent in 0..6 {
            prop_assert!(gap::<G>(&G::scale(f64::from(exponent), &a), &power) < ROUNDING);
            power = G::compose(&power, &a);
        }
    });
}

pub fn scale_by_minus_one<G: Group>() {
    proptest!(config(), |(v in tangent::<G>(0.0..PI))| {
        let a = G::exp(&v);
        prop_assert!(gap::<G>(&G::scale(-1.0, &a), &G::inverse(&a)) < ROUNDING);
    });
}
