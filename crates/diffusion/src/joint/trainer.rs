//! Training of the joint network.

use super::levels::Levels;
use super::process::{AXES, JointProcess, Noised};
use crate::error::Error;
use crate::window::normals;
use dose3_engine::{Adam, AdamConfig};
use dose3_model::joint::{CONDITIONS, JointInput, JointNoiseModel, JointParameters};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Mutex;

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
            steps: 6000,
            batch: 32,
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
    /// Mean pseudo-Huber error of the batch; before any training about 0.3 to 0.4.
    pub loss: f64,
    /// Norm of the gradient.
    pub gradient: f64,
}

/// A training run.
pub struct JointTrainer<'a> {
    config: JointTrainConfig,
    model: &'a mut dyn JointNoiseModel,
    sets: &'a [JointSet],
    parameters: JointParameters,
    adam: Adam,
    gradient: Vec<f32>,
    step: usize,
}

/// `sqrt(1 + e^2) - 1`: a square near 0, so that it is the mean that is learnt, and no more than linear far out, so
/// that the jumps of sound sensors do not decide what is learnt.
fn pseudo_huber(e: f32) -> (f64, f32) {
    let root = (1.0 + e * e).sqrt();
    (f64::from(e * e / (1.0 + root)), e / root)
}

impl<'a> JointTrainer<'a> {
    /// Starts a run.
    ///
    /// # Errors
    /// Settings out of range, no sequence as long as the longest.
    pub fn new(
        config: JointTrainConfig,
        model: &'a mut dyn JointNoiseModel,
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
        let parameters = JointParameters::init(model.config(), config.seed)?;
        model.set_parameters(&parameters.values)?;
        let adam = Adam::new(
            &parameters.values,
            AdamConfig {
                max_grad_norm: Some(config.clip as f32),
                ..AdamConfig::default()
            },
        );
        Ok(Self {
            gradient: vec![0.0; parameters.values.len()],
            config,
            model,
            sets,
            parameters,
            adam,
            step: 0,
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

    /// One optimiser step. Everything random in it is seeded by the run's seed and the step's number.
    ///
    /// # Errors
    /// Divergence, or a network's refusal.
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
        let loss = batch.run(self.model, &mut self.gradient)?;
        let rate = self.config.rate(self.step) as f32;
        let steps = self.step as f64;
        let decay = self.config.ema_decay.min((1.0 + steps) / (10.0 + steps)) as f32;
        let values = &mut self.parameters.values;
        let norm = self.adam.step(values, &self.gradient, rate, decay);
        if !(norm.is_finite() && loss.is_finite()) {
            return Err(Error::Diverged {
                branch: "joint",
                what: "loss or gradient",
                step: self.step,
            });
        }
        self.model.set_parameters(values)?;
        self.step += 1;
        Ok(JointTrainRow {
            step: self.step,
            loss,
            gradient: f64::from(norm),
        })
    }

    /// The averaged weights: what a finished run is kept for.
    ///
    /// # Errors
    /// Averages that are not finite.
    pub fn averaged(&self) -> Result<JointParameters, Error> {
        let average = self.adam.state().2.to_vec();
        Ok(JointParameters::new(
            self.parameters.config.clone(),
            average,
        )?)
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
        self.model.set_parameters(self.adam.state().2)?;
        let mut output = vec![0.0; count * length * AXES];
        self.model.forward(batch.input(), &mut output)?;
        self.model.set_parameters(&self.parameters.values)?;
        let size = length * AXES;
        let of = |i: usize| batch.loss(i, &output[i * size..][..size], None);
        Ok((0..count).map(of).sum::<f64>() / count as f64)
    }
}

/// A sequence that was drawn, with its levels and the seed of its noise.
struct Pick<'a> {
    steps: &'a [[f64; AXES]],
    scale: [f64; AXES],
    step: f64,
    levels: Levels,
    noise: u64,
}

impl<'a> Pick<'a> {
    fn draw(sets: &'a [JointSet], length: usize, jitter: f64, rng: &mut impl Rng) -> Self {
        let total: f64 = sets.iter().map(|set| set.weight).sum();
        let mut at = rng.random_range(0.0..total);
        let mut set = &sets[0];
        for next in sets {
            set = next;
            at -= next.weight;
            if at < 0.0 {
                break;
            }
        }
        // Every start is as likely as any other, whichever sequence it is in.
        let starts = |s: &Vec<_>| (s.len() + 1).saturating_sub(length);
        let all: usize = set.sequences.iter().map(starts).sum();
        let mut start = rng.random_range(0..all.max(1));
        let mut steps: &[[f64; AXES]] = &[];
        for sequence in &set.sequences {
            if start < starts(sequence) {
                steps = &sequence[start..start + length];
                break;
            }
            start -= starts(sequence);
        }
        let scale = set.scale.map(|s| match jitter > 0.0 {
            true => s * rng.random_range(-jitter..jitter).exp(),
            false => s,
        });
        Self {
            steps,
            scale,
            step: set.step,
            levels: Levels::draw(rng),
            noise: rng.random(),
        }
    }
}

/// Noised sequences.
struct Batch {
    x: Vec<f32>,
    target: Vec<f32>,
    conditions: Vec<f32>,
    noised: Vec<[bool; AXES]>,
    length: usize,
}

impl Batch {
    fn new(picks: &[Pick<'_>], length: usize) -> Result<Self, Error> {
        let one = |pick: &Pick<'_>| -> Result<Noised, Error> {
            let mut rng = ChaCha8Rng::seed_from_u64(pick.noise);
            let noise = normals(&mut rng, length * AXES);
            let mut noised = Noised::default();
            let process = JointProcess::new(pick.steps, pick.scale)?;
            process.noised(&pick.levels, &noise, &mut noised)?;
            Ok(noised)
        };
        let noised: Vec<Noised> = picks.par_iter().map(one).collect::<Result<_, _>>()?;
        let told = picks.iter().flat_map(|p| p.levels.conditions(p.step));
        Ok(Self {
            x: noised
                .iter()
                .flat_map(|n| n.input.iter().copied())
                .collect(),
            target: noised
                .iter()
                .flat_map(|n| n.target.iter().copied())
                .collect(),
            conditions: told.collect(),
            noised: picks.iter().map(|p| p.levels.0.map(|s| s > 0.0)).collect(),
            length,
        })
    }

