use burn::module::Module;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::JemConfig;
use super::classifier::{Classifier, log_sum_exp};
use crate::Error;
use crate::layers::{download, upload};
use crate::random::{jitter, normal};

/// Draws from the energy by stochastic gradient Langevin dynamics, with persistent chains.
pub(super) struct Langevin<'a> {
    config: &'a JemConfig,
    shape: [usize; 3],
    buffer: Vec<f32>, // [config.buffer, length, channels]
    rng: ChaCha8Rng,
}

impl<'a> Langevin<'a> {
    pub(super) fn new(
        config: &'a JemConfig,
        length: usize,
        channels: usize,
        mut rng: ChaCha8Rng,
    ) -> Self {
        let size = config.buffer * length * channels;
        let buffer = (0..size).map(|_| normal(&mut rng)).collect();
        Self {
            config,
            shape: [config.batch, length, channels],
            buffer,
            rng,
        }
    }

    /// One batch of samples under `network`; the chains' new ends go to the buffer.
    ///
    /// Each step is `x <- x + step_size * grad logsumexp f(x) + noise * N(0, 1)` (JEM, equation 7,
    /// with step size and noise apart as in its experiments).
    pub(super) fn sample(&mut self, network: &Classifier) -> Result<Vec<f32>, Error> {
        let network = network.valid(); // no gradients for the weights
        let dimension = self.shape[1] * self.shape[2];
        let chains = self.choose();
        let mut x = Vec::with_capacity(chains.len() * dimension);
        for &chain in &chains {
            if self.rng.random::<f64>() < self.config.reinit {
                x.extend((0..dimension).map(|_| normal(&mut self.rng)));
            } else {
                x.extend_from_slice(&self.buffer[chain * dimension..][..dimension]);
            }
        }
        for _ in 0..self.config.langevin_steps {
            let gradient = ascent(&network, x.clone(), self.shape)?;
            for (value, slope) in x.iter_mut().zip(gradient) {
                *value += self.config.langevin_step_size as f32 * slope;
            }
            jitter(&mut x, self.config.langevin_noise, &mut self.rng);
        }
        for (&chain, end) in chains.iter().zip(x.chunks_exact(dimension)) {
            self.buffer[chain * dimension..][..dimension].copy_from_slice(end);
        }
        Ok(x)
    }

    /// Different chains of the buffer, at random.
    fn choose(&mut self) -> Vec<usize> {
        rand::seq::index::sample(&mut self.rng, self.config.buffer, self.config.batch).into_vec()
    }
}

/// Gradient of each sample's `logsumexp f(x)` by x.
fn ascent(network: &Classifier, x: Vec<f32>, shape: [usize; 3]) -> Result<Vec<f32>, Error> {
    let x = upload(x, shape).autodiff().require_grad();
    let gradients = log_sum_exp(network.forward(x.clone())).sum().backward();
    match x.grad(&gradients) {
        Some(gradient) => download(gradient),
        None => Err(Error::Compute("the energy has no gradient".to_owned())),
    }
}
