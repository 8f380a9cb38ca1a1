//! What defines a training run.

use crate::error::Error;
use crate::loss::LossConfig;
use dose3_model::{PairConfig, PairParameters};
use serde::{Deserialize, Serialize};

/// Settings of a training run. Two runs with equal settings, data and build give equal bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainConfig {
    /// Optimiser steps.
    pub steps: usize,
    /// Windows a step.
    pub batch: usize,
    /// Peak learning rate of Adam.
    pub learning_rate: f64,
    /// Steps over which the learning rate rises linearly from 0.
    pub warmup: usize,
    /// Learning rate of the last step relative to the peak; cosine in between.
    pub final_rate: f64,
    /// Ceiling of each branch's gradient norm.
    pub clip: f64,
    /// Decay of the exponential moving average of the weights; the average is what is kept.
    pub ema_decay: f64,
    /// Seed of initial weights, window choice, steps and noise.
    pub seed: u64,
    /// Loss weights.
    pub loss: LossConfig,
    /// A row of the log every so many steps.
    pub log_every: usize,
    /// Validation every so many steps (0: never). A multiple of `log_every`.
    pub validate_every: usize,
    /// Validation windows, spread evenly over the held-out logs.
    pub validation_windows: usize,
    /// A checkpoint every so many steps (0: never). A multiple of `log_every`.
    pub checkpoint_every: usize,
}

impl Default for TrainConfig {
    fn default() -> Self {
        Self {
            steps: 1500,
            batch: 64,
            learning_rate: 1e-3,
            warmup: 100,
            final_rate: 0.1,
            clip: 1.0,
            ema_decay: 0.999,
            seed: 0,
            loss: LossConfig::default(),
            log_every: 10,
            validate_every: 100,
            validation_windows: 128,
            checkpoint_every: 250,
        }
    }
}

impl TrainConfig {
    /// Checks every setting's range.
    ///
    /// # Errors
    /// [`Error::Config`] naming the first setting that is out of range.
    pub fn validate(&self) -> Result<(), Error> {
        let fail = |name, found: String, expected| {
            Err(Error::Config {
                name,
                found,
                expected,
            })
        };
        for (name, value) in [
            ("steps", self.steps),
            ("batch", self.batch),
            ("log_every", self.log_every),
        ] {
            if value == 0 {
                return fail(name, value.to_string(), "at least 1");
            }
        }
        for (name, value) in [("learning_rate", self.learning_rate), ("clip", self.clip)] {
            if !(value.is_finite() && value > 0.0) {
                return fail(name, value.to_string(), "a number above 0");
            }
        }
        if !(0.0..=1.0).contains(&self.final_rate) {
            return fail("final_rate", self.final_rate.to_string(), "0 to 1");
        }
        if !(0.0..1.0).contains(&self.ema_decay) {
            return fail(
                "ema_decay",
                self.ema_decay.to_string(),
                "0 to 1, less than 1",
            );
        }
        for (name, value) in [
            ("validate_every", self.validate_every),
            ("checkpoint_every", self.checkpoint_every),
        ] {
            if value % self.log_every != 0 {
                return fail(name, value.to_string(), "a multiple of log_every");
            }
        }
        let weights = [
            self.loss.eps_weight,
            self.loss.x0_weight,
            self.loss.x0_ceiling,
        ];
        if weights.iter().any(|w| !(w.is_finite() && *w >= 0.0)) {
            return fail("loss", format!("{:?}", self.loss), "weights of 0 or more");
        }
        Ok(())
    }

    /// The weights that a run starts from.
    ///
    /// # Errors
    /// A network that cannot be built.
    pub fn initial(&self, network: &PairConfig) -> Result<PairParameters, Error> {
        Ok(PairParameters::init(network, self.seed)?)
    }

    /// Learning rate of step `step` (0-based): linear warm-up, then a cosine from the peak to
    /// `final_rate` of it.
    pub fn rate(&self, step: usize) -> f64 {
        if step < self.warmup {
            return self.learning_rate * (step + 1) as f64 / self.warmup as f64;
        }
        let span = self.steps.saturating_sub(self.warmup + 1).max(1) as f64;
        let u = ((step - self.warmup) as f64 / span).min(1.0);
        let cosine = 0.5 * (1.0 + (std::f64::consts::PI * u).cos());
        self.learning_rate * (self.final_rate + (1.0 - self.final_rate) * cosine)
    }

    /// Decay of the moving average after `step` steps: short at first, so that the initial
    /// weights do not linger.
    pub fn ema(&self, step: usize) -> f64 {
        self.ema_decay
            .min((1.0 + step as f64) / (10.0 + step as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn learning_rate_rises_then_falls_to_its_final_share() {
        let c = TrainConfig {
            steps: 1000,
            warmup: 100,
            ..TrainConfig::default()
        };
        assert!((c.rate(0) - 1e-5).abs() < 1e-12);
        assert!((c.rate(99) - 1e-3).abs() < 1e-12);
        assert!((c.rate(999) - 1e-4).abs() < 1e-9);
        assert!((100..999).all(|k| c.rate(k + 1) <= c.rate(k)));
    }

    #[test]
    fn bad_settings_name_themselves() {
        let name = |c: TrainConfig| match c.validate() {
            Err(Error::Config { name, .. }) => name,
            other => panic!("{other:?}"),
        };
        let d = TrainConfig::default();
        assert!(d.validate().is_ok());
        assert_eq!(name(TrainConfig { batch: 0, ..d }), "batch");
        assert_eq!(
            name(TrainConfig {
                learning_rate: f64::NAN,
                ..d
            }),
            "learning_rate"
        );
        assert_eq!(
            name(TrainConfig {
                ema_decay: 1.0,
                ..d
            }),
            "ema_decay"
        );
        assert_eq!(
            name(TrainConfig {
                checkpoint_every: 15,
                ..d
            }),
            "checkpoint_every"
        );
    }
}
