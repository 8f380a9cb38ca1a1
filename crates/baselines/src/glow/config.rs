use serde::{Deserialize, Serialize};

use crate::Error;

/// The shape of a [`Glow`](super::Glow) and how it is trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GlowConfig {
    /// Levels of squeeze, steps and split; a window's length is a multiple of `2^levels`.
    pub levels: usize,
    /// Steps of flow (actnorm, mixing, coupling) in each level.
    pub steps_per_level: usize,
    /// Channels inside the coupling networks.
    pub hidden: usize,
    /// Standard deviation of the Gaussian noise added to standardised windows in training
    /// (dequantisation): without it a channel that never changes has infinite density.
    pub noise: f64,
    /// Probability with which a pose of the background model's training windows is replaced by a
    /// pose drawn from all training windows (Ren et al. 2019: mutation rates of 0.1 to 0.3).
    pub mutation_rate: f64,
    /// Windows per training step, drawn with replacement.
    pub batch: usize,
    /// Training steps of each of the two models.
    pub steps: usize,
    /// Adam's largest learning rate; a twentieth of the steps warms up, then a cosine to a tenth.
    pub learning_rate: f64,
}

impl Default for GlowConfig {
    fn default() -> Self {
        Self {
            levels: 4,
            steps_per_level: 6,
            hidden: 64,
            noise: 0.05,
            mutation_rate: 0.2,
            batch: 64,
            steps: 2000,
            learning_rate: 1e-3,
        }
    }
}

impl GlowConfig {
    /// Checks the ranges, and that windows of `length` poses can be squeezed.
    ///
    /// # Errors
    /// [`Error::Config`] with what is wrong.
    pub fn validate(&self, length: usize) -> Result<(), Error> {
        let bad = |reason: String| Err(Error::Config(reason));
        let counts = [
            ("levels", self.levels),
            ("steps_per_level", self.steps_per_level),
            ("hidden", self.hidden),
            ("batch", self.batch),
            ("steps", self.steps),
        ];
        if let Some((name, _)) = counts.iter().find(|(_, count)| *count == 0) {
            return bad(format!("{name} is 0"));
        }
        if self.levels > 16 || !length.is_multiple_of(1 << self.levels) {
            let levels = self.levels;
            return bad(format!(
                "{levels} levels need a window length that is a multiple of 2^{levels}, not {length}"
            ));
        }
        if !(self.noise.is_finite() && self.noise > 0.0) {
            return bad(format!("noise {} is not positive", self.noise));
        }
        if !(0.0..=1.0).contains(&self.mutation_rate) {
            return bad(format!(
                "mutation_rate {} is not in [0, 1]",
                self.mutation_rate
            ));
        }
        if !(self.learning_rate.is_finite() && self.learning_rate > 0.0) {
            return bad(format!(
                "learning_rate {} is not positive",
                self.learning_rate
            ));
        }
        Ok(())
    }
}
