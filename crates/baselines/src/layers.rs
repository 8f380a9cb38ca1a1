//! Layers over `[batch, length, channels]`.

use burn::module::{Module, Param};
use burn::tensor::{Tensor, TensorData};

use crate::Error;
use crate::source::{Init, Source, device};

/// A convolution along the length, kernel 1 or 3, zero padding that keeps the length.
///
/// Written as one matrix product over shifted copies: on burn-flex that is about three times
/// as fast in training as its convolution.
#[derive(Module, Debug)]
pub(crate) struct Conv {
    weight: Param<Tensor<2>>, // [kernel * in, out]
    bias: Param<Tensor<1>>,   // [out]
}

impl Conv {
    pub(crate) fn new(
        source: &mut Source,
        name: &str,
        [kernel, inputs, outputs]: [usize; 3],
    ) -> Result<Self, Error> {
        let fan_in = kernel * inputs;
        Self::with(source, name, [fan_in, outputs], Init::FanIn(fan_in))
    }

    /// A convolution that starts as zero, so that what it controls starts as the identity.
    pub(crate) fn zero(
        source: &mut Source,
        name: &str,
        [kernel, inputs, outputs]: [usize; 3],
    ) -> Result<Self, Error> {
        Self::with(source, name, [kernel * inputs, outputs], Init::Zeros)
    }

    fn with(source: &mut Source, name: &str, shape: [usize; 2], init: Init) -> Result<Self, Error> {
        Ok(Self {
            weight: source.param(&format!("{name}.weight"), shape, init)?,
            bias: source.param(&format!("{name}.bias"), [shape[1]], init)?,
        })
    }

    /// `[batch, length, in]` to `[batch, length, out]`.
    pub(crate) fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let [batch, length, channels] = x.dims();
        let [rows, outputs] = self.weight.val().dims();
        let columns = if rows == channels { x } else { neighbours(x) };
        let flat = columns.reshape([batch * length, rows]);
        let bias = self.bias.val().reshape([1, outputs]);
        (flat.matmul(self.weight.val()) + bias).reshape([batch, length, outputs])
    }
}

/// Each pose beside its neighbours: `[batch, length, channels]` to `[batch, length, 3 * channels]`.
fn neighbours(x: Tensor<3>) -> Tensor<3> {
    let [batch, length, channels] = x.dims();
    let edge = Tensor::zeros([batch, 1, channels], &x.device());
    let padded = Tensor::cat(vec![edge.clone(), x.clone(), edge], 1);
    let before = padded.clone().narrow(1, 0, length);
    let after = padded.narrow(1, 2, length);
    Tensor::cat(vec![before, x, after], 2)
}

/// Two poses become one of twice the channels: `[batch, length, c]` to `[batch, length / 2, 2c]`.
pub(crate) fn squeeze(x: Tensor<3>) -> Tensor<3> {
    let [batch, length, channels] = x.dims();
    x.reshape([batch, length / 2, 2 * channels])
}

/// The inverse of [`squeeze`].
pub(crate) fn unsqueeze(x: Tensor<3>) -> Tensor<3> {
    let [batch, length, channels] = x.dims();
    x.reshape([batch, 2 * length, channels / 2])
}

/// The first and the second half of the channels.
pub(crate) fn halves(x: Tensor<3>) -> [Tensor<3>; 2] {
    let half = x.dims()[2] / 2;
    [x.clone().narrow(2, 0, half), x.narrow(2, half, half)]
}

/// Per sample, the sum over all other dimensions: `[batch]`.
pub(crate) fn sum_each(x: Tensor<3>) -> Tensor<1> {
    let [batch, length, channels] = x.dims();
    x.reshape([batch, length * channels])
        .sum_dim(1)
        .reshape([batch])
}

pub(crate) fn upload(values: Vec<f32>, shape: [usize; 3]) -> Tensor<3> {
    Tensor::from_data(TensorData::new(values, shape), &device())
}

pub(crate) fn download<const D: usize>(tensor: Tensor<D>) -> Result<Vec<f32>, Error> {
    let data = tensor
        .inner()
        .try_into_data()
        .map_err(|error| Error::Compute(error.to_string()))?;
    data.try_into_vec()
        .map_err(|error| Error::Compute(error.to_string()))
}
