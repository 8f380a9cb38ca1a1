use crate::{ModelError, UNetConfig};

/// A batch of noised windows with the diffusion step of each.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// Noised values, channels last: `[batch, length, in_channels]`.
    pub x: &'a [f32],
    /// Diffusion step of each window: `[batch]`.
    pub steps: &'a [f32],
    /// Number of windows, at least 1.
    pub batch: usize,
    /// Poses per window, a multiple of [`UNetConfig::length_multiple`].
    pub length: usize,
}

impl Input<'_> {
    /// Checks the sizes against a network, and that every number is finite.
    ///
    /// # Errors
    /// What does not fit.
    pub fn check(&self, config: &UNetConfig) -> Result<(), ModelError> {
        if self.batch == 0 {
            return Err(ModelError::EmptyBatch);
        }
        let (length, multiple) = (self.length, config.length_multiple());
        if length == 0 || !length.is_multiple_of(multiple) {
            return Err(ModelError::Length {
                length,
                multiple,
                levels: config.levels(),
            });
        }
        let expected = self
            .batch
            .saturating_mul(length)
            .saturating_mul(config.in_channels);
        check_size("the input [batch, length, in_channels]", expected, self.x)?;
        check_size("the steps [batch]", self.batch, self.steps)?;
        check_finite("the input", self.x)?;
        check_finite("the steps", self.steps)
    }

    /// Checks that an output buffer holds `[batch, length, out_channels]`.
    ///
    /// # Errors
    /// [`ModelError::TensorSize`].
    pub fn check_output(&self, config: &UNetConfig, output: &[f32]) -> Result<(), ModelError> {
        let expected = self.batch * self.length * config.out_channels;
        check_size("the output [batch, length, out_channels]", expected, output)
    }
}

pub(crate) fn check_size(
    what: &'static str,
    expected: usize,
    values: &[f32],
) -> Result<(), ModelError> {
    let found = values.len();
    if found != expected {
        return Err(ModelError::TensorSize {
            what,
            expected,
            found,
        });
    }
    Ok(())
}

pub(crate) fn check_finite(what: &str, values: &[f32]) -> Result<(), ModelError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(ModelError::NotFinite {
            what: what.to_owned(),
            index,
            value: values[index],
        }),
        None => Ok(()),
    }
}

/// The gradient of a loss with respect to the network's output, for a chunk of the batch.
///
/// Arguments: index of the chunk's first sample in the batch, the network's output for
/// the chunk `[n, length, out_channels]`, and the gradient to fill, of the same shape.
/// It may be called for chunks of any size, in any order and from several threads; every
/// sample is asked for exactly once.
pub type LossGradient<'a> = dyn Fn(usize, &[f32], &mut [f32]) + Sync + 'a;

/// A noise estimator: one UNet with its parameters, on some device.
pub trait NoiseModel: Send {
    /// The network.
    fn config(&self) -> &UNetConfig;

    /// Replaces all parameters; `values` is flat, in layout order.
    ///
    /// # Errors
    /// The wrong number of values, or one that is not finite.
    fn set_parameters(&mut self, values: &[f32]) -> Result<(), ModelError>;

    /// Estimates the noise of every window: fills `output`, `[batch, length, out_channels]`.
    ///
    /// # Errors
    /// Sizes that do not fit, input that is not finite, or a failing backend.
    fn forward(&mut self, input: Input<'_>, output: &mut [f32]) -> Result<(), ModelError>;

    /// Runs forward, asks `loss` for the gradient at the output, and runs backward.
    ///
    /// Overwrites `gradient` (flat, in layout order) with the loss's gradient with respect
    /// to every parameter, summed over the batch.
    ///
    /// # Errors
    /// Sizes that do not fit, input that is not finite, or a failing backend.
    fn forward_backward(
        &mut self,
        input: Input<'_>,
        loss: &LossGradient<'_>,
        gradient: &mut [f32],
    ) -> Result<(), ModelError>;
}
