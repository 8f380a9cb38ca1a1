//! Windows to train small models on.
#![allow(dead_code)] // each test binary uses its part

use dose3_baselines::Sequences;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Smooth windows `[windows, length, channels]`: one wave per channel, the last channel constant.
pub fn waves(windows: usize, length: usize, channels: usize, seed: u64) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut data = Vec::with_capacity(windows * length * channels);
    for _ in 0..windows {
        let phases: Vec<f64> = (0..channels).map(|_| rng.random_range(0.0..6.3)).collect();
        for i in 0..length {
            for (channel, phase) in phases.iter().enumerate() {
                let value = (phase + 0.2 * i as f64).sin() * (channel + 1) as f64 + 3.0;
                data.push(if channel + 1 == channels {
                    0.5
                } else {
                    value as f32
                });
            }
        }
    }
    data
}

/// Views numbers as windows.
pub fn windows(length: usize, channels: usize, data: &[f32]) -> Sequences<'_> {
    Sequences {
        length,
        channels,
        data,
    }
}

/// Mean of some scores.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
