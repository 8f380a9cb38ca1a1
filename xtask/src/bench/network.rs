//! One UNet pair on one backend: a forward pass and a training step.

use super::{Shape, best};
use anyhow::{Context, Result};
use dose3::backend::Backend;
use dose3_engine::{Adam, AdamConfig, Engine, EngineOptions, Instructions};
use dose3_model::{Input, NoiseModel, PairConfig, PairParameters};

struct Net {
    model: Box<dyn NoiseModel>,
    adam: Adam,
    values: Vec<f32>,
    gradient: Vec<f32>,
    x: Vec<f32>,
    output: Vec<f32>,
}

/// Both networks of a shape, with a thread pool of their own size around them.
pub struct Pair {
    nets: Vec<Net>,
    steps: Vec<f32>,
    shape: Shape,
    pool: rayon::ThreadPool,
}

impl Pair {
    /// # Errors
    /// A shape that is no network, a backend that cannot be had.
    pub fn new(shape: &Shape, backend: Backend, threads: usize) -> Result<Self> {
        let parameters = parameters(shape)?;
        let models = backend.load(&parameters, threads)?;
        let samples = shape.batch * shape.length;
        let nets = [
            (models.translation, parameters.translation),
            (models.rotation, parameters.rotation),
        ]
        .map(|(model, parameters)| Net {
            model,
            adam: Adam::new(&parameters.values, AdamConfig::default()),
            gradient: vec![0.0; parameters.values.len()],
            x: (0..samples * parameters.config.in_channels)
                .map(|i| (i as f32 * 0.37).sin())
                .collect(),
            output: vec![0.0; samples * parameters.config.out_channels],
            values: parameters.values,
        });
        Ok(Self {
            nets: nets.into(),
            steps: (0..shape.batch).map(|i| (i % 30) as f32).collect(),
            shape: shape.clone(),
            pool: pool(threads)?,
        })
    }

    /// The shortest forward pass within `seconds`.
    ///
    /// # Errors
    /// A failing backend.
    pub fn forward(&mut self, seconds: f64) -> Result<f64> {
        let (nets, steps, shape) = (&mut self.nets, &self.steps, &self.shape);
        self.pool.install(|| {
            best(seconds, || {
                for net in nets.iter_mut() {
                    let input = shape.input(&net.x, steps);
                    net.model.forward(input, &mut net.output)?;
                }
                Ok(())
            })
        })
    }

    /// The shortest training step within `seconds`: forward, backward and Adam.
    ///
    /// # Errors
    /// A failing backend.
    pub fn train(&mut self, seconds: f64) -> Result<f64> {
        let (nets, steps, shape) = (&mut self.nets, &self.steps, &self.shape);
        let loss = |_: usize, output: &[f32], gradient: &mut [f32]| {
            let scale = 2.0 / (shape.batch * shape.length * 3) as f32;
            for (g, o) in gradient.iter_mut().zip(output) {
                *g = scale * o;
            }
        };
        self.pool.install(|| {
            best(seconds, || {
                for net in nets.iter_mut() {
                    let input = shape.input(&net.x, steps);
                    net.model
                        .forward_backward(input, &loss, &mut net.gradient)?;
                    net.adam.step(&mut net.values, &net.gradient, 1e-4, 0.995);
                    net.model.set_parameters(&net.values)?;
                }
                Ok(())
            })
        })
    }
}

impl Shape {
    fn input<'a>(&self, x: &'a [f32], steps: &'a [f32]) -> Input<'a> {
        Input {
            x,
            steps,
            batch: self.batch,
            length: self.length,
        }
    }
}

/// A pool of `threads`.
///
/// # Errors
/// Threads that cannot be started.
pub fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .context("cannot start threads")
}

/// Weights as training starts with them: speed does not depend on them.
///
/// # Errors
/// A shape that is no network.
pub fn parameters(shape: &Shape) -> Result<PairParameters> {
    let config = PairConfig::new(shape.width, &shape.multipliers);
    Ok(PairParameters::init(&config, 1)?)
}

/// Floating-point operations of a forward pass of the pair on one window, and the vector
/// instructions that the engine takes.
///
/// # Errors
/// A shape that is no network.
pub fn work(shape: &Shape) -> Result<(f64, Instructions)> {
    let parameters = parameters(shape)?;
    let options = EngineOptions {
        threads: 1,
        ..EngineOptions::default()
    };
    let engines = [
        Engine::new(&parameters.translation, options.clone())?,
        Engine::new(&parameters.rotation, options)?,
    ];
    let flops = engines.iter().map(|e| e.flops(shape.length) as f64).sum();
    Ok((flops, engines[0].instructions()))
}
