use burn::module::{Module, Param};
use burn::tensor::Tensor;
use burn::tensor::module::conv1d;
use burn::tensor::ops::ConvOptions;

use super::source::Source;
use crate::ModelError;

/// A 1-D convolution along the length.
#[derive(Module, Debug)]
pub(super) struct Conv {
    weight: Param<Tensor<3>>, // [out, in, kernel]
    bias: Option<Param<Tensor<1>>>,
    stride: usize,
    padding: usize,
}

impl Conv {
    pub(super) fn new(
        source: &Source<'_>,
        stride: usize,
        padding: usize,
    ) -> Result<Self, ModelError> {
        let bias = source
            .has("bias")
            .then(|| source.tensor("bias"))
            .transpose()?;
        Ok(Self {
            weight: source.tensor("weight")?,
            bias,
            stride,
            padding,
        })
    }

    /// `[batch, in, length]` to `[batch, out, length']`.
    pub(super) fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let bias = self.bias.as_ref().map(Param::val);
        convolve(x, self.weight.val(), bias, self.stride, self.padding)
    }
}

/// A convolution of kernel 3 whose weights are standardised per output channel
/// (Qiao et al. 2019, "Micro-batch training with weight standardization").
#[derive(Module, Debug)]
pub(super) struct StandardizedConv {
    weight: Param<Tensor<3>>, // [out, in, 3]
    bias: Param<Tensor<1>>,
}

impl StandardizedConv {
    pub(super) fn new(source: &Source<'_>) -> Result<Self, ModelError> {
        Ok(Self {
            weight: source.tensor("weight")?,
            bias: source.tensor("bias")?,
        })
    }

    /// `[batch, in, length]` to `[batch, out, length]`.
    pub(super) fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let weight = self.weight.val();
        let mean = weight.clone().mean_dims(&[1, 2]); // [out, 1, 1]
        let centred = weight - mean;
        let var = centred.clone().square().mean_dims(&[1, 2]); // [out, 1, 1]
        let weight = centred / (var + 1e-5).sqrt();
        convolve(x, weight, Some(self.bias.val()), 1, 1)
    }
}

fn convolve(
    x: Tensor<3>,
    weight: Tensor<3>,
    bias: Option<Tensor<1>>,
    stride: usize,
    padding: usize,
) -> Tensor<3> {
    // Symmetric padding only: burn #4799.
    conv1d(
        x,
        weight,
        bias,
        ConvOptions::new([stride], [padding], [1], 1),
    )
}
