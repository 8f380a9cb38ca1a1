//! Small networks and batches for the tests.

use dose3_model::{Input, Parameters, UNetConfig};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A network of two levels with groups of two channels: quick, and no gradient vanishes.
pub fn small() -> UNetConfig {
    UNetConfig {
        heads: 2,
        head_dim: 8,
        ..UNetConfig::new(9, 3, 16, &[1, 2])
    }
}

pub fn parameters(config: &UNetConfig) -> Parameters {
    Parameters::init(config, 11).expect("a valid configuration")
}

/// Numbers in `[-1, 1)`.
pub fn numbers(count: usize, seed: u64) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| rng.random_range(-1.0..1.0)).collect()
}

/// Owns what an [`Input`] borrows.
pub struct Batch {
    pub x: Vec<f32>,
    pub steps: Vec<f32>,
    pub length: usize,
}

impl Batch {
    pub fn new(config: &UNetConfig, batch: usize, length: usize) -> Self {
        let x = numbers(batch * length * config.in_channels, 5);
        let steps = (0..batch).map(|i| (7 * i % 30) as f32).collect();
        Self { x, steps, length }
    }

    pub fn input(&self) -> Input<'_> {
        let batch = self.steps.len();
        Input {
            x: &self.x,
            steps: &self.steps,
            batch,
            length: self.length,
        }
    }
}
