use burn::module::{Module, Param};
use burn::tensor::Tensor;
use burn::tensor::module::linear;

use super::source::Source;
use crate::ModelError;

/// A 1-D convolution along the length.
#[derive(Module, Debug)]
pub(super) struct Conv {
    weight: Param<Tensor<3>>, // [out, in, kernel]
    bias: Option<Param<Tensor<1>>>,
    stride: usize,
    padding: usize,
    dilation: usize,
}

/// Which steps a convolution sees.
#[derive(Clone, Copy)]
struct Reach {
    stride: usize,
    /// Zeros before the first step and after the last.
    padding: usize,
    /// Steps from tap to tap; 1 where the stride is not.
    dilation: usize,
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
            dilation: 1,
        })
    }

    /// Three taps, `dilation` steps apart, that keep the length.
    pub(super) fn dilated(source: &Source<'_>, dilation: usize) -> Result<Self, ModelError> {
        Ok(Self {
            dilation,
            ..Self::new(source, 1, dilation)?
        })
    }

    /// `[batch, length, in]` to `[batch, length', out]`.
    pub(super) fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let bias = self.bias.as_ref().map(Param::val);
        let reach = Reach {
            stride: self.stride,
            padding: self.padding,
            dilation: self.dilation,
        };
        convolve(x, self.weight.val(), bias, reach)
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

    /// `[batch, length, in]` to `[batch, length, out]`.
    pub(super) fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let weight = self.weight.val();
        let mean = weight.clone().mean_dims(&[1, 2]); // [out, 1, 1]
        let centred = weight - mean;
        let var = centred.clone().square().mean_dims(&[1, 2]); // [out, 1, 1]
        let weight = centred / (var + 1e-5).sqrt();
        let reach = Reach {
            stride: 1,
            padding: 1,
            dilation: 1,
        };
        convolve(x, weight, Some(self.bias.val()), reach)
    }
}

/// One product of what every output sees with the weights: matrix products are what every backend has a fast kernel
/// for, forward and backward, while burn's convolutions on GPUs are fast only where it may try kernels out first.
fn convolve(x: Tensor<3>, weight: Tensor<3>, bias: Option<Tensor<1>>, reach: Reach) -> Tensor<3> {
    let [out, channels, kernel] = weight.dims();
    let seen = reach.gather(x, kernel);
    let [batch, length, columns] = seen.dims();
    let weight = match kernel {
        1 => weight.reshape([out, channels]).transpose(),
        _ => weight.permute([2, 1, 0]).reshape([columns, out]), // taps outside, as `gather` has them
    };
    let rows = linear(seen.reshape([batch * length, columns]), weight, bias);
    rows.reshape([batch, length, out])
}

impl Reach {
    /// What every output sees of `[batch, length, in]`: `[batch, length', kernel * in]`.
    fn gather(self, x: Tensor<3>, kernel: usize) -> Tensor<3> {
        if kernel == 1 {
            return x;
        }
        let [batch, length, channels] = x.dims();
        let zeros = Tensor::zeros([batch, self.padding, channels], &x.device());
        let wide = Tensor::cat(vec![zeros.clone(), x, zeros], 1);
        // As many steps as the stride is long count as one, of all their channels.
        let steps = (length + 2 * self.padding) / self.stride;
        let wide = wide.reshape([batch, steps, self.stride * channels]);
        let taps = kernel / self.stride;
        let length = steps - (taps - 1) * self.dilation;
        let tap = |i| wide.clone().narrow(1, i * self.dilation, length);
        Tensor::cat((0..taps).map(tap).collect(), 2)
    }
}
