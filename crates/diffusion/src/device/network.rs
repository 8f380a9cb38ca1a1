//! A network that is trained where it lies.

use burn::tensor::{Device, Tensor};
use dose3_engine::AdamConfig;
use dose3_model::burn_unet::{Backend, Flat, FlatNetwork, download, gradient};
use dose3_model::{ModelError, NetworkConfig, ParameterLayout, Parameters, check_values};
use std::marker::PhantomData;

use super::adam::DeviceAdam;
use crate::trainer::{LearnerState, Rates};

/// A loss in closed form at the network's output.
pub(super) struct Loss {
    /// Its gradient with respect to the output.
    pub(super) gradient: Tensor<3>,
    /// What the log keeps of it, `[terms]`.
    pub(super) terms: Tensor<1>,
}

/// The sum of all values, `[1]`: row by row of a square, then what is left. GPUs add the parts of burn's own `sum` up in
/// the order in which they are done, so that no two runs would agree to the bit, and sum a long row in one thread.
pub(super) fn sum<const D: usize>(values: Tensor<D>) -> Tensor<1> {
    let count = values.shape().num_elements();
    let values = values.reshape([count]);
    let side = count.isqrt();
    if side < 64 {
        return values.sum_dim(0);
    }
    let (rows, rest) = (count / side, count % side);
    let square = values.clone().narrow(0, 0, rows * side);
    let total = square.reshape([rows, side]).sum_dim(1).reshape([rows]);
    let total = total.sum_dim(0);
    match rest {
        0 => total,
        _ => total + values.narrow(0, rows * side, rest).sum_dim(0),
    }
}

/// A network with its optimiser on a device. A step copies its batch there and nothing back.
pub(super) struct DeviceNetwork<N: FlatNetwork> {
    config: N::Config,
    layout: ParameterLayout,
    device: Device,
    adam: DeviceAdam,
    /// Steps, and sums over them of the loss's terms and the gradient's norm, since they were read.
    sums: Option<(usize, Tensor<1>)>,
    kind: PhantomData<fn() -> N>,
}

impl<N: FlatNetwork> DeviceNetwork<N> {
    /// Puts the network on a backend's default device.
    pub(super) fn new(
        parameters: &Parameters<N::Config>,
        clip: f64,
        backend: Backend,
    ) -> Result<Self, ModelError> {
        let Parameters { config, values } = parameters;
        config.validate()?;
        let layout = config.layout();
        check_values(&layout, values)?;
        // Forward passes with autodiff keep their graph: memory would grow (burn #4339).
        let device = backend.device()?.inner();
        let adam = AdamConfig {
            max_grad_norm: Some(clip as f32),
            ..AdamConfig::default()
        };
        Ok(Self {
            adam: DeviceAdam::new(&layout, values, adam, &device)?,
            config: config.clone(),
            layout,
            device,
            sums: None,
            kind: PhantomData,
        })
    }

    pub(super) fn config(&self) -> &N::Config {
        &self.config
    }

    pub(super) fn device(&self) -> &Device {
        &self.device
    }

    /// Forward, loss, backward, Adam; waits for none of them.
    pub(super) fn step(
        &mut self,
        forward: impl FnOnce(&N) -> Tensor<3>,
        loss: impl FnOnce(Tensor<3>) -> Loss,
        rates: Rates,
    ) -> Result<(), ModelError> {
        let network = self.network(self.adam.values())?.train();
        let output = forward(&network);
        let loss = loss(output.clone().inner());
        // The gradient of this sum is the loss's, by the chain rule.
        let gradient = gradient(&network, (output * loss.gradient).sum(), &self.layout)?;
        drop(network);
        let (rate, decay) = (rates.learning_rate as f32, rates.ema_decay as f32);
        let norm = self.adam.step(&gradient, rate, decay);
        let own = Tensor::cat(vec![loss.terms, norm], 0);
        self.sums = Some(match self.sums.take() {
            Some((steps, sums)) => (steps + 1, sums + own),
            None => (1, own),
        });
        Ok(())
    }

    /// Reads the sums, waiting for all steps: how many they are over, the loss's terms and last the gradient's norm.
    pub(super) fn sums(&mut self) -> Result<(usize, Vec<f64>), ModelError> {
        let Some((steps, sums)) = self.sums.take() else {
            return Ok((0, Vec::new()));
        };
        let sums = download(sums)?;
        Ok((steps, sums.into_iter().map(f64::from).collect()))
    }

    /// The output of the averaged weights, on the host.
    pub(super) fn averaged(
        &self,
        forward: impl FnOnce(&N) -> Tensor<3>,
    ) -> Result<Vec<f32>, ModelError> {
        download(forward(&self.network(self.adam.average())?))
    }

    pub(super) fn average(&self) -> Result<Vec<f32>, ModelError> {
        self.adam.average().download()
    }

    pub(super) fn state(&self) -> Result<LearnerState, ModelError> {
        self.adam.state()
    }

    pub(super) fn restore(&mut self, step: u64, state: &LearnerState) -> Result<(), ModelError> {
        self.sums = None;
        self.adam.restore(&self.layout, step, state, &self.device)
    }

    fn network(&self, values: &Flat) -> Result<N, ModelError> {
        N::from_flat(&self.config, &self.layout, values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::TensorData;

    #[test]
    fn sums_leave_nothing_out() {
        let device = Backend::Flex.device().unwrap();
        for count in [
            1,
            5,
            64 * 64 - 1,
            64 * 64,
            64 * 64 + 1,
            70 * 70 + 69,
            30_011,
        ] {
            let values: Vec<f32> = (0..count).map(|i| (i % 7) as f32).collect();
            let expected: f32 = values.iter().sum();
            let values = Tensor::<1>::from_data(TensorData::new(values, [count]), &device);
            // Whole numbers below 2^24: exact in any order.
            assert_eq!(download(sum(values)).unwrap(), [expected], "{count} values");
        }
    }
}
