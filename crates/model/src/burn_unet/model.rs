use burn::tensor::{Device, Tensor, TensorData};

use super::{Backend, Flat, FlatNetwork, UNet};
use crate::{Input, LossGradient, ModelError, NoiseModel, ParameterLayout, Parameters, UNetConfig};
use crate::{NetworkConfig, check_count, check_values};

/// A network on a burn device.
#[derive(Debug)]
pub struct BurnNetwork<N: FlatNetwork> {
    pub(super) config: N::Config,
    layout: ParameterLayout,
    device: Device,
    pub(super) network: N,
}

impl<N: FlatNetwork> BurnNetwork<N> {
    /// Puts the network on a backend's default device.
    ///
    /// # Errors
    /// A backend that is not available, or parameters that do not fit their configuration.
    pub fn new(parameters: &Parameters<N::Config>, backend: Backend) -> Result<Self, ModelError> {
        Self::on(parameters, backend.device()?)
    }

    /// Puts the network on a device of the caller's choice.
    ///
    /// # Errors
    /// Parameters that do not fit their configuration.
    pub fn on(parameters: &Parameters<N::Config>, device: Device) -> Result<Self, ModelError> {
        // Forward passes with autodiff keep their graph: memory would grow (burn #4339).
        let device = device.inner();
        Ok(Self {
            network: N::new(parameters, &device)?,
            config: parameters.config.clone(),
            layout: parameters.config.layout(),
            device,
        })
    }

    /// Replaces all parameters.
    pub(super) fn replace(&mut self, values: &[f32]) -> Result<(), ModelError> {
        check_values(&self.layout, values)?;
        let values = Flat::upload(&self.layout, values, &self.device)?;
        self.network = N::from_flat(&self.config, &self.layout, &values)?;
        Ok(())
    }

    pub(super) fn on_device<const D: usize>(&self, values: &[f32], shape: [usize; D]) -> Tensor<D> {
        Tensor::from_data(TensorData::new(values.to_vec(), shape), &self.device)
    }

    /// Runs forward, asks `loss` for the gradient at the output, and runs backward.
    pub(super) fn backward(
        &self,
        forward: impl FnOnce(&N) -> Tensor<3>,
        loss: &LossGradient<'_>,
        gradient: &mut [f32],
    ) -> Result<(), ModelError> {
        check_count(&self.layout, "the gradient", gradient)?;
        let network = self.network.clone().train();
        let out = forward(&network);

        let values = download(out.clone().inner())?;
        let mut upstream = vec![0.0; values.len()];
        loss(0, &values, &mut upstream);
        let upstream = self.on_device(&upstream, out.dims()); // [batch, length, out]

        // The gradient of this sum is the loss's, by the chain rule.
        let flat = super::gradient(&network, (out * upstream).sum(), &self.layout)?;
        gradient.copy_from_slice(&flat.download()?);
        Ok(())
    }
}

/// A network of the pair on a burn device, behind [`NoiseModel`].
pub type BurnModel = BurnNetwork<UNet>;

impl BurnModel {
    /// The input on the device: `[batch, length, in]`.
    fn upload(&self, input: Input<'_>) -> Tensor<3> {
        self.on_device(
            input.x,
            [input.batch, input.length, self.config.in_channels],
        )
    }
}

impl NoiseModel for BurnModel {
    fn config(&self) -> &UNetConfig {
        &self.config
    }

    fn set_parameters(&mut self, values: &[f32]) -> Result<(), ModelError> {
        self.replace(values)
    }

    fn forward(&mut self, input: Input<'_>, output: &mut [f32]) -> Result<(), ModelError> {
        input.check(&self.config)?;
        input.check_output(&self.config, output)?;
        let out = self.network.forward(self.upload(input), input.steps);
        output.copy_from_slice(&download(out)?);
        Ok(())
    }

    fn forward_backward(
        &mut self,
        input: Input<'_>,
        loss: &LossGradient<'_>,
        gradient: &mut [f32],
    ) -> Result<(), ModelError> {
        input.check(&self.config)?;
        let x = self.upload(input);
        self.backward(|network| network.forward(x, input.steps), loss, gradient)
    }
}

/// Copies a tensor to the host.
///
/// # Errors
/// A failing backend.
pub fn download<const D: usize>(tensor: Tensor<D>) -> Result<Vec<f32>, ModelError> {
    let data = tensor
        .try_into_data()
        .map_err(|error| ModelError::Compute(error.to_string()))?;
    data.try_into_vec()
        .map_err(|error| ModelError::Compute(error.to_string()))
}
