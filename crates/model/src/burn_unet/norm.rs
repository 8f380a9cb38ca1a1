use burn::module::{Module, Param};
use burn::tensor::Tensor;

use super::source::Source;
use crate::ModelError;

const EPSILON: f64 = 1e-5;

/// Group normalisation with gain and offset per channel.
#[derive(Module, Debug)]
pub(super) struct GroupNorm {
    weight: Param<Tensor<1>>,
    bias: Param<Tensor<1>>,
    groups: usize,
}

impl GroupNorm {
    pub(super) fn new(source: &Source<'_>, groups: usize) -> Result<Self, ModelError> {
        let (weight, bias) = (source.tensor("weight")?, source.tensor("bias")?);
        Ok(Self {
            weight,
            bias,
            groups,
        })
    }

    /// `[batch, channels, length]` to the same.
    pub(super) fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let [batch, channels, length] = x.dims();
        let size = channels / self.groups * length;
        let x = standardize(x.reshape([batch, self.groups, size]), 2);
        let x = x.reshape([batch, channels, length]);
        x * per_channel(&self.weight) + per_channel(&self.bias)
    }
}

/// Layer normalisation over the channels, with a gain only.
#[derive(Module, Debug)]
pub(super) struct ChannelNorm {
    weight: Param<Tensor<1>>,
}

impl ChannelNorm {
    pub(super) fn new(source: &Source<'_>) -> Result<Self, ModelError> {
        Ok(Self {
            weight: source.tensor("weight")?,
        })
    }

    /// `[batch, channels, length]` to the same.
    pub(super) fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        standardize(x, 1) * per_channel(&self.weight)
    }
}

/// Mean 0 and variance 1 along `dim`, with the biased variance.
fn standardize(x: Tensor<3>, dim: usize) -> Tensor<3> {
    let centred = x.clone() - x.mean_dim(dim);
    let var = centred.clone().square().mean_dim(dim);
    centred / (var + EPSILON).sqrt()
}

/// `[channels]` as `[1, channels, 1]`.
fn per_channel(values: &Param<Tensor<1>>) -> Tensor<3> {
    let values = values.val();
    let [channels] = values.dims();
    values.reshape([1, channels, 1])
}
