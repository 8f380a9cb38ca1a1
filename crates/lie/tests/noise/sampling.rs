//! IG_SO(3): its samples, with fixed seeds.

use std::f64::consts::PI;

use dose3_lie::{IgSo3, Rotation, Vector, so3};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::density::SIGMAS;
use crate::kolmogorov_smirnov::fits;

/// Enough to tell sigma apart from one 3 % off.
const COUNT: usize = 50_000;

fn seeded(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

fn sampled_angles(noise: &IgSo3, seed: u64) -> Vec<f64> {
    let mut rng = seeded(seed);
    (0..COUNT).map(|_| noise.sample_angle(&mut rng)).collect()
}

#[test]
fn angles_fit_the_cdf() {
    for (seed, sigma) in (100..).zip(SIGMAS) {
        let noise = IgSo3::new(sigma).unwrap();
        assert!(
            fits(sampled_angles(&noise, seed), |w| noise.cdf(w)),
            "sigma {sigma}"
        );
    }
}

/// The test above can fail: it notices a sigma that is 3 % off, for as long as sigma matters.
#[test]
fn a_wrong_sigma_is_noticed() {
    for (seed, sigma) in (200..).zip(SIGMAS).filter(|(_, sigma)| *sigma < 1.9) {
        let angles = sampled_angles(&IgSo3::new(sigma).unwrap(), seed);
        for factor in [0.97, 1.03] {
            let wrong = IgSo3::new(factor * sigma).unwrap();
            assert!(
                !fits(angles.clone(), |w| wrong.cdf(w)),
                "sigma {sigma} passed for {}",
                wrong.sigma()
            );
        }
    }
}

/// The angle of a sampled rotation, measured, follows the law; so does its axis, from whichever mean.
#[test]
fn rotations_have_the_angle_and_a_uniform_axis() {
    let mean = so3::exp(&Vector::new(1.0, -2.0, 0.5));
    for (seed, sigma) in (300..).zip([0.05, 0.6, 2.0]) {
        let noise = IgSo3::new(sigma).unwrap();
        let mut rng = seeded(seed);
        let tangents: Vec<Vector> = (0..COUNT)
            .map(|_| {
                so3::log(&so3::compose(
                    &so3::inverse(&mean),
                    &noise.sample(&mut rng, &mean),
                ))
            })
            .collect();
        let angles = tangents.iter().map(|v| v.norm()).collect();
        assert!(fits(angles, |w| noise.cdf(w)), "angle, sigma {sigma}");
        // By Archimedes each coordinate of a uniform point on the sphere is uniform on [-1, 1].
        for coordinate in 0..3 {
            let along = tangents.iter().map(|v| v[coordinate] / v.norm()).collect();
            assert!(
                fits(along, |x| 0.5 * (x + 1.0)),
                "axis {coordinate}, sigma {sigma}"
            );
        }
    }
}

/// Brownian motion: steps of sigma 3 k, 4 k make one of 5 k.
#[test]
fn products_add_their_variances() {
    for (seed, unit) in (400..).zip([0.02, 0.2, 0.4]) {
        let [first, second, both] =
            [3.0, 4.0, 5.0].map(|factor| IgSo3::new(factor * unit).unwrap());
        let mut rng = seeded(seed);
        let angles = (0..COUNT)
            .map(|_| {
                let step = first.sample(&mut rng, &Rotation::identity());
                so3::log(&second.sample(&mut rng, &step)).norm()
            })
            .collect();
        assert!(fits(angles, |w| both.cdf(w)), "unit {unit}");
    }
}

#[test]
fn same_seed_same_bits() {
    let noise = IgSo3::new(0.7).unwrap();
    let draw = |seed| noise.sample(&mut seeded(seed), &Rotation::identity());
    assert_eq!(draw(5), draw(5));
    assert_ne!(draw(5), draw(6));
}

#[test]
fn the_smallest_sigma_still_works() {
    let noise = IgSo3::new(dose3_lie::igso3::SMALLEST_SIGMA).unwrap();
    let angles = sampled_angles(&noise, 500);
    assert!(angles.iter().all(|&w| w > 0.0 && w < 1e-11));
    assert!(fits(angles, |w| noise.cdf(w)));
    let uniform = IgSo3::new(1e9).unwrap();
    assert!(fits(sampled_angles(&uniform, 501), |w| (w - w.sin()) / PI));
}
