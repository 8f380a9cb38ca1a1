//! IG_SO(3): its density and cumulative distribution.

use std::f64::consts::PI;

use dose3_lie::IgSo3;

/// From nearly a tangent Gaussian to nearly uniform, with both sides of the switch of formulas at 1.
pub const SIGMAS: [f64; 14] = [
    0.01,
    0.03,
    0.1,
    0.3,
    0.31,
    0.32,
    0.5,
    0.9,
    1.0 - 1e-12,
    1.0,
    1.0 + 1e-12,
    1.5,
    2.0,
    3.0,
];

/// Simpson's rule over `[0, pi]`.
pub fn integral(function: impl Fn(f64) -> f64) -> f64 {
    let intervals = 20_000;
    let width = PI / f64::from(intervals);
    let weighted = (0..=intervals).map(|i| {
        let weight = match i {
            0 => 1.0,
            i if i == intervals => 1.0,
            i if i % 2 == 1 => 4.0,
            _ => 2.0,
        };
        weight * function(width * f64::from(i))
    });
    weighted.sum::<f64>() * width / 3.0
}

/// Largest `l` that counts in a sum over representations.
fn terms(sigma: f64) -> impl Iterator<Item = f64> {
    (1..=(9.5 / sigma) as i32 + 3).map(f64::from)
}

/// Weight of representation `l` in the heat kernel.
fn weight(l: f64, sigma: f64) -> f64 {
    (2.0 * l + 1.0) * (-0.5 * l * (l + 1.0) * sigma * sigma).exp()
}

/// The density of the angle, summed over representations at any sigma: exact but for an absolute rounding
/// error that grows as `sigma` falls.
fn spectral_density(angle: f64, sigma: f64) -> f64 {
    let sum = terms(sigma).fold(1.0 - angle.cos(), |sum, l| {
        sum + weight(l, sigma) * ((l * angle).cos() - ((l + 1.0) * angle).cos())
    });
    sum / PI
}

/// Its integral from 0, term by term.
fn spectral_cdf(angle: f64, sigma: f64) -> f64 {
    let sum = terms(sigma).fold(angle - angle.sin(), |sum, l| {
        sum + weight(l, sigma) * ((l * angle).sin() / l - ((l + 1.0) * angle).sin() / (l + 1.0))
    });
    sum / PI
}

fn angles(sigma: f64) -> impl Iterator<Item = f64> {
    let upper = PI.min(12.0 * sigma);
    (0..=997).map(move |i| upper * f64::from(i) / 997.0)
}

#[test]
fn integrates_to_one() {
    for sigma in SIGMAS {
        let noise = IgSo3::new(sigma).unwrap();
        let total = integral(|angle| noise.density(angle));
        assert!((total - 1.0).abs() < 1e-12, "sigma {sigma}: {total}");
    }
}

/// The mean of every character is `(2l + 1) exp(-l (l + 1) sigma^2 / 2)`: what makes it the heat kernel of
/// that sigma, and not merely a density.
#[test]
fn characters_decay_as_the_heat_equation_says() {
    for sigma in SIGMAS {
        let noise = IgSo3::new(sigma).unwrap();
        for l in [1.0, 2.0, 3.0] {
            let character = |w: f64| {
                1.0 + (1..=l as i32)
                    .map(|j| 2.0 * (f64::from(j) * w).cos())
                    .sum::<f64>()
            };
            let mean = integral(|w| noise.density(w) * character(w));
            assert!(
                (mean - weight(l, sigma)).abs() < 1e-11,
                "sigma {sigma}, l {l}: {mean}"
            );
        }
    }
}

#[test]
fn density_equals_the_series() {
    for sigma in SIGMAS {
        let noise = IgSo3::new(sigma).unwrap();
        for angle in angles(sigma) {
            let error = (noise.density(angle) - spectral_density(angle, sigma)).abs();
            assert!(
                error < 1e-12 / sigma / sigma,
                "sigma {sigma}, angle {angle}: {error:e}"
            );
        }
    }
}

#[test]
fn cdf_equals_the_integrated_series() {
    for sigma in SIGMAS {
        let noise = IgSo3::new(sigma).unwrap();
        for angle in angles(sigma) {
            let error = (noise.cdf(angle) - spectral_cdf(angle, sigma)).abs();
            assert!(error < 1e-10, "sigma {sigma}, angle {angle}: {error:e}");
        }
        assert_eq!(noise.cdf(0.0), 0.0);
        assert_eq!(noise.cdf(PI), 1.0);
    }
}

#[test]
fn continuous_across_the_switch() {
    let [below, above] = [1.0 - 1e-13, 1.0].map(|sigma| IgSo3::new(sigma).unwrap());
    for angle in angles(1.0) {
        let (left, right) = (below.density_on_group(angle), above.density_on_group(angle));
        assert!(
            (left / right - 1.0).abs() < 1e-11,
            "angle {angle}: {left} {right}"
        );
    }
}

#[test]
fn quantile_inverts_the_cdf() {
    for sigma in SIGMAS {
        let noise = IgSo3::new(sigma).unwrap();
        let mut last = 0.0;
        for i in 0..=1000 {
            let probability = f64::from(i) / 1000.0;
            let angle = noise.quantile(probability);
            assert!(
                (noise.cdf(angle) - probability).abs() < 1e-14,
                "sigma {sigma}: {probability}"
            );
            assert!(
                (last..=PI).contains(&angle),
                "sigma {sigma}: not increasing at {probability}"
            );
            last = angle;
        }
        for rare in [1e-15, 1e-12, 1e-9] {
            let cdf = noise.cdf(noise.quantile(rare));
            assert!(
                (cdf / rare - 1.0).abs() < 1e-6,
                "sigma {sigma}: {rare:e}, {cdf:e}"
            );
        }
    }
}

/// The convention for sigma: the angle of a small rotation is the norm of `N(0, sigma^2 I)`.
#[test]
fn small_sigma_is_the_standard_deviation_of_the_tangent() {
    let sigma = 1e-5;
    let noise = IgSo3::new(sigma).unwrap();
    for x in [0.1, 0.5, 1.0, 2.0, 5.0_f64] {
        let maxwell = (2.0 / PI).sqrt() * x * x * (-0.5 * x * x).exp() / sigma;
        let ratio = noise.density(x * sigma) / maxwell;
        assert!((ratio - 1.0).abs() < 1e-8, "{x}: {ratio}");
    }
}

#[test]
fn large_sigma_is_uniform() {
    for sigma in [7.0, 100.0, 1e200] {
        let noise = IgSo3::new(sigma).unwrap();
        for angle in angles(1.0) {
            assert!((noise.density_on_group(angle) - 1.0).abs() < 1e-9);
            let cdf = (angle - angle.sin()) / PI;
            assert!((noise.cdf(angle) - cdf).abs() < 1e-12);
        }
    }
}

#[test]
fn outside_the_range_of_angles() {
    let noise = IgSo3::new(0.4).unwrap();
    for angle in [-1.0, -1e-300, PI + 1e-9, 10.0] {
        assert_eq!(noise.density(angle), 0.0);
    }
    assert_eq!(noise.cdf(-1.0), 0.0);
    assert_eq!(noise.cdf(4.0), 1.0);
    assert_eq!(noise.quantile(-0.5), 0.0);
    assert_eq!(noise.quantile(1.5), PI);
}

#[test]
fn impossible_sigmas_are_refused() {
    for sigma in [0.0, -1.0, 1e-300, f64::NAN, f64::INFINITY] {
        let refused = IgSo3::new(sigma).unwrap_err();
        assert!(refused.to_string().contains("sigma is"), "{refused}");
    }
}
