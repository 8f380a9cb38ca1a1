use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::activation::{log_softmax, silu};

use super::JemConfig;
use crate::Error;
use crate::layers::{Conv, squeeze};
use crate::source::Source;

/// A 1-D convolutional classifier without normalisation layers, as JEM needs it: a sample's
/// energy must not depend on its batch.
#[derive(Module, Debug)]
pub(super) struct Classifier {
    first: Conv,
    hidden: Vec<Conv>,
    head: Conv,
}

impl Classifier {
    pub(super) fn new(
        source: &mut Source,
        config: &JemConfig,
        channels: usize,
        classes: usize,
    ) -> Result<Self, Error> {
        let width = config.width;
        let hidden = (0..config.levels)
            .map(|i| Conv::new(source, &format!("hidden.{i}"), [3, 2 * width, width]))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            first: Conv::new(source, "first", [3, channels, width])?,
            hidden,
            head: Conv::new(source, "head", [1, width, classes])?,
        })
    }

    /// Logits: `[batch, length, channels]` to `[batch, classes]`.
    pub(super) fn forward(&self, x: Tensor<3>) -> Tensor<2> {
        let batch = x.dims()[0];
        let mut h = silu(self.first.forward(x)); // [batch, length, width]
        for conv in &self.hidden {
            h = silu(conv.forward(squeeze(h))); // [batch, length / 2, width]
        }
        let logits = self.head.forward(h.mean_dim(1)); // [batch, 1, classes]
        let classes = logits.dims()[2];
        logits.reshape([batch, classes])
    }
}

/// `logsumexp` over the classes, the negative energy: `[batch, classes]` to `[batch]`.
pub(super) fn log_sum_exp(logits: Tensor<2>) -> Tensor<1> {
    let batch = logits.dims()[0];
    let largest = logits.clone().detach().max_dim(1); // [batch, 1]
    let sum = (logits - largest.clone()).exp().sum_dim(1);
    (sum.log() + largest).reshape([batch])
}

/// Mean cross-entropy, `[1]`; `targets` is one-hot, `[batch, classes]`.
pub(super) fn cross_entropy(logits: Tensor<2>, targets: Tensor<2>) -> Tensor<1> {
    let batch = logits.dims()[0];
    (log_softmax(logits, 1) * targets).sum() * (-1.0 / batch as f64)
}
