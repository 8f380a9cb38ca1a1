//! Training of the joint network.

use super::batch::{Batch, Pick};
use super::learner::{HostLearner, JointLearner};
use super::process::AXES;
use crate::error::Error;
use crate::trainer::Rates;
#[cfg(feature = "burn")]
use dose3_model::joint::JointConfig;
use dose3_model::joint::{JointNoiseModel, JointParameters};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Steps after which losses are read from a device.
const TOLD: usize = 20;

/// Sequences of one platform at one rate, in units of one scale.
#[derive(Clone, Debug)]
pub struct JointSet {
    /// Gap-free stretches of steps, metres and radians.
    pub sequences: Vec<Vec<[f64; AXES]>>,
    /// Metres and radians that count as 1.
    pub scale: [f64; AXES],
    /// Seconds between steps.
    pub step: f64,
    /// How often it is drawn, relative to the others.
    pub weight: f64,
}

/// Settings of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointTrainConfig {
    /// Optimiser steps.
    pub steps: usize,
    /// Sequences a step.
    pub batch: usize,
    /// Lengths of sequences; each step draws one of them.
    pub lengths: Vec<usize>,
    /// Peak learning rate, after a linear warm-up of 5 % of the steps; a cosine takes it to a hundredth.
    pub learning_rate: f64,
    /// Gradients with a larger norm are scaled down to it.
    pub clip: f64,
    /// Decay of the moving average of the weights.
    pub ema_decay: f64,
    /// Factor by which the scale of a sequence is off, at most: `exp(+-jitter)` for each axis.
    pub scale_jitter: f64,
    /// Seed of weights, sequences and noise.
    pub seed: u64,
}

impl Default for JointTrainConfig {
    fn default() -> Self {
        Self {
            steps: 24_000,
            batch: 16,
            lengths: vec![32, 64, 128, 128],
            learning_rate: 2e-3,
            clip: 1.0,
            ema_decay: 0.999,
            scale_jitter: 0.1,
            seed: 0,
        }
    }
}

impl JointTrainConfig {
    fn check(&self) -> Result<(), Error> {
        let fault = |name, found: String, expected| {
            Err(Error::Config {
                name,
                found,
                expected,
            })
        };
        if self.steps == 0 || self.batch == 0 {
            return fault("steps and batch", "0".to_owned(), "at least 1");
        }
        if self.lengths.is_empty() || self.lengths.contains(&0) {
            return fault("lengths", format!("{:?}", self.lengths), "at least 1 each");
        }
        let numbers = [self.learning_rate, self.clip];
        if !numbers.iter().all(|x| x.is_finite() && *x > 0.0) {
            return fault("rate and clip", format!("{numbers:?}"), "positive numbers");
        }
        Ok(())
    }

    /// Learning rate of a step (from 0).
    fn rate(&self, step: usize) -> f64 {
        let warmup = (self.steps / 20).max(1);
        if step < warmup {
            return self.learning_rate * (step + 1) as f64 / warmup as f64;
        }
        let done = (step - warmup) as f64 / (self.steps - warmup).max(1) as f64;
        let cosine = 0.5 * (1.0 + (std::f64::consts::PI * done).cos());
        self.learning_rate * (0.01 + 0.99 * cosine)
    }
}

/// What a step says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointTrainRow {
    /// Steps done.
    pub step: usize,
    /// Steps that the means are over: 1, or on a device those since it told the last, and 0 while it tells nothing new.
    pub over: usize,
    /// Mean pseudo-Huber error of the batches; before any training about 0.3 to 0.4.
    pub loss: f64,
    /// Mean norm of the gradient.
    pub gradient: f64,
}

/// A training run.
pub struct JointTrainer<'a> {
    config: JointTrainConfig,
    learner: Box<dyn JointLearner>,
    sets: &'a [JointSet],
    step: usize,
    /// What was heard last of a network that is trained on a device.
    heard: JointTrainRow,
}

impl<'a> JointTrainer<'a> {
    /// Starts a run of a network that computes where `model` does; the optimiser is on the host.
    ///
    /// # Errors
    /// Settings out of range, no sequence as long as the longest.
    pub fn new(
        config: JointTrainConfig,
        model: Box<dyn JointNoiseModel>,
        sets: &'a [JointSet],
    ) -> Result<Self, Error> {
        let initial = JointParameters::init(model.config(), config.seed)?;
        let learner = HostLearner::new(model, initial.values, config.clip)?;
        Self::with(config, Box::new(learner), sets)
    }

    /// Starts a run with network and optimiser on a device of burn.
    ///
    /// # Errors
    /// As [`JointTrainer::new`], or a backend that is not available.
    #[cfg(feature = "burn")]
    pub fn on_device(
        config: JointTrainConfig,
        network: &JointConfig,
        backend: dose3_model::burn_unet::Backend,
        sets: &'a [JointSet],
    ) -> Result<Self, Error> {
        let initial = JointParameters::init(network, config.seed)?;
        let learner = crate::device::JointDeviceLearner::new(&initial, config.clip, backend)?;
        Self::with(config, Box::new(learner), sets)
    }

