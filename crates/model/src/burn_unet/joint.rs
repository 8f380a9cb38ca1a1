use burn::module::Module;
use burn::tensor::activation::silu;
use burn::tensor::{Device, Tensor, TensorData};

use super::conv::Conv;
use super::model::download;
use super::source::Source;
use super::time::Linear;
use super::{Backend, Flat, FlatNetwork};
use crate::joint::{CONDITIONS, FEATURES, JOINT_AXES, condition_features};
use crate::joint::{JointConfig, JointInput, JointNoiseModel, JointParameters};
use crate::{LossGradient, ModelError, ParameterLayout};

/// The joint network ([`crate::joint`] has its formulas).
#[derive(Module, Debug)]
pub struct JointNetwork {
    condition: Condition,
    film: Linear,
    stem: Conv,
    blocks: Vec<Block>,
    last: Linear,
    width: usize,
}

/// Two layers on the features of the conditions.
#[derive(Module, Debug)]
struct Condition {
    linear1: Linear,
    linear2: Linear,
}

#[derive(Module, Debug)]
struct Block {
    conv: Conv,
    out: Linear,
}

impl FlatNetwork for JointNetwork {
    type Config = JointConfig;

    fn layout(config: &JointConfig) -> ParameterLayout {
        config.layout()
    }

    fn from_flat(
        config: &JointConfig,
        layout: &ParameterLayout,
        values: &Flat,
    ) -> Result<Self, ModelError> {
        config.validate()?;
        let source = Source::new(layout, values);
        let condition = source.enter("condition");
        let block = |(i, &dilation): (usize, &usize)| {
            let block = source.enter("blocks").enter(i);
            Ok(Block {
                conv: Conv::dilated(&block.enter("conv"), dilation)?,
                out: Linear::new(&block.enter("out"))?,
            })
        };
        let blocks = config.dilations.iter().enumerate().map(block);
        Ok(Self {
            condition: Condition {
                linear1: Linear::new(&condition.enter("linear1"))?,
                linear2: Linear::new(&condition.enter("linear2"))?,
            },
            film: Linear::new(&source.enter("film"))?,
            stem: Conv::dilated(&source.enter("stem"), 1)?,
            blocks: blocks.collect::<Result<_, ModelError>>()?,
            last: Linear::new(&source.enter("last"))?,
            width: config.width,
        })
    }
}

impl JointNetwork {
    /// Builds the network with these parameters on a device (without autodiff; use [`Module::train`] for gradients).
    ///
    /// # Errors
    /// A configuration that is not valid, or values that do not fit it.
    pub fn new(parameters: &JointParameters, device: &Device) -> Result<Self, ModelError> {
        parameters.config.validate()?;
        let layout = parameters.layout();
        crate::check_values(&layout, &parameters.values)?;
        let values = Flat::upload(&layout, &parameters.values, device)?;
        Self::from_flat(&parameters.config, &layout, &values)
    }

    /// `x` `[batch, length, 6]` with the features of its conditions `[batch, features]`: `[batch, length, 6]`.
    ///
    /// # Panics
    /// On shapes that do not fit; [`JointInput::check`] tells beforehand.
    pub fn forward(&self, x: Tensor<3>, features: Tensor<2>) -> Tensor<3> {
        let e = silu(self.condition.linear1.forward(features));
        let e = silu(self.condition.linear2.forward(e)); // [batch, embedding]
        let film = self.film.forward(e); // [batch, blocks * 2 * width]
        let of = |column: usize| {
            let own = column * self.width..(column + 1) * self.width;
            let own = film.clone().slice([0..film.dims()[0], own]);
            own.unsqueeze_dim::<3>(1) // [batch, 1, width]
        };
        let mut h = self.stem.forward(x); // [batch, length, width]
        for (i, block) in self.blocks.iter().enumerate() {
            let u = block.conv.forward(h.clone());
            let v = silu(u * (of(2 * i) + 1.0) + of(2 * i + 1));
            h = h + pointwise(&block.out, v);
        }
        pointwise(&self.last, silu(h))
    }
}

