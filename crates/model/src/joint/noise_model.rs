use super::{CONDITIONS, FEATURES, JOINT_AXES, JointConfig, condition_features};
use crate::noise_model::{check_finite, check_size};
use crate::{LossGradient, ModelError};

/// A batch of noised sequences of one length, with the conditions of each.
#[derive(Clone, Copy, Debug)]
pub struct JointInput<'a> {
    /// Noised values: `[batch, length, 6]`.
    pub x: &'a [f32],
    /// Noise level of each axis, and time step, as [`condition_features`] takes them:
    /// `[batch, 7]`.
    pub conditions: &'a [f32],
    /// Number of sequences, at least 1.
    pub batch: usize,
    /// Steps of a sequence, at least 1.
    pub length: usize,
}

impl JointInput<'_> {
    /// Checks the sizes, and that every number is finite.
    ///
    /// # Errors
    /// What does not fit.
    pub fn check(&self) -> Result<(), ModelError> {
        if self.batch == 0 || self.length == 0 {
            return Err(ModelError::EmptyBatch);
        }
        let values = self.values();
        check_size("the input [batch, length, 6]", values, self.x)?;
        let conditions = self.batch * CONDITIONS;
        check_size("the conditions [batch, 7]", conditions, self.conditions)?;
        check_finite("the input", self.x)?;
        check_finite("the conditions", self.conditions)
    }

    /// Checks that an output buffer holds `[batch, length, 6]`.
    ///
    /// # Errors
    /// [`ModelError::TensorSize`].
    pub fn check_output(&self, output: &[f32]) -> Result<(), ModelError> {
        check_size("the output [batch, length, 6]", self.values(), output)
    }

    /// The features of the conditions of all sequences, `[batch, FEATURES]`.
    pub fn features(&self) -> Vec<f32> {
        let mut features = vec![0.0; self.batch * FEATURES];
        let own = self.conditions.chunks_exact(CONDITIONS);
        for (own, features) in own.zip(features.chunks_exact_mut(FEATURES)) {
            condition_features(own, features);
        }
        features
    }

    fn values(&self) -> usize {
        self.batch
            .saturating_mul(self.length)
            .saturating_mul(JOINT_AXES)
    }
}

/// A joint network with its parameters, on some device.
pub trait JointNoiseModel: Send {
    /// The network.
    fn config(&self) -> &JointConfig;

    /// Replaces all parameters; `values` is flat, in layout order.
    ///
    /// # Errors
    /// The wrong number of values, or one that is not finite.
    fn set_parameters(&mut self, values: &[f32]) -> Result<(), ModelError>;

    /// Fills `output`, `[batch, length, 6]`.
    ///
    /// # Errors
    /// Sizes that do not fit, input that is not finite, or a failing backend.
    fn forward(&mut self, input: JointInput<'_>, output: &mut [f32]) -> Result<(), ModelError>;

    /// Runs forward, asks `loss` for the gradient at the output, and runs backward: overwrites `gradient` (flat, in
    /// layout order) with the gradient of the loss, summed over the batch.
    ///
    /// # Errors
    /// Sizes that do not fit, input that is not finite, or a failing backend.
    fn forward_backward(
        &mut self,
        input: JointInput<'_>,
        loss: &LossGradient<'_>,
        gradient: &mut [f32],
    ) -> Result<(), ModelError>;
}
