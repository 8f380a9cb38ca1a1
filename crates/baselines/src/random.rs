//! Everything random, from ChaCha8 on the host.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::{Sequences, Standardizer};

/// Independent streams of one seed, so that a change in one leaves the others as they are.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Stream {
    Weights,
    Batches,
    BackgroundWeights,
    BackgroundBatches,
    Langevin,
}

pub(crate) fn generator(seed: u64, stream: Stream) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream as u64);
    rng
}

pub(crate) fn normal(rng: &mut ChaCha8Rng) -> f32 {
    StandardNormal.sample(rng)
}

/// Draws windows with replacement, standardised: their indices and `[batch, length, channels]`.
pub(crate) fn batch(
    data: &Sequences<'_>,
    standardizer: &Standardizer,
    size: usize,
    rng: &mut ChaCha8Rng,
) -> (Vec<usize>, Vec<f32>) {
    let windows = data.windows();
    let mut values = Vec::with_capacity(size * data.dimension());
    let indices: Vec<usize> = (0..size).map(|_| rng.random_range(0..windows)).collect();
    for &index in &indices {
        standardizer.extend(&mut values, data.window(index));
    }
    (indices, values)
}

/// Adds Gaussian noise of standard deviation `size`.
pub(crate) fn jitter(values: &mut [f32], size: f64, rng: &mut ChaCha8Rng) {
    for value in values {
        *value += size as f32 * normal(rng);
    }
}
