//! The wrapped normal: its density, its samples, and that it is not IG_SO(3).

use std::f64::consts::PI;

use dose3_lie::{IgSo3, Rotation, Vector, WrappedNormal, so3};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::density::{SIGMAS, integral};
use crate::kolmogorov_smirnov::fits;

const COUNT: usize = 50_000;

fn sampled_angles(noise: WrappedNormal, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..COUNT)
        .map(|_| so3::log(&noise.sample(&mut rng, &Rotation::identity())).norm())
        .collect()
}

/// Cumulative distribution from the density by the midpoint rule on a fine grid, linear in between.
fn cdf(noise: WrappedNormal) -> impl Fn(f64) -> f64 {
    let upper = PI.min(10.0 * noise.sigma());
    let cells = 20_000;
    let width = upper / f64::from(cells);
    let mut cumulative = vec![0.0];
    for cell in 0..cells {
        let mass = width * noise.density(width * (f64::from(cell) + 0.5));
        cumulative.push(cumulative[cell as usize] + mass);
    }
    move |angle| {
        let position = (angle / width).min(f64::from(cells) - 1e-6);
        let (cell, fraction) = (position as usize, position.fract());
        cumulative[cell] * (1.0 - fraction) + cumulative[cell + 1] * fraction
    }
}

#[test]
fn integrates_to_one() {
    for sigma in SIGMAS.into_iter().chain([9.999, 10.0, 10.001, 1e12]) {
        let noise = WrappedNormal::new(sigma).unwrap();
        let total = integral(|angle| noise.density(angle));
        assert!((total - 1.0).abs() < 1e-10, "sigma {sigma}: {total}");
        assert_eq!(noise.density(-0.1), 0.0);
        assert_eq!(noise.density(3.2), 0.0);
    }
}

#[test]
fn angles_fit_the_density() {
    for (seed, sigma) in (600..).zip([0.01, 0.5, 1.0, 2.0, 3.0, 12.0]) {
        let noise = WrappedNormal::new(sigma).unwrap();
        assert!(
            fits(sampled_angles(noise, seed), cdf(noise)),
            "sigma {sigma}"
        );
    }
}

#[test]
fn a_wrong_sigma_is_noticed() {
    for (seed, sigma) in (700..).zip([0.01, 0.5, 1.0]) {
        let angles = sampled_angles(WrappedNormal::new(sigma).unwrap(), seed);
        let wrong = WrappedNormal::new(1.03 * sigma).unwrap();
        assert!(!fits(angles, cdf(wrong)), "sigma {sigma}");
    }
}

#[test]
fn agrees_with_igso3_only_for_small_sigma() {
    for (seed, sigma) in (800..).zip([0.01, 0.05]) {
        let isotropic = IgSo3::new(sigma).unwrap();
        let angles = sampled_angles(WrappedNormal::new(sigma).unwrap(), seed);
        assert!(fits(angles, |w| isotropic.cdf(w)), "sigma {sigma}");
    }
    for (seed, sigma) in (900..).zip([0.8, 1.0, 2.0, 3.0]) {
        let isotropic = IgSo3::new(sigma).unwrap();
        let angles = sampled_angles(WrappedNormal::new(sigma).unwrap(), seed);
        assert!(!fits(angles, |w| isotropic.cdf(w)), "sigma {sigma}");
    }
}

/// Share of the probability on which the two laws differ, as the crate's README states it.
#[test]
fn total_variation_from_igso3() {
    for (sigma, expected) in [(0.1, 0.0004), (0.3, 0.0035), (1.0, 0.039), (3.0, 0.262)] {
        let wrapped = WrappedNormal::new(sigma).unwrap();
        let isotropic = IgSo3::new(sigma).unwrap();
        let distance = 0.5 * integral(|w| (wrapped.density(w) - isotropic.density(w)).abs());
        assert!(
            (distance / expected - 1.0).abs() < 0.05,
            "sigma {sigma}: {distance}"
        );
    }
}

/// The rotation is `mean exp(v)` with the very `v` that the same generator gives.
#[test]
fn sample_is_the_exponential_of_the_tangent() {
    let noise = WrappedNormal::new(2.0).unwrap();
    let mean = so3::exp(&Vector::new(0.1, 0.2, 0.3));
    let [mut one, mut other] = [1, 1].map(ChaCha8Rng::seed_from_u64);
    for _ in 0..100 {
        let tangent = noise.sample_tangent(&mut one);
        let expected = so3::compose(&mean, &so3::exp(&tangent));
        assert_eq!(noise.sample(&mut other, &mean), expected);
    }
}

#[test]
fn impossible_sigmas_are_refused() {
    for sigma in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(WrappedNormal::new(sigma).is_err(), "{sigma}");
    }
}
