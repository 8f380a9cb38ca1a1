use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::activation::softmax;

use super::conv::Conv;
use super::norm::ChannelNorm;
use super::source::Source;
use crate::{ModelError, UNetConfig};

/// Attention logits are cosines times this.
const SCALE: f64 = 10.0;

/// Cosine attention between all poses of a window, normalised first, with its residual.
#[derive(Module, Debug)]
pub(super) struct Attention {
    norm: ChannelNorm,
    qkv: Conv,
    out: Conv,
    heads: usize,
    head_dim: usize,
}

impl Attention {
    pub(super) fn new(source: &Source<'_>, config: &UNetConfig) -> Result<Self, ModelError> {
        Ok(Self {
            norm: ChannelNorm::new(&source.enter("norm"))?,
            qkv: Conv::new(&source.enter("qkv"), 1, 0)?,
            out: Conv::new(&source.enter("out"), 1, 0)?,
            heads: config.heads,
            head_dim: config.head_dim,
        })
    }

    /// `[batch, length, channels]` to the same.
    pub(super) fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let [batch, length, _] = x.dims();
        let inner = self.heads * self.head_dim;
        let qkv = self.qkv.forward(self.norm.forward(x.clone())); // [batch, length, 3 * inner]
        let heads = |part: usize| {
            let part = qkv.clone().narrow(2, part * inner, inner);
            let part = part.reshape([batch, length, self.heads, self.head_dim]);
            part.swap_dims(1, 2) // [batch, heads, length, head_dim]
        };
        let (q, k, v) = (unit(heads(0)), unit(heads(1)), heads(2));
        let weights = softmax(q.matmul(k.swap_dims(2, 3)) * SCALE, 3); // [batch, heads, query, key]
        let o = weights.matmul(v).swap_dims(1, 2); // [batch, query, heads, head_dim]
        x + self.out.forward(o.reshape([batch, length, inner]))
    }
}

/// Unit length over the channels of a head: `x / max(|x|, 1e-12)`.
fn unit(x: Tensor<4>) -> Tensor<4> {
    // Clamped under the root, where the gradient at 0 stays finite.
    let norm = x.clone().square().sum_dim(3).clamp_min(1e-24).sqrt();
    x / norm
}
