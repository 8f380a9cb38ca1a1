//! The flow is what it claims: invertible, with the true log-determinant, and normalised.

mod common;

use common::{mean, waves, windows};
use dose3_baselines::{Error, Glow, GlowConfig};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn small() -> GlowConfig {
    GlowConfig {
        levels: 2,
        steps_per_level: 2,
        hidden: 8,
        batch: 32,
        steps: 40,
        learning_rate: 5e-3,
        ..GlowConfig::default()
    }
}

#[test]
fn decoding_undoes_encoding() {
    let data = waves(64, 32, 6, 1);
    let config = GlowConfig {
        levels: 3,
        ..small()
    };
    let glow = Glow::train(windows(32, 6, &data), &config, 7, &mut |_| ()).unwrap();
    let unseen = waves(16, 32, 6, 2);
    let latents = glow.encode(windows(32, 6, &unseen)).unwrap();
    let back = glow.decode(&latents.values).unwrap();
    let worst = back
        .iter()
        .zip(&unseen)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f32::max);
    assert!(worst < 1e-4, "off by {worst}");
    let moved = latents
        .values
        .iter()
        .zip(&unseen)
        .filter(|(z, x)| (*z - *x).abs() > 0.1);
    assert!(moved.count() > unseen.len() / 2, "the flow is the identity");
}

#[test]
fn log_determinant_is_that_of_the_numeric_jacobian() {
    let (length, channels) = (4, 2);
    let dimension = length * channels;
    // Both channels vary here: a constant one would have a Jacobian beyond f32 differences.
    let data = waves(256, length, channels + 1, 3);
    let data: Vec<f32> = data
        .chunks_exact(3)
        .flat_map(|pose| [pose[0], 5.0 * pose[1]])
        .collect();
    let config = GlowConfig {
        noise: 0.3,
        ..small()
    };
    let glow = Glow::train(windows(length, channels, &data), &config, 5, &mut |_| ()).unwrap();

    for x in data.chunks_exact(dimension).take(8) {
        let steps: Vec<f32> = (0..dimension).map(|i| [0.002, 0.02][i % 2]).collect();
        let mut moved = Vec::new();
        for (i, step) in steps.iter().enumerate() {
            for sign in [1.0, -1.0] {
                moved.extend_from_slice(x);
                let start = moved.len() - dimension;
                moved[start + i] += sign * step;
            }
        }
        let z = glow
            .encode(windows(length, channels, &moved))
            .unwrap()
            .values;
        let jacobian = DMatrix::from_fn(dimension, dimension, |row, column| {
            let [above, below] = [2 * column, 2 * column + 1];
            let [above, below] = [above, below].map(|w| f64::from(z[w * dimension + row]));
            let [from, to] = [below, above].map(|_| f64::from(steps[column]));
            (above - below) / (from + to)
        });
        let numeric = jacobian.determinant().abs().ln();
        let claimed = glow.encode(windows(length, channels, x)).unwrap().log_det[0];
        assert!(
            (numeric - claimed).abs() < 0.02,
            "{numeric} against {claimed}"
        );
        assert!(
            claimed.abs() > 0.5,
            "a trivial determinant shows nothing: {claimed}"
        );
    }
}

#[test]
fn density_integrates_to_one_and_is_no_gaussian() {
    // A ring: no Gaussian fits it.
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut data = Vec::new();
    for _ in 0..2000 {
        let angle = rng.random_range(0.0..std::f32::consts::TAU);
        let radius = rng.random_range(1.8..2.2);
        data.extend([radius * f32::cos(angle), radius * f32::sin(angle)]);
    }
    let config = GlowConfig {
        levels: 1,
        steps_per_level: 6,
        hidden: 16,
        batch: 128,
        steps: 250,
        learning_rate: 5e-3,
        ..GlowConfig::default()
    };
    let glow = Glow::train(windows(2, 1, &data), &config, 3, &mut |_| ()).unwrap();

    let (half, cells) = (6.0, 400);
    let side = 2.0 * half / cells as f64;
    let centre = |i: usize| (-half + (i as f64 + 0.5) * side) as f32;
    let grid: Vec<f32> = (0..cells * cells)
        .flat_map(|i| [centre(i / cells), centre(i % cells)])
        .collect();
    let log_density = glow.log_density(windows(2, 1, &grid)).unwrap();
    let total: f64 = log_density.iter().map(|v| v.exp()).sum::<f64>() * side * side;
    assert!((total - 1.0).abs() < 0.01, "integral {total}");

    // Entropy of the Gaussian with the ring's variances (2.0 each), per window.
    let gaussian = -(std::f64::consts::TAU * 2.0).ln() - 1.0;
    let flow = mean(&glow.log_density(windows(2, 1, &data)).unwrap());
    assert!(
        flow > gaussian + 0.3,
        "{flow} against the Gaussian's {gaussian}"
    );
}

#[test]
fn density_with_a_split_integrates_to_one() {
    // Four dimensions, so by importance sampling, under a Gaussian wider than the data.
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut data = Vec::new();
    for _ in 0..2000 {
        let mut x = normal();
        for _ in 0..4 {
            data.push(x as f32);
            x = 0.8 * x + 0.6 * normal();
        }
    }
    let config = GlowConfig {
        steps: 150,
        batch: 128,
        noise: 0.1,
        ..small()
    };
    let glow = Glow::train(windows(4, 1, &data), &config, 3, &mut |_| ()).unwrap();

    let (samples, sd) = (200_000, 1.5);
    let drawn: Vec<f32> = (0..4 * samples).map(|_| (sd * normal()) as f32).collect();
    let proposal = |x: &[f32]| -> f64 {
        let squares: f64 = x.iter().map(|&v| (f64::from(v) / sd).powi(2)).sum();
        -0.5 * squares - 4.0 * (sd.ln() + 0.5 * std::f64::consts::TAU.ln())
    };
    let log_density = glow.log_density(windows(4, 1, &drawn)).unwrap();
    let weights = log_density.iter().zip(drawn.chunks_exact(4));
    let total = mean(
        &weights
            .map(|(p, x)| (p - proposal(x)).exp())
            .collect::<Vec<_>>(),
    );
    assert!((total - 1.0).abs() < 0.03, "integral {total}");
}

#[test]
fn a_constant_channel_has_a_finite_density() {
    let data = waves(64, 16, 3, 1); // the last channel is constant
    let glow = Glow::train(windows(16, 3, &data), &small(), 7, &mut |_| ()).unwrap();
    let per_dimension = mean(&glow.log_density(windows(16, 3, &data)).unwrap()) / 48.0;
    assert!(
        per_dimension.is_finite() && per_dimension < 5.0,
        "{per_dimension}"
    );
}

#[test]
fn what_does_not_fit_is_refused() {
    let data = waves(4, 16, 3, 1);
    let train = |length, channels, config: GlowConfig| {
        Glow::train(windows(length, channels, &data), &config, 0, &mut |_| ()).unwrap_err()
    };
    assert!(matches!(train(7, 3, small()), Error::Config(_)));
    assert!(matches!(train(16, 5, small()), Error::Shape { .. }));
    let no_noise = GlowConfig {
        noise: 0.0,
        ..small()
    };
    assert!(matches!(train(16, 3, no_noise), Error::Config(_)));
    let empty = Glow::train(windows(16, 3, &[]), &small(), 0, &mut |_| ());
    assert!(matches!(empty, Err(Error::Empty)));
}
