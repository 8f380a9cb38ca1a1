//! The joint network, trained where it lies.

use burn::tensor::{Device, Tensor, TensorData};
use dose3_model::burn_unet::{Backend, JointNetwork};
use dose3_model::joint::{FEATURES, JOINT_AXES, JointConfig, JointInput, JointParameters};

use super::loss::upload;
use super::network::{DeviceNetwork, Loss, sum};
use crate::error::Error;
use crate::joint::{Batch, JointLearner};
use crate::trainer::Rates;

/// As [`DeviceLearner`](super::DeviceLearner), for the joint network.
pub(crate) struct JointDeviceLearner(DeviceNetwork<JointNetwork>);

impl JointDeviceLearner {
    /// Puts the network on a backend's default device.
    pub(crate) fn new(
        parameters: &JointParameters,
        clip: f64,
        backend: Backend,
    ) -> Result<Self, Error> {
        Ok(Self(DeviceNetwork::new(parameters, clip, backend)?))
    }

    /// Values `[batch, length, 6]` and features `[batch, features]`.
    fn upload(&self, input: JointInput<'_>) -> Result<(Tensor<3>, Tensor<2>), Error> {
        input.check()?;
        let device = self.0.device();
        let shape = [input.batch, input.length, JOINT_AXES];
        let x = upload(input.x.to_vec(), shape, device);
        let features = TensorData::new(input.features(), [input.batch, FEATURES]);
        Ok((x, Tensor::from_data(features, device)))
    }
}

impl JointLearner for JointDeviceLearner {
    fn network(&self) -> &JointConfig {
        self.0.config()
    }

    fn step(
        &mut self,
        batch: &Batch,
        rates: Rates,
        tell: bool,
    ) -> Result<Option<(usize, f64, f64)>, Error> {
        let (x, features) = self.upload(batch.input())?;
        let loss = pseudo_huber(batch, self.0.device());
        self.0
            .step(|network| network.forward(x, features), loss, rates)?;
        if !tell {
            return Ok(None);
        }
        let (steps, sums) = self.0.sums()?;
        let mean = |i: usize| sums[i] / steps as f64;
        Ok(Some((steps, mean(0), mean(1))))
    }

    fn forward_averaged(&mut self, input: JointInput<'_>, output: &mut [f32]) -> Result<(), Error> {
        input.check_output(output)?;
        let (x, features) = self.upload(input)?;
        let own = self.0.averaged(|network| network.forward(x, features))?;
        output.copy_from_slice(&own);
        Ok(())
    }

    fn averaged(&self) -> Result<Vec<f32>, Error> {
        Ok(self.0.average()?)
    }
}

/// The mean of `sqrt(1 + e^2) - 1` over noised axes and steps, then over sequences ([`Batch::loss`]).
fn pseudo_huber(batch: &Batch, device: &Device) -> impl FnOnce(Tensor<3>) -> Loss + use<> {
    let input = batch.input();
    let shape = [input.batch, input.length, JOINT_AXES];
    let target = upload(batch.target.clone(), shape, device);
    let weight = |noised: &[bool; JOINT_AXES]| {
        let count = noised.iter().filter(|n| **n).count().max(1);
        let own = 1.0 / (count * input.length * input.batch) as f32;
        noised.map(|noised| if noised { own } else { 0.0 })
    };
    let weights: Vec<f32> = batch.noised.iter().flat_map(weight).collect();
    let weights = upload(weights, [input.batch, 1, JOINT_AXES], device);
    move |output| {
        let error = output - target;
        let square = error.clone().square();
        let root = (square.clone() + 1.0).sqrt();
        let loss = square / (root.clone() + 1.0) * weights.clone();
        Loss {
            terms: sum(loss),
            gradient: error / root * weights,
        }
    }
}
