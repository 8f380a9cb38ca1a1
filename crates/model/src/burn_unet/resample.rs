use burn::tensor::Tensor;

use super::conv::Conv;
use super::source::Source;
use crate::ModelError;

/// The convolution that ends a level on the way down: halves the length unless it is the last.
pub(super) fn down(source: &Source<'_>, last: bool) -> Result<Conv, ModelError> {
    // Kernel 3 at the last level, 4 elsewhere.
    let stride = if last { 1 } else { 2 };
    Conv::new(source, stride, 1)
}

/// The convolution that ends a level on the way up, after [`double_length`] unless it is the last.
pub(super) fn up(source: &Source<'_>) -> Result<Conv, ModelError> {
    Conv::new(source, 1, 1)
}

/// Every step twice: `[batch, length, channels]` to `[batch, 2 * length, channels]`.
pub(super) fn double_length(x: Tensor<3>) -> Tensor<3> {
    let [batch, length, channels] = x.dims();
    let twice = x.reshape([batch, length, 1, channels]).repeat_dim(2, 2);
    twice.reshape([batch, 2 * length, channels])
}
