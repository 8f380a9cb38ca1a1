//! The joint network with its optimiser, wherever both are.

use super::batch::Batch;
use super::process::AXES;
use crate::error::Error;
use crate::trainer::Rates;
use dose3_engine::{Adam, AdamConfig};
use dose3_model::joint::{JointConfig, JointInput, JointNoiseModel};
use std::sync::{Mutex, PoisonError};

/// One joint network with its optimiser.
pub(crate) trait JointLearner: Send {
    /// The network.
    fn network(&self) -> &JointConfig;

    /// Forward, loss, backward, Adam. Where `tell` is set it answers with the steps since it answered last, their mean
    /// loss and the mean norm of their gradients; it may do so at any other step, if they are at hand.
    fn step(
        &mut self,
        batch: &Batch,
        rates: Rates,
        tell: bool,
    ) -> Result<Option<(usize, f64, f64)>, Error>;

    /// What the averaged weights say: fills `output`, `[batch, length, 6]`.
    fn forward_averaged(&mut self, input: JointInput<'_>, output: &mut [f32]) -> Result<(), Error>;

    /// The averaged weights.
    fn averaged(&self) -> Result<Vec<f32>, Error>;
}

/// Loss, Adam and averaged weights on the host; the network computes where it likes.
pub(super) struct HostLearner {
    model: Box<dyn JointNoiseModel>,
    values: Vec<f32>,
    gradient: Vec<f32>,
    adam: Adam,
}

impl HostLearner {
    pub(super) fn new(
        mut model: Box<dyn JointNoiseModel>,
        values: Vec<f32>,
        clip: f64,
    ) -> Result<Self, Error> {
        model.set_parameters(&values)?;
        let config = AdamConfig {
            max_grad_norm: Some(clip as f32),
            ..AdamConfig::default()
        };
        Ok(Self {
            model,
            adam: Adam::new(&values, config),
            gradient: vec![0.0; values.len()],
            values,
        })
    }
}

impl JointLearner for HostLearner {
    fn network(&self) -> &JointConfig {
        self.model.config()
    }

    fn step(
        &mut self,
        batch: &Batch,
        rates: Rates,
        _tell: bool,
    ) -> Result<Option<(usize, f64, f64)>, Error> {
        let input = batch.input();
        let (size, count) = (input.length * AXES, input.batch);
        let losses = Mutex::new(vec![0.0; count]);
        let of_chunk = |first: usize, output: &[f32], to: &mut [f32]| {
            let sequences = output.chunks_exact(size).zip(to.chunks_exact_mut(size));
            for (i, (output, to)) in sequences.enumerate() {
                let loss = batch.loss(first + i, output, Some(&mut *to));
                to.iter_mut().for_each(|g| *g /= count as f32);
                if let Ok(mut losses) = losses.lock() {
                    losses[first + i] = loss;
                }
            }
        };
        self.model
            .forward_backward(input, &of_chunk, &mut self.gradient)?;
        let losses = losses.into_inner().unwrap_or_else(PoisonError::into_inner);
        let loss = losses.iter().sum::<f64>() / count as f64;
        let (rate, decay) = (rates.learning_rate as f32, rates.ema_decay as f32);
        let norm = self
            .adam
            .step(&mut self.values, &self.gradient, rate, decay);
        if norm.is_finite() {
            self.model.set_parameters(&self.values)?;
        }
        Ok(Some((1, loss, f64::from(norm))))
    }

    fn forward_averaged(&mut self, input: JointInput<'_>, output: &mut [f32]) -> Result<(), Error> {
        self.model.set_parameters(self.adam.state().2)?;
        self.model.forward(input, output)?;
        Ok(self.model.set_parameters(&self.values)?)
    }

    fn averaged(&self) -> Result<Vec<f32>, Error> {
        Ok(self.adam.state().2.to_vec())
    }
}
