use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::activation::silu;

use super::conv::Conv;
use super::model::{BurnNetwork, download};
use super::source::Source;
use super::time::Linear;
use super::{Flat, FlatNetwork};
use crate::joint::{FEATURES, JOINT_AXES, JointConfig, JointInput, JointNoiseModel};
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
pub type BurnJoint = BurnNetwork<JointNetwork>;

impl BurnJoint {
    /// Values `[batch, length, 6]` and features `[batch, features]` on the device.
    fn upload(&self, input: JointInput<'_>) -> (Tensor<3>, Tensor<2>) {
        let x = self.on_device(input.x, [input.batch, input.length, JOINT_AXES]);
        (
            x,
            self.on_device(&input.features(), [input.batch, FEATURES]),
        )
    }
}

impl JointNoiseModel for BurnJoint {
    fn config(&self) -> &JointConfig {
        &self.config
    }

    fn set_parameters(&mut self, values: &[f32]) -> Result<(), ModelError> {
        self.replace(values)
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
        let (x, features) = self.upload(input);
        self.backward(|network| network.forward(x, features), loss, gradient)
    }
}
