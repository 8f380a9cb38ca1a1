use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::activation::silu;

use super::conv::{Conv, StandardizedConv};
use super::norm::GroupNorm;
use super::source::Source;
use super::time::Linear;
use crate::ModelError;

/// Two convolutions around a residual; the time embedding scales and shifts between them.
#[derive(Module, Debug)]
pub(super) struct Block {
    time: Linear,
    conv1: StandardizedConv,
    norm1: GroupNorm,
    conv2: StandardizedConv,
    norm2: GroupNorm,
    residual: Option<Conv>,
}

impl Block {
    pub(super) fn new(source: &Source<'_>, groups: usize) -> Result<Self, ModelError> {
        let residual = source.enter("residual");
        Ok(Self {
            time: Linear::new(&source.enter("time"))?,
            conv1: StandardizedConv::new(&source.enter("conv1"))?,
            norm1: GroupNorm::new(&source.enter("norm1"), groups)?,
            conv2: StandardizedConv::new(&source.enter("conv2"))?,
            norm2: GroupNorm::new(&source.enter("norm2"), groups)?,
            // Only where the number of channels changes.
            residual: residual
                .has("weight")
                .then(|| Conv::new(&residual, 1, 0))
                .transpose()?,
        })
    }

    /// `[batch, length, in]` to `[batch, length, out]`; `time` is `[batch, 4 * width]`.
    pub(super) fn forward(&self, x: Tensor<3>, time: Tensor<2>) -> Tensor<3> {
        let time = self.time.forward(silu(time)).unsqueeze_dim::<3>(1); // [batch, 1, 2 * out]
        let [scale, shift] = halves(time); // [batch, 1, out]
        let h = self.norm1.forward(self.conv1.forward(x.clone())); // [batch, length, out]
        let h = silu(h * (scale + 1.0) + shift);
        let h = silu(self.norm2.forward(self.conv2.forward(h)));
        match &self.residual {
            Some(residual) => h + residual.forward(x),
            None => h + x,
        }
    }
}

fn halves(x: Tensor<3>) -> [Tensor<3>; 2] {
    let half = x.dims()[2] / 2;
    [x.clone().narrow(2, 0, half), x.narrow(2, half, half)]
}
