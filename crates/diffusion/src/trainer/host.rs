//! A network with its optimiser on the host.

use super::learner::{BranchBatch, Learner, LearnerState, Losses, Objective, Rates};
use crate::error::Error;
use crate::loss::SampleLoss;
use dose3_engine::{Adam, AdamConfig};
use dose3_model::{Input, NoiseModel, UNetConfig};
use std::sync::{Mutex, PoisonError};

/// Loss, Adam and averaged weights on the host; the network computes where it likes.
pub(super) struct HostLearner {
    model: Box<dyn NoiseModel>,
    values: Vec<f32>,
    gradient: Vec<f32>,
    adam: Adam,
}

impl HostLearner {
    pub(super) fn new(model: Box<dyn NoiseModel>, values: Vec<f32>, clip: f64) -> Self {
        let config = AdamConfig {
            max_grad_norm: Some(clip as f32),
            ..AdamConfig::default()
        };
        Self {
            model,
            adam: Adam::new(&values, config),
            gradient: vec![0.0; values.len()],
            values,
        }
    }
}

impl Learner for HostLearner {
    fn network(&self) -> &UNetConfig {
        self.model.config()
    }

    fn step(
        &mut self,
        objective: &Objective<'_>,
        batch: &BranchBatch<'_>,
        rates: Rates,
        _tell: bool,
    ) -> Result<Option<Losses>, Error> {
        self.model.set_parameters(&self.values)?;
        let input = batch.input;
        // Per sample, so that the sum does not depend on which thread came first.
        let losses = Mutex::new(vec![SampleLoss::default(); input.batch]);
        let size = input.length * self.model.config().out_channels;
        let callback = |first: usize, out: &[f32], grad: &mut [f32]| {
            let chunk: Vec<SampleLoss> = out
                .chunks_exact(size)
                .zip(grad.chunks_exact_mut(size))
                .enumerate()
                .map(|(i, (out, grad))| batch.loss(objective, first + i, out, grad))
                .collect();
            // Held for a copy only: no thread that holds it can be made to wait.
            if let Ok(mut losses) = losses.lock() {
                losses[first..first + chunk.len()].copy_from_slice(&chunk);
            }
        };
        self.model
            .forward_backward(input, &callback, &mut self.gradient)?;
        let losses = losses.into_inner().unwrap_or_else(PoisonError::into_inner);
        let n = losses.len() as f64;
        let mut mean = Losses {
            steps: 1,
            ..Losses::default()
        };
        for loss in &losses {
            mean.eps += loss.eps / n;
            mean.x0 += loss.x0 / n;
        }
        let (rate, decay) = (rates.learning_rate as f32, rates.ema_decay as f32);
        let norm = self
            .adam
            .step(&mut self.values, &self.gradient, rate, decay);
        mean.gradient = f64::from(norm);
        Ok(Some(mean))
    }

    fn forward_averaged(&mut self, input: Input<'_>, output: &mut [f32]) -> Result<(), Error> {
        self.model.set_parameters(self.adam.state().2)?;
        Ok(self.model.forward(input, output)?)
    }

    fn averaged(&self) -> Result<Vec<f32>, Error> {
        Ok(self.adam.state().2.to_vec())
    }

    fn state(&self) -> Result<LearnerState, Error> {
        let (m, v, ema) = self.adam.state();
        Ok(LearnerState {
            values: self.values.clone(),
            m: m.to_vec(),
            v: v.to_vec(),
            ema: ema.to_vec(),
        })
    }

    fn restore(&mut self, step: u64, state: &LearnerState) -> Result<(), Error> {
        let (m, v, ema) = self.adam.state_mut();
        let pairs = [
            (self.values.as_mut_slice(), &state.values),
            (m, &state.m),
            (v, &state.v),
            (ema, &state.ema),
        ];
        for (own, new) in pairs {
            crate::error::check_len("a checkpoint's values", own.len(), new.len())?;
            own.copy_from_slice(new);
        }
        self.adam.set_step(step);
        Ok(())
    }
}
