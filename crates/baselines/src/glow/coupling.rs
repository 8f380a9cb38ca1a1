use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::activation::relu;

use crate::Error;
use crate::layers::{Conv, halves, sum_each};
use crate::source::Source;

/// Log-scales stay within plus or minus this: no coupling can stretch by more than e.
const LOG_SCALE_BOUND: f64 = 1.0;

/// What a coupling's network sees of the kept half stays within plus or minus this, in about
/// standard deviations: on a perturbed or foreign window a chain of couplings would otherwise grow without
/// end (seen, where a training set held a few values 100 deviations out).
const INPUT_BOUND: f64 = 4.0;

/// Log-scales of couplings and splits, within their bound.
pub(super) fn bounded(x: Tensor<3>) -> Tensor<3> {
    squash(x, LOG_SCALE_BOUND)
}

/// `bound * tanh(x / bound)`: the identity near 0, never beyond the bound.
fn squash(x: Tensor<3>, bound: f64) -> Tensor<3> {
    (x / bound).tanh() * bound
}

/// Affine coupling (Glow, section 3.3): half the channels, seen through a small network, scale
/// and shift the other half.
#[derive(Module, Debug)]
pub(super) struct Coupling {
    conv1: Conv,
    conv2: Conv,
    conv3: Conv,
}

impl Coupling {
    pub(super) fn new(
        source: &mut Source,
        name: &str,
        channels: usize,
        hidden: usize,
    ) -> Result<Self, Error> {
        let half = channels / 2;
        Ok(Self {
            conv1: Conv::new(source, &format!("{name}.conv1"), [3, half, hidden])?,
            conv2: Conv::new(source, &format!("{name}.conv2"), [1, hidden, hidden])?,
            conv3: Conv::zero(source, &format!("{name}.conv3"), [3, hidden, channels])?,
        })
    }

    /// The coupled `x` and each sample's log-determinant, `[batch]`.
    pub(super) fn forward(&self, x: Tensor<3>) -> (Tensor<3>, Tensor<1>) {
        let [kept, changed] = halves(x); // [batch, length, channels / 2]
        let [log_scale, shift] = self.parameters(kept.clone());
        let changed = changed * log_scale.clone().exp() + shift;
        (Tensor::cat(vec![kept, changed], 2), sum_each(log_scale))
    }

    pub(super) fn inverse(&self, y: Tensor<3>) -> Tensor<3> {
        let [kept, changed] = halves(y);
        let [log_scale, shift] = self.parameters(kept.clone());
        let changed = (changed - shift) * log_scale.neg().exp();
        Tensor::cat(vec![kept, changed], 2)
    }

    fn parameters(&self, kept: Tensor<3>) -> [Tensor<3>; 2] {
        let seen = squash(kept, INPUT_BOUND);
        let h = relu(self.conv1.forward(seen)); // [batch, length, hidden]
        let h = relu(self.conv2.forward(h));
        let [log_scale, shift] = halves(self.conv3.forward(h));
        [bounded(log_scale), shift]
    }
}
