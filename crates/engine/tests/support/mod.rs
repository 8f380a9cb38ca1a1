//! Networks and batches for the tests.
#![allow(dead_code)] // every test binary uses some

use dose3_engine::{Engine, EngineOptions, Instructions};
use dose3_model::{Input, NoiseModel, Parameters, UNetConfig};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A batch with random input and steps, and the gradient at the output.
pub struct Batch {
    pub x: Vec<f32>,
    pub steps: Vec<f32>,
    pub upstream: Vec<f32>,
    pub batch: usize,
    pub length: usize,
}

impl Batch {
    pub fn new(config: &UNetConfig, batch: usize, length: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = |count: usize| -> Vec<f32> {
            (0..count).map(|_| rng.random_range(-1.5..1.5)).collect()
        };
        let x = draw(batch * length * config.in_channels);
        let upstream = draw(batch * length * config.out_channels);
        // Some windows share a step, as in training.
        let steps = (0..batch).map(|i| (i * 7 % 11) as f32).collect();
        Self {
            x,
            steps,
            upstream,
            batch,
            length,
        }
    }

    pub fn input(&self) -> Input<'_> {
        Input {
            x: &self.x,
            steps: &self.steps,
            batch: self.batch,
            length: self.length,
        }
    }

    /// The loss `sum(output * upstream)`.
    pub fn loss(&self) -> impl Fn(usize, &[f32], &mut [f32]) + Sync + '_ {
        let sample = self.upstream.len() / self.batch;
        move |first, output, gradient| {
            let start = first * sample;
            gradient.copy_from_slice(&self.upstream[start..start + output.len()]);
        }
    }

    pub fn output(&self, model: &mut dyn NoiseModel) -> Vec<f32> {
        let mut output = vec![f32::NAN; self.upstream.len()];
        model.forward(self.input(), &mut output).expect("forward");
        output
    }

    pub fn gradient(&self, model: &mut dyn NoiseModel) -> Vec<f32> {
        let mut gradient = vec![f32::NAN; model.config().parameter_count()];
        model
            .forward_backward(self.input(), &self.loss(), &mut gradient)
            .expect("backward");
        gradient
    }
}

/// Starting values with normalisations that are not the identity.
pub fn parameters(config: &UNetConfig, seed: u64) -> Parameters {
    let mut parameters = Parameters::init(config, seed).expect("a valid configuration");
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 1);
    for spec in config.layout().entries() {
        if spec.name.contains("norm") {
            for value in &mut parameters.values[spec.range()] {
                *value += rng.random_range(-0.3..0.3);
            }
        }
    }
    parameters
}

/// An engine that uses all of the pool that is current when it is called.
pub fn engine(parameters: &Parameters) -> Engine {
    Engine::new(parameters, EngineOptions::default()).expect("an engine")
}

/// A pool of `threads`, be they more than the machine has.
pub fn pool(threads: usize) -> rayon::ThreadPool {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    builder.build().expect("a thread pool")
}

/// One engine per instruction set of this machine, on one thread.
pub fn every_instruction_set(parameters: &Parameters) -> Vec<Engine> {
    let sets = Instructions::ALL.into_iter().filter(|set| set.available());
    sets.map(|set| {
        let options = EngineOptions {
            threads: 1,
            instructions: Some(set),
        };
        Engine::new(parameters, options).expect("an engine")
    })
    .collect()
}

/// The largest difference, relative to the largest expected magnitude.
pub fn relative_error(found: &[f32], expected: &[f32]) -> f32 {
    error_above(found, expected, f32::MIN_POSITIVE)
}

/// The same where that magnitude counts as at least `floor`.
pub fn error_above(found: &[f32], expected: &[f32], floor: f32) -> f32 {
    assert_eq!(found.len(), expected.len());
    let scale = expected
        .iter()
        .fold(floor, |max, value| max.max(value.abs()));
    let differences = found
        .iter()
        .zip(expected)
        .map(|(a, b)| (a - b).abs() / scale);
    // Not `max`, which would drop a NaN.
    differences.fold(
        0.0,
        |worst, error| if error <= worst { worst } else { error },
    )
}
