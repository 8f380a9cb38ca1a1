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

    /// `[batch, length, channels]` to the same.
    pub(super) fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let [batch, length, channels] = x.dims();
        let x = x.reshape([batch, length, self.groups, channels / self.groups]);
        let x = standardize(x, |x| x.mean_dim(1).mean_dim(3)); // mean: [batch, 1, groups, 1]
        let x = x.reshape([batch, length, channels]);
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

    /// `[batch, length, channels]` to the same.
    pub(super) fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        standardize(x, |x| x.mean_dim(2)) * per_channel(&self.weight)
    }
}

/// Mean 0 and variance 1 over what `mean` averages, with the biased variance.
fn standardize<const D: usize>(x: Tensor<D>, mean: impl Fn(Tensor<D>) -> Tensor<D>) -> Tensor<D> {
    let centred = x.clone() - mean(x);
    let var = mean(centred.clone().square());
    centred / (var + EPSILON).sqrt()
}

/// `[channels]` as `[1, 1, channels]`.
fn per_channel(values: &Param<Tensor<1>>) -> Tensor<3> {
    values.val().unsqueeze()
}
