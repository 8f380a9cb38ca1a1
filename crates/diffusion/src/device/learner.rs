//! A network of the pair that is trained where it lies.

use burn::tensor::Tensor;
use dose3_model::burn_unet::{Backend, UNet};
use dose3_model::{Input, ModelError, Parameters, UNetConfig};

use super::loss;
use super::network::DeviceNetwork;
use crate::error::Error;
use crate::trainer::{BranchBatch, Learner, LearnerState, Losses, Objective, Rates};

/// Parameters, moments and averaged weights are on the device. A step takes its batch there and brings nothing back;
/// losses come when they are asked for.
pub struct DeviceLearner(DeviceNetwork<UNet>);

impl DeviceLearner {
    /// Puts a network on a backend's default device.
    ///
    /// # Errors
    /// A backend that is not available, or parameters that do not fit their configuration.
    pub fn new(parameters: &Parameters, clip: f64, backend: Backend) -> Result<Self, Error> {
        Ok(Self(DeviceNetwork::new(parameters, clip, backend)?))
    }

    fn upload(&self, input: Input<'_>) -> Result<Tensor<3>, ModelError> {
        input.check(self.0.config())?;
        let shape = [input.batch, input.length, self.0.config().in_channels];
        Ok(loss::upload(input.x.to_vec(), shape, self.0.device()))
    }
}

impl Learner for DeviceLearner {
    fn network(&self) -> &UNetConfig {
        self.0.config()
    }

    fn step(
        &mut self,
        objective: &Objective<'_>,
        batch: &BranchBatch<'_>,
        rates: Rates,
        tell: bool,
    ) -> Result<Option<Losses>, Error> {
        let x = self.upload(batch.input)?;
        let device = self.0.device().clone();
        let loss = loss::of(objective, batch, &device);
        let forward = |network: &UNet| network.forward(x, batch.input.steps);
        self.0.step(forward, loss, rates)?;
        if !tell {
            return Ok(None);
        }
        let (steps, sums) = self.0.sums()?;
        Ok(Some(Losses {
            steps,
            eps: sums[0],
            x0: sums[1],
            gradient: sums[2],
        }))
    }

    fn forward_averaged(&mut self, input: Input<'_>, output: &mut [f32]) -> Result<(), Error> {
        input.check_output(self.0.config(), output)?;
        let x = self.upload(input)?;
        let own = self.0.averaged(|network| network.forward(x, input.steps))?;
        output.copy_from_slice(&own);
        Ok(())
    }

    fn averaged(&self) -> Result<Vec<f32>, Error> {
        Ok(self.0.average()?)
    }

    fn state(&self) -> Result<LearnerState, Error> {
        Ok(self.0.state()?)
    }

    fn restore(&mut self, step: u64, state: &LearnerState) -> Result<(), Error> {
        Ok(self.0.restore(step, state)?)
    }
}