    fn with(
        config: JointTrainConfig,
        learner: Box<dyn JointLearner>,
        sets: &'a [JointSet],
    ) -> Result<Self, Error> {
        config.check()?;
        let longest = config.lengths.iter().copied().max().unwrap_or(1);
        let usable = |set: &JointSet| set.sequences.iter().any(|s| s.len() >= longest);
        if sets.is_empty() || !sets.iter().all(usable) {
            return Err(Error::Config {
                name: "training data",
                found: format!("{} sets", sets.len()),
                expected: "in each a sequence as long as the longest that is drawn",
            });
        }
        Ok(Self {
            config,
            learner,
            sets,
            step: 0,
            heard: JointTrainRow::default(),
        })
    }

    /// Runs to the end; `heard` is told of every step.
    ///
    /// # Errors
    /// Divergence, or a network's refusal.
    pub fn run(&mut self, heard: &mut dyn FnMut(&JointTrainRow)) -> Result<(), Error> {
        while self.step < self.config.steps {
            heard(&self.advance()?);
        }
        Ok(())
    }

    /// One optimiser step. Everything random in it is seeded by the run's seed and the step's number. On a device,
    /// losses are read every 20 steps; in between, the means that were read last are answered.
    ///
    /// # Errors
    /// Divergence, as soon as losses are read, or a network's refusal.
    pub fn advance(&mut self) -> Result<JointTrainRow, Error> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.config.seed);
        rng.set_stream(1 + self.step as u64);
        let lengths = &self.config.lengths;
        let length = lengths[rng.random_range(0..lengths.len())];
        let jitter = self.config.scale_jitter;
        let picks: Vec<Pick<'_>> = (0..self.config.batch)
            .map(|_| Pick::draw(self.sets, length, jitter, &mut rng))
            .collect();
        let batch = Batch::new(&picks, length)?;
        let steps = self.step as f64;
        let rates = Rates {
            learning_rate: self.config.rate(self.step),
            ema_decay: self.config.ema_decay.min((1.0 + steps) / (10.0 + steps)),
        };
        let step = self.step + 1;
        let tell = self.step == 0 || step.is_multiple_of(TOLD) || step == self.config.steps;
        self.heard.over = 0;
        if let Some((over, loss, gradient)) = self.learner.step(&batch, rates, tell)? {
            if !(gradient.is_finite() && loss.is_finite()) {
                return Err(Error::Diverged {
                    branch: "joint",
                    what: "loss or gradient",
                    step: self.step,
                });
            }
            self.heard = JointTrainRow {
                over,
                loss,
                gradient,
                ..self.heard
            };
        }
        self.step = step;
        self.heard.step = step;
        Ok(self.heard)
    }

    /// Steps done.
    pub fn step(&self) -> usize {
        self.step
    }

    /// The averaged weights: what a finished run is kept for.
    ///
    /// # Errors
    /// Averages that are not finite.
    pub fn averaged(&self) -> Result<JointParameters, Error> {
        let config = self.learner.network().clone();
        Ok(JointParameters::new(config, self.learner.averaged()?)?)
    }

    /// Mean error of the averaged weights on other sequences: `count` of them, with levels and noise that are the same
    /// in every call.
    ///
    /// # Errors
    /// As [`JointTrainer::new`], or a network's refusal.
    pub fn validate(&mut self, sets: &[JointSet], count: usize) -> Result<f64, Error> {
        let length = self.config.lengths.iter().copied().max().unwrap_or(1);
        let mut rng = ChaCha8Rng::seed_from_u64(self.config.seed);
        let picks: Vec<Pick<'_>> = (0..count)
            .map(|_| Pick::draw(sets, length, 0.0, &mut rng))
            .collect();
        let batch = Batch::new(&picks, length)?;
        let mut output = vec![0.0; count * length * AXES];
        self.learner.forward_averaged(batch.input(), &mut output)?;
        let size = length * AXES;
        let of = |i: usize| batch.loss(i, &output[i * size..][..size], None);
        Ok((0..count).map(of).sum::<f64>() / count as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joint::{JointProcess, Levels, Noised};
    use crate::window::normals;
    use dose3_engine::{EngineOptions, JointEngine};
    use dose3_model::joint::{JointConfig, JointInput};

    /// Yaw follows from sideways motion two steps before; all else is still.
    fn coupled() -> JointSet {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let y = normals(&mut rng, 400);
        let step = |t: usize| {
            [
                0.0,
                f64::from(y[t]),
                0.0,
                0.0,
                0.0,
                0.1 * f64::from(y[t - 2]),
            ]
        };
        JointSet {
            sequences: vec![(2..400).map(step).collect()],
            scale: [1.0, 1.0, 1.0, 0.1, 0.1, 0.1],
            step: 0.1,
            weight: 1.0,
        }
    }

    fn engine() -> JointEngine {
        let initial = JointParameters::init(&JointConfig::new(16, &[1, 2]), 0).unwrap();
        JointEngine::new(&initial, EngineOptions::default()).unwrap()
    }

    fn trained(steps: usize, sets: &[JointSet]) -> (JointParameters, f64) {
        let config = JointTrainConfig {
            steps,
            batch: 16,
            lengths: vec![32],
            learning_rate: 5e-3,
            ..JointTrainConfig::default()
        };
        let mut trainer = JointTrainer::new(config, Box::new(engine()), sets).unwrap();
        trainer.run(&mut |_| ()).unwrap();
        let loss = trainer.validate(sets, 64).unwrap();
        (trainer.averaged().unwrap(), loss)
    }

    #[test]
    fn a_coupling_is_learnt() {
        let sets = [coupled()];
        let (parameters, loss) = trained(250, &sets);
        let (_, first) = trained(1, &sets);
        assert!(loss < 0.5 * first, "{loss} {first}");
        // Yaw noised beyond recognition is known from the sideways motion.
        let mut engine = engine();
        engine.set_parameters(&parameters.values).unwrap();
        let process = JointProcess::new(&sets[0].sequences[0][..64], sets[0].scale).unwrap();
        let levels = Levels::only(8.0, |axis| axis == 5);
        let mut noised = Noised::default();
        let noise = normals(&mut ChaCha8Rng::seed_from_u64(3), 64 * AXES);
        process.noised(&levels, &noise, &mut noised).unwrap();
        let mut output = vec![0.0; 64 * AXES];
        let input = JointInput {
            x: &noised.input,
            conditions: &levels.conditions(0.1),
            batch: 1,
            length: 64,
        };
        engine.forward(input, &mut output).unwrap();
        let yaw = |values: &[f32]| -> Vec<f32> { values.chunks(AXES).map(|row| row[5]).collect() };
        let (found, wanted) = (yaw(&output), yaw(&noised.target));
        let square = |values: &mut dyn Iterator<Item = f32>| values.map(|x| x * x).sum::<f32>();
        let left = square(&mut found.iter().zip(&wanted).map(|(a, b)| a - b));
        let all = square(&mut wanted.iter().copied());
        assert!(left < 0.4 * all, "{left} of {all}");
    }

    #[test]
    fn the_same_seed_gives_the_same_weights() {
        let sets = [coupled()];
        assert_eq!(trained(5, &sets), trained(5, &sets));
    }

    /// As the engine, but for rounding; losses are those of the steps since they were read last.
    #[cfg(feature = "burn")]
    #[test]
    fn the_device_takes_the_steps_of_the_engine() {
        let sets = [coupled()];
        let config = JointTrainConfig {
            steps: 25,
            batch: 8,
            lengths: vec![32, 16],
            ..JointTrainConfig::default()
        };
        let network = JointConfig::new(16, &[1, 2]);
        let mut host = JointTrainer::new(config.clone(), Box::new(engine()), &sets).unwrap();
        let flex = dose3_model::burn_unet::Backend::Flex;
        let mut device = JointTrainer::on_device(config.clone(), &network, flex, &sets).unwrap();
        let (mut sum, mut count, mut told) = (0.0, 0, 0);
        for step in 1..=config.steps {
            let (a, b) = (device.advance().unwrap(), host.advance().unwrap());
            assert_eq!((a.step, b.step), (step, step));
            (sum, count) = (sum + b.loss, count + 1);
            let told_now = [1, TOLD, config.steps].contains(&step);
            assert_eq!((a.over, b.over), (if told_now { count } else { 0 }, 1));
            if told_now {
                let mean: f64 = sum / count as f64;
                assert!(
                    (a.loss - mean).abs() < 1e-4 * mean,
                    "{step}: {} {mean}",
                    a.loss
                );
                (sum, count, told) = (0.0, 0, told + 1);
            }
        }
        assert_eq!(told, 3);
        let (a, b) = (
            device.validate(&sets, 8).unwrap(),
            host.validate(&sets, 8).unwrap(),
        );
        assert!((a - b).abs() < 1e-4 * b, "{a} {b}");
    }

    #[test]
    fn bad_settings_are_refused() {
        let refused = |config: JointTrainConfig, sets: &[JointSet]| {
            JointTrainer::new(config, Box::new(engine()), sets).is_err()
        };
        let set = coupled();
        let short = JointSet {
            sequences: vec![vec![[0.0; AXES]; 20]],
            ..set.clone()
        };
        let config = JointTrainConfig::default();
        assert!(refused(config.clone(), &[set.clone(), short]));
        assert!(refused(config.clone(), &[]));
        let none = JointTrainConfig {
            lengths: Vec::new(),
            ..config
        };
        assert!(refused(none, &[set]));
    }
}
