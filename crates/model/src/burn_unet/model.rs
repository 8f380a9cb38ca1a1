use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};

use super::{Backend, UNet};
use crate::{Input, LossGradient, ModelError, NoiseModel, ParameterLayout, Parameters, UNetConfig};

/// The network on a burn device, behind [`NoiseModel`].
#[derive(Debug)]
pub struct BurnModel {
    config: UNetConfig,
    layout: ParameterLayout,
    device: Device,
    network: UNet,
}

impl BurnModel {
    /// Puts the network on a backend's default device.
    ///
    /// # Errors
    /// A backend that is not available, or parameters that do not fit their configuration.
    pub fn new(parameters: &Parameters, backend: Backend) -> Result<Self, ModelError> {
        Self::on(parameters, backend.device()?)
    }

    /// Puts the network on a device of the caller's choice.
    ///
    /// # Errors
    /// Parameters that do not fit their configuration.
    pub fn on(parameters: &Parameters, device: Device) -> Result<Self, ModelError> {
        // Forward passes with autodiff keep their graph: memory would grow (burn #4339).
        let device = device.inner();
        let network = UNet::new(parameters, &device)?;
        let config = parameters.config.clone();
        let layout = config.layout();
        Ok(Self {
            config,
            layout,
            device,
            network,
        })
    }

    /// The input on the device: `[batch, length, in]`.
    fn upload(&self, input: Input<'_>) -> Tensor<3> {
        let shape = [input.batch, input.length, self.config.in_channels];
        Tensor::from_data(TensorData::new(input.x.to_vec(), shape), &self.device)
    }
}

impl NoiseModel for BurnModel {
    fn config(&self) -> &UNetConfig {
        &self.config
    }

    fn set_parameters(&mut self, values: &[f32]) -> Result<(), ModelError> {
        let parameters = Parameters {
            config: self.config.clone(),
            values: values.to_vec(),
        };
        self.network = UNet::new(&parameters, &self.device)?;
        Ok(())
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
        crate::check_count(&self.layout, "the gradient", gradient)?;
        let network = self.network.clone().train();
        let out = network.forward(self.upload(input), input.steps);

        let values = download(out.clone().inner())?;
        let mut upstream = vec![0.0; values.len()];
        loss(0, &values, &mut upstream);
        let upstream = TensorData::new(upstream, out.dims());
        let upstream = Tensor::from_data(upstream, &self.device); // [batch, length, out]

        // The gradient of this sum is the loss's, by the chain rule.
        let flat = super::gradient(&network, (out * upstream).sum(), &self.layout)?;
        gradient.copy_from_slice(&flat.download()?);
        Ok(())
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
