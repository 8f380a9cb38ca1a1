//! [`dose3_engine::Adam`] where the parameters are.

use burn::tensor::{Device, Tensor};
use dose3_engine::AdamConfig;
use dose3_model::burn_unet::Flat;
use dose3_model::{ModelError, ParameterLayout};

use super::network::sum;
use crate::trainer::LearnerState;

/// Parameters, moments and averaged weights on a device.
pub(super) struct DeviceAdam {
    config: AdamConfig,
    step: u64,
    values: Flat,
    m: Flat,
    v: Flat,
    average: Flat,
}

impl DeviceAdam {
    /// Starts with zero moments; the average starts at `values`.
    pub(super) fn new(
        layout: &ParameterLayout,
        values: &[f32],
        config: AdamConfig,
        device: &Device,
    ) -> Result<Self, ModelError> {
        let values = Flat::upload(layout, values, device)?;
        let zeros = values.zeros_like();
        Ok(Self {
            config,
            step: 0,
            average: values.clone(),
            m: zeros.clone(),
            v: zeros,
            values,
        })
    }

    pub(super) fn values(&self) -> &Flat {
        &self.values
    }

    pub(super) fn average(&self) -> &Flat {
        &self.average
    }

    /// As [`dose3_engine::Adam::step`], but where the gradient is not finite, neither are the parameters afterwards:
    /// whoever reads the norm, `[1]`, finds out.
    pub(super) fn step(&mut self, gradient: &Flat, rate: f32, ema_decay: f32) -> Tensor<1> {
        let squares = gradient.pieces().iter().map(|g| sum(g.clone().square()));
        let norm = squares.reduce(|a, b| a + b).expect("a parameter").sqrt();
        let AdamConfig {
            beta1,
            beta2,
            epsilon,
            max_grad_norm,
        } = self.config;
        let clip = max_grad_norm.map(|most| norm.clone().clamp_min(most).recip() * most);
        self.step += 1;
        let correction = |beta: f32| 1.0 - f64::from(beta).powf(self.step as f64);
        let rate = (f64::from(rate) / correction(beta1)) as f32;
        let scale = (1.0 / correction(beta2).sqrt()) as f32;
        for (i, g) in gradient.pieces().iter().enumerate() {
            let g = match &clip {
                Some(clip) => g.clone() * clip.clone(),
                None => g.clone(),
            };
            let m = &mut self.m.pieces_mut()[i];
            *m = m.clone() * beta1 + g.clone() * (1.0 - beta1);
            let v = &mut self.v.pieces_mut()[i];
            *v = v.clone() * beta2 + g.square() * (1.0 - beta2);
            let values = &mut self.values.pieces_mut()[i];
            let root = v.clone().sqrt() * scale + epsilon;
            *values = values.clone() - m.clone() * rate / root;
            let average = &mut self.average.pieces_mut()[i];
            let old = average.clone();
            *average = old.clone() + (values.clone() - old) * (1.0 - ema_decay);
        }
        norm
    }

    /// Copies everything to the host.
    pub(super) fn state(&self) -> Result<LearnerState, ModelError> {
        Ok(LearnerState {
            values: self.values.download()?,
            m: self.m.download()?,
            v: self.v.download()?,
            ema: self.average.download()?,
        })
    }

    /// Takes everything up again.
    pub(super) fn restore(
        &mut self,
        layout: &ParameterLayout,
        step: u64,
        state: &LearnerState,
        device: &Device,
    ) -> Result<(), ModelError> {
        let upload = |values: &[f32]| Flat::upload(layout, values, device);
        self.values = upload(&state.values)?;
        self.m = upload(&state.m)?;
        self.v = upload(&state.v)?;
        self.average = upload(&state.ema)?;
        self.step = step;
        Ok(())
    }
}