    fn input(&self) -> JointInput<'_> {
        JointInput {
            x: &self.x,
            conditions: &self.conditions,
            batch: self.conditions.len() / CONDITIONS,
            length: self.length,
        }
    }

    /// Mean error of sequence `index` over its noised axes, and its gradient.
    fn loss(&self, index: usize, output: &[f32], mut gradient: Option<&mut [f32]>) -> f64 {
        let target = &self.target[index * self.length * AXES..][..output.len()];
        let noised = &self.noised[index];
        let count = noised.iter().filter(|n| **n).count().max(1) * self.length;
        let mut sum = 0.0;
        for (i, (f, t)) in output.iter().zip(target).enumerate() {
            if !noised[i % AXES] {
                continue;
            }
            let (loss, slope) = pseudo_huber(f - t);
            sum += loss;
            if let Some(gradient) = &mut gradient {
                gradient[i] = slope / count as f32;
            }
        }
        sum / count as f64
    }

    /// Mean loss of the batch; fills the gradient of the parameters.
    fn run(&self, model: &mut dyn JointNoiseModel, gradient: &mut [f32]) -> Result<f64, Error> {
        let size = self.length * AXES;
        let count = self.noised.len();
        let losses = Mutex::new(vec![0.0; count]);
        let of_chunk = |first: usize, output: &[f32], to: &mut [f32]| {
            let sequences = output.chunks_exact(size).zip(to.chunks_exact_mut(size));
            for (i, (output, to)) in sequences.enumerate() {
                let loss = self.loss(first + i, output, Some(&mut *to));
                to.iter_mut().for_each(|g| *g /= count as f32);
                if let Ok(mut losses) = losses.lock() {
                    losses[first + i] = loss;
                }
            }
        };
        model.forward_backward(self.input(), &of_chunk, gradient)?;
        let losses = losses.into_inner().unwrap_or_default();
        Ok(losses.iter().sum::<f64>() / count as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_engine::{EngineOptions, JointEngine};
    use dose3_model::joint::JointConfig;

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

    fn trained(steps: usize, sets: &[JointSet]) -> (JointEngine, JointParameters, f64) {
        let config = JointTrainConfig {
            steps,
            batch: 16,
            lengths: vec![32],
            learning_rate: 5e-3,
            ..JointTrainConfig::default()
        };
        let initial = JointParameters::init(&JointConfig::new(16, &[1, 2]), 0).unwrap();
        let mut engine = JointEngine::new(&initial, EngineOptions::default()).unwrap();
        let mut trainer = JointTrainer::new(config, &mut engine, sets).unwrap();
        trainer.run(&mut |_| ()).unwrap();
        let loss = trainer.validate(sets, 64).unwrap();
        let averaged = trainer.averaged().unwrap();
        (engine, averaged, loss)
    }

    #[test]
    fn a_coupling_is_learnt() {
        let sets = [coupled()];
        let (mut engine, parameters, loss) = trained(250, &sets);
        let (_, _, first) = trained(1, &sets);
        assert!(loss < 0.5 * first, "{loss} {first}");
        // Yaw noised beyond recognition is known from the sideways motion.
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
        assert_eq!(trained(5, &sets).1, trained(5, &sets).1);
    }

    #[test]
    fn bad_settings_are_refused() {
        let initial = JointParameters::init(&JointConfig::new(4, &[1]), 0).unwrap();
        let mut engine = JointEngine::new(&initial, EngineOptions::default()).unwrap();
        let set = coupled();
        let short = JointSet {
            sequences: vec![vec![[0.0; AXES]; 20]],
            ..set.clone()
        };
        let config = JointTrainConfig::default();
        assert!(JointTrainer::new(config.clone(), &mut engine, &[set.clone(), short]).is_err());
        assert!(JointTrainer::new(config.clone(), &mut engine, &[]).is_err());
        let none = JointTrainConfig {
            lengths: Vec::new(),
            ..config
        };
        assert!(JointTrainer::new(none, &mut engine, &[set]).is_err());
    }
}
