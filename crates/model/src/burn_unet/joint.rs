use burn::module::{Module, Param};
use burn::tensor::activation::silu;
use burn::tensor::module::conv1d;
use burn::tensor::ops::ConvOptions;
use burn::tensor::{Device, Tensor, TensorData};

use super::model::{channels_first, channels_last, download};
use super::source::Source;
use super::time::Linear;
use super::{Backend, gradients};
use crate::joint::{CONDITIONS, FEATURES, JOINT_AXES, condition_features};
use crate::joint::{JointConfig, JointInput, JointNoiseModel, JointParameters};
use crate::{LossGradient, ModelError, ParameterLayout};

/// The joint network ([`crate::joint`] has its formulas).
#[derive(Module, Debug)]
pub struct JointNetwork {
    condition: Condition,
    film: Linear,
    stem: Taps,
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

/// A convolution of three taps, `dilation` steps apart, that keeps the length.
#[derive(Module, Debug)]
struct Taps {
    weight: Param<Tensor<3>>, // [out, in, 3]
    bias: Option<Param<Tensor<1>>>,
    dilation: usize,
}

#[derive(Module, Debug)]
struct Block {
    conv: Taps,
    out: Linear,
}

impl Taps {
    fn new(source: &Source<'_>, dilation: usize) -> Result<Self, ModelError> {
        let bias = source
            .has("bias")
            .then(|| source.tensor("bias"))
            .transpose()?;
        Ok(Self {
            weight: source.tensor("weight")?,
            bias,
            dilation,
        })
    }

    /// `[batch, in, length]` to `[batch, out, length]`.
    fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let bias = self.bias.as_ref().map(Param::val);
        let options = ConvOptions::new([1], [self.dilation], [self.dilation], 1);
        conv1d(x, self.weight.val(), bias, options)
    }
}

impl JointNetwork {
    /// Builds the network with these parameters on a device (without autodiff; use [`Module::train`] for gradients).
    ///
    /// # Errors
    /// A configuration that is not valid, or values that do not fit it.
    pub fn new(parameters: &JointParameters, device: &Device) -> Result<Self, ModelError> {
        let config = &parameters.config;
        config.validate()?;
        let layout = config.layout();
        crate::check_values(&layout, &parameters.values)?;
        let source = Source::new(&layout, &parameters.values, device);
        let condition = source.enter("condition");
        let block = |(i, &dilation): (usize, &usize)| {
            let block = source.enter("blocks").enter(i);
            Ok(Block {
                conv: Taps::new(&block.enter("conv"), dilation)?,
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
            stem: Taps::new(&source.enter("stem"), 1)?,
            blocks: blocks.collect::<Result<_, ModelError>>()?,
            last: Linear::new(&source.enter("last"))?,
            width: config.width,
        })
    }

    /// `x` `[batch, 6, length]` with the features of its conditions `[batch, features]`: `[batch, 6, length]`.
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
            own.unsqueeze_dim::<3>(2) // [batch, width, 1]
        };
        let mut h = self.stem.forward(x); // [batch, width, length]
        for (i, block) in self.blocks.iter().enumerate() {
            let u = block.conv.forward(h.clone());
            let v = silu(u * (of(2 * i) + 1.0) + of(2 * i + 1));
            h = h + pointwise(&block.out, v);
        }
        pointwise(&self.last, silu(h))
    }
}

/// A linear layer at every step: `[batch, in, length]` to `[batch, out, length]`.
fn pointwise(layer: &Linear, x: Tensor<3>) -> Tensor<3> {
    let [batch, channels, length] = x.dims();
    let rows = channels_last(x).reshape([batch * length, channels]);
    let rows = layer.forward(rows);
    let out = rows.dims()[1];
    channels_first(rows.reshape([batch, length, out]))
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

    /// Values `[batch, 6, length]` and features `[batch, features]` on the device.
    fn upload(&self, input: JointInput<'_>) -> (Tensor<3>, Tensor<2>) {
        let shape = [input.batch, input.length, JOINT_AXES];
        let x = Tensor::from_data(TensorData::new(input.x.to_vec(), shape), &self.device);
        let mut features = vec![0.0; input.batch * FEATURES];
        let own = input.conditions.chunks_exact(CONDITIONS);
        for (own, features) in own.zip(features.chunks_exact_mut(FEATURES)) {
            condition_features(own, features);
        }
        let features = TensorData::new(features, [input.batch, FEATURES]);
        (channels_first(x), Tensor::from_data(features, &self.device))
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
        output.copy_from_slice(&download(channels_last(out))?);
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
        let out = channels_last(network.forward(x, features));

        let values = download(out.clone().inner())?;
        let mut upstream = vec![0.0; values.len()];
        loss(0, &values, &mut upstream);
        let upstream = TensorData::new(upstream, out.dims());
        let upstream = Tensor::from_data(upstream, &self.device); // [batch, length, 6]

        // The gradient of this sum is the loss's, by the chain rule.
        let gradients = (out * upstream).sum().backward();
        let flat = gradients::collect(&network, gradients, &self.layout)?;
        gradient.copy_from_slice(&download(flat)?);
        Ok(())
    }
}