/// A linear layer at every step: `[batch, length, in]` to `[batch, length, out]`.
fn pointwise(layer: &Linear, x: Tensor<3>) -> Tensor<3> {
    let [batch, length, channels] = x.dims();
    let rows = layer.forward(x.reshape([batch * length, channels]));
    let out = rows.dims()[1];
    rows.reshape([batch, length, out])
}

/// The joint network on a burn device, behind [`JointNoiseModel`].
#[derive(Debug)]
pub struct BurnJoint {
    config: JointConfig,
    layout: ParameterLayout,
    device: Device,
    network: JointNetwork,
}

impl BurnJoint {
    /// Puts the network on a backend's default device.
    ///
    /// # Errors
    /// A backend that is not available, or parameters that do not fit their configuration.
    pub fn new(parameters: &JointParameters, backend: Backend) -> Result<Self, ModelError> {
        Self::on(parameters, backend.device()?)
    }

    /// Puts the network on a device of the caller's choice.
    ///
    /// # Errors
    /// Parameters that do not fit their configuration.
    pub fn on(parameters: &JointParameters, device: Device) -> Result<Self, ModelError> {
        // Forward passes with autodiff keep their graph: memory would grow (burn #4339).
        let device = device.inner();
        Ok(Self {
            network: JointNetwork::new(parameters, &device)?,
            config: parameters.config.clone(),
            layout: parameters.layout(),
            device,
        })
    }

    /// Values `[batch, length, 6]` and features `[batch, features]` on the device.
    fn upload(&self, input: JointInput<'_>) -> (Tensor<3>, Tensor<2>) {
        let shape = [input.batch, input.length, JOINT_AXES];
        let x = Tensor::from_data(TensorData::new(input.x.to_vec(), shape), &self.device);
        let mut features = vec![0.0; input.batch * FEATURES];
        let own = input.conditions.chunks_exact(CONDITIONS);
        for (own, features) in own.zip(features.chunks_exact_mut(FEATURES)) {
            condition_features(own, features);
        }
        let features = TensorData::new(features, [input.batch, FEATURES]);
        (x, Tensor::from_data(features, &self.device))
    }
}

impl JointNoiseModel for BurnJoint {
    fn config(&self) -> &JointConfig {
        &self.config
    }

    fn set_parameters(&mut self, values: &[f32]) -> Result<(), ModelError> {
        let parameters = JointParameters {
            config: self.config.clone(),
            values: values.to_vec(),
        };
        self.network = JointNetwork::new(&parameters, &self.device)?;
        Ok(())
    }

    fn forward(&mut self, input: JointInput<'_>, output: &mut [f32]) -> Result<(), ModelError> {
        input.check()?;
        input.check_output(output)?;
        let (x, features) = self.upload(input);
        let out = self.network.forward(x, features);
        output.copy_from_slice(&download(out)?);
        Ok(())
    }

    fn forward_backward(
        &mut self,
        input: JointInput<'_>,
        loss: &LossGradient<'_>,
        gradient: &mut [f32],
    ) -> Result<(), ModelError> {
        input.check()?;
        crate::check_count(&self.layout, "the gradient", gradient)?;
        let network = self.network.clone().train();
        let (x, features) = self.upload(input);
        let out = network.forward(x, features);

        let values = download(out.clone().inner())?;
        let mut upstream = vec![0.0; values.len()];
        loss(0, &values, &mut upstream);
        let upstream = TensorData::new(upstream, out.dims());
        let upstream = Tensor::from_data(upstream, &self.device); // [batch, length, 6]

        // The gradient of this sum is the loss's, by the chain rule.
        let flat = super::gradient(&network, (out * upstream).sum(), &self.layout)?;
        gradient.copy_from_slice(&flat.download()?);
        Ok(())
    }
}
