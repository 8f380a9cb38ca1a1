//! The distance is a metric, and invariant.

use proptest::prelude::*;

use crate::group::{Group, So3, config, element, gap, tangent};

/// Rounding of distances of up to about 20.
const ROUNDING: f64 = 1e-13;

pub fn zero_only_at_itself<G: Group>() {
    proptest!(config(), |(a in element::<G>(), b in element::<G>())| {
        prop_assert_eq!(G::distance(&a, &a), 0.0);
        prop_assert!(G::distance(&a, &b) > 0.01 * gap::<G>(&a, &b));
    });
}

pub fn symmetry<G: Group>() {
    proptest!(config(), |(a in element::<G>(), b in element::<G>())| {
        prop_assert!((G::distance(&a, &b) - G::distance(&b, &a)).abs() < ROUNDING);
    });
}

pub fn triangle_inequality<G: Group>() {
    proptest!(config(), |(a in element::<G>(), b in element::<G>(), c in element::<G>())| {
        let detour = G::distance(&a, &b) + G::distance(&b, &c);
        prop_assert!(G::distance(&a, &c) <= detour + ROUNDING);
    });
}

pub fn left_invariance<G: Group>() {
    proptest!(config(), |(a in element::<G>(), b in element::<G>(), by in element::<G>())| {
        let moved = G::distance(&G::compose(&by, &a), &G::compose(&by, &b));
        prop_assert!((moved - G::distance(&a, &b)).abs() < ROUNDING);
    });
}

/// Holds where the group promises it, and fails somewhere where it does not.
pub fn right_invariance<G: Group>() {
    let worst = std::cell::Cell::new(0.0_f64);
    proptest!(config(), |(a in element::<G>(), b in element::<G>(), by in element::<G>())| {
        let moved = G::distance(&G::compose(&a, &by), &G::compose(&b, &by));
        worst.set(worst.get().max((moved - G::distance(&a, &b)).abs()));
    });
    let invariant = worst.get() < ROUNDING;
    assert_eq!(invariant, G::BI_INVARIANT, "changed by {:e}", worst.get());
}

/// A step of length d away is d away, down to rounding and not to its square root.
pub fn small_distances<G: Group>() {
    proptest!(config(), |(a in element::<G>(), v in tangent::<G>(0.1..1.0), exponent in -12..-5)| {
        let step = G::times(10_f64.powi(exponent), &v);
        let distance = G::distance(&a, &G::compose(&a, &G::exp(&step)));
        let expected = G::length(&step);
        prop_assert!((distance - expected).abs() < 1e-5 * expected + 1e-14, "{distance:e} {expected:e}");
    });
}

/// Against the chord, which needs neither logarithm nor quaternion: |A - B| = 2 sqrt(2) sin(angle / 2).
#[test]
fn rotation_distance_matches_the_chord() {
    proptest!(config(), |(a in element::<So3>(), b in element::<So3>())| {
        let chord = (a.matrix() - b.matrix()).norm();
        let angle = So3::distance(&a, &b);
        prop_assert!((chord - 8_f64.sqrt() * (0.5 * angle).sin()).abs() < 5e-15);
    });
}
