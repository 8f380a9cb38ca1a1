use serde::{Deserialize, Serialize};

use crate::Error;

/// The shape of a [`Jem`](super::Jem) and how it is trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JemConfig {
    /// Channels of every hidden layer.
    pub width: usize,
    /// Hidden layers that halve the length; a window's length is a multiple of `2^levels`.
    pub levels: usize,
    /// Windows per training step, drawn with replacement; as many samples are drawn.
    pub batch: usize,
    /// Training steps.
    pub steps: usize,
    /// Adam's largest learning rate; a twentieth of the steps warms up, then a cosine to a tenth.
    pub learning_rate: f64,
    /// Standard deviation of the noise added to standardised windows in training.
    pub noise: f64,
    /// Langevin (SGLD) steps per training step.
    pub langevin_steps: usize,
    /// What an SGLD step multiplies the energy's gradient with (standardised units).
    pub langevin_step_size: f64,
    /// Standard deviation of the noise added in an SGLD step; JEM, too, does not tie it to the step size.
    pub langevin_noise: f64,
    /// Samples kept between training steps (the replay buffer of Du and Mordatch 2019).
    pub buffer: usize,
    /// Probability with which a sample starts anew, from a standard normal, not from the buffer.
    pub reinit: f64,
    /// Training counts as diverged when the mean energies of windows and samples are further
    /// apart than this.
    pub energy_gap_bound: f64,
    /// A snapshot to fall back to is kept every so many steps.
    pub snapshot_every: usize,
}

impl Default for JemConfig {
    fn default() -> Self {
        Self {
            width: 32,
            levels: 4,
            batch: 64,
            steps: 1000,
            learning_rate: 3e-4,
            noise: 0.05,
            langevin_steps: 20,
            langevin_step_size: 1.0,
            langevin_noise: 0.01,
            buffer: 5000,
            reinit: 0.05,
            energy_gap_bound: 100.0,
            snapshot_every: 50,
        }
    }
}

impl JemConfig {
    /// Checks the ranges, and that windows of `length` poses can be halved.
    ///
    /// # Errors
    /// [`Error::Config`] with what is wrong.
    pub fn validate(&self, length: usize) -> Result<(), Error> {
        let bad = |reason: String| Err(Error::Config(reason));
        let counts = [
            ("width", self.width),
            ("batch", self.batch),
            ("steps", self.steps),
            ("langevin_steps", self.langevin_steps),
            ("snapshot_every", self.snapshot_every),
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
        if self.buffer < self.batch {
            let Self { buffer, batch, .. } = self;
            return bad(format!("a buffer of {buffer} holds no batch of {batch}"));
        }
        if !(0.0..=1.0).contains(&self.reinit) {
            return bad(format!("reinit {} is not in [0, 1]", self.reinit));
        }
        let sizes = [
            ("learning_rate", self.learning_rate, f64::MIN_POSITIVE),
            ("noise", self.noise, 0.0),
            (
                "langevin_step_size",
                self.langevin_step_size,
                f64::MIN_POSITIVE,
            ),
            ("langevin_noise", self.langevin_noise, 0.0),
            ("energy_gap_bound", self.energy_gap_bound, f64::MIN_POSITIVE),
        ];
        match sizes
            .iter()
            .find(|(_, size, least)| !(size.is_finite() && size >= least))
        {
            Some((name, size, _)) => bad(format!("{name} {size} is out of range")),
            None => Ok(()),
        }
    }
}
