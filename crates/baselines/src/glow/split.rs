use burn::module::Module;
use burn::tensor::Tensor;

use super::coupling::bounded;
use crate::Error;
use crate::layers::{Conv, halves, sum_each};
use crate::source::Source;

const LN_2PI: f64 = 1.837_877_066_409_345_5;

/// Takes half the channels out of the flow; the other half predicts their mean and scale
/// (the multi-scale architecture of RealNVP, with Glow's learned prior).
#[derive(Module, Debug)]
pub(super) struct Split {
    prior: Conv,
}

impl Split {
    pub(super) fn new(source: &mut Source, name: &str, channels: usize) -> Result<Self, Error> {
        let prior = Conv::zero(
            source,
            &format!("{name}.prior"),
            [3, channels / 2, channels],
        )?;
        Ok(Self { prior })
    }

    /// What goes on, what leaves, and the log-density of what leaves, `[batch]`.
    pub(super) fn forward(&self, x: Tensor<3>) -> ([Tensor<3>; 2], Tensor<1>) {
        let [kept, out] = halves(x);
        let [mean, log_sd] = halves(self.prior.forward(kept.clone()));
        let log_sd = bounded(log_sd);
        let residual = (out.clone() - mean) * log_sd.clone().neg().exp();
        let log_density = standard_normal(residual) - sum_each(log_sd);
        ([kept, out], log_density)
    }
}

/// Per sample, the log-density of independent standard normals: `[batch]`.
pub(super) fn standard_normal(x: Tensor<3>) -> Tensor<1> {
    let [_, length, channels] = x.dims();
    let squares = sum_each(x.clone() * x);
    squares * -0.5 - 0.5 * LN_2PI * (length * channels) as f64
}
