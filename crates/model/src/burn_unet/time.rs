use std::f64::consts::FRAC_1_SQRT_2;

use burn::module::{Module, Param};
use burn::tensor::module::linear;
use burn::tensor::{Device, Tensor, TensorData};

use super::source::Source;
use crate::{ModelError, sinusoidal_into};

/// The sinusoidal features of every step: `[batch, width]`.
pub(super) fn features(steps: &[f32], width: usize, device: &Device) -> Tensor<2> {
    let mut features = vec![0.0; steps.len() * width];
    for (&step, row) in steps.iter().zip(features.chunks_exact_mut(width)) {
        sinusoidal_into(step, row);
    }
    Tensor::from_data(TensorData::new(features, [steps.len(), width]), device)
}

/// A fully connected layer with PyTorch's weight layout.
#[derive(Module, Debug)]
pub(super) struct Linear {
    weight: Param<Tensor<2>>, // [out, in]
    bias: Param<Tensor<1>>,
}

impl Linear {
    pub(super) fn new(source: &Source<'_>) -> Result<Self, ModelError> {
        Ok(Self {
            weight: source.tensor("weight")?,
            bias: source.tensor("bias")?,
        })
    }

    /// `[batch, in]` to `[batch, out]`.
    pub(super) fn forward(&self, x: Tensor<2>) -> Tensor<2> {
        linear(x, self.weight.val().transpose(), Some(self.bias.val()))
    }
}

/// Two layers that turn sinusoidal features into the time embedding that every block sees.
#[derive(Module, Debug)]
pub(super) struct TimeMlp {
    linear1: Linear,
    linear2: Linear,
}

impl TimeMlp {
    pub(super) fn new(source: &Source<'_>) -> Result<Self, ModelError> {
        let linear1 = Linear::new(&source.enter("linear1"))?;
        let linear2 = Linear::new(&source.enter("linear2"))?;
        Ok(Self { linear1, linear2 })
    }

    /// `[batch, width]` to `[batch, 4 * width]`.
    pub(super) fn forward(&self, features: Tensor<2>) -> Tensor<2> {
        self.linear2.forward(gelu(self.linear1.forward(features)))
    }
}

/// `x * Phi(x)`, exactly. burn's own `gelu` differentiates its tanh approximation instead on
/// every backend but flex (0.22.1), which is off by up to 5e-4.
fn gelu(x: Tensor<2>) -> Tensor<2> {
    let phi = ((x.clone() * FRAC_1_SQRT_2).erf() + 1.0) * 0.5;
    x * phi
}
