//! The trainer: Algorithm 1 over any [`Learner`], reproducible and resumable to the bit.
//!
//! Everything random in step `k` comes from a generator seeded by `(seed, k)`, so a run that
//! resumes from a checkpoint draws what the uninterrupted run would have drawn.

mod checkpoint;
mod config;
mod host;
mod learner;
mod log;
mod source;

pub use config::TrainConfig;
pub use learner::{
    BranchBatch, Learner, LearnerPair, LearnerState, Losses, Objective, Rates, Target,
};
pub use log::{COLUMNS, LogRow, to_csv};
pub use source::WindowSource;

use crate::error::Error;
use crate::process::{Process, ProcessConfig};
use dose3_model::{PairConfig, PairParameters, Parameters};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use source::Batch;
use std::path::Path;

/// A training run.
pub struct Trainer<'a> {
    config: TrainConfig,
    process: Process,
    network: PairConfig,
    data: String,
    learners: LearnerPair,
    train: &'a dyn WindowSource,
    validation: &'a dyn WindowSource,
    step: usize,
    log: Vec<LogRow>,
    /// Losses of the steps since the log's last row.
    pending: [Losses; 2],
    /// Means that were heard of last.
    heard: LogRow,
}

impl<'a> Trainer<'a> {
    /// Starts a run. `learners` are made for `network`, with the weights of [`TrainConfig::initial`]; `data` identifies the training
    /// data and guards resumption; `validation` may be empty.
    ///
    /// # Errors
    /// Settings out of range, no training window, or a network that refuses its parameters.
    pub fn new(
        config: TrainConfig,
        process: ProcessConfig,
        network: PairConfig,
        data: String,
        learners: LearnerPair,
        train: &'a dyn WindowSource,
        validation: &'a dyn WindowSource,
    ) -> Result<Self, Error> {
        config.validate()?;
        if train.is_empty() {
            return Err(Error::Config {
                name: "training data",
                found: "no window".into(),
                expected: "at least one log as long as a window",
            });
        }
        Ok(Self {
            config,
            process: Process::new(process)?,
            network,
            data,
            learners,
            train,
            validation,
            step: 0,
            log: Vec::new(),
            pending: Default::default(),
            heard: LogRow::default(),
        })
    }

    /// Goes on from a checkpoint's bytes; `path` only names it in errors.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] where settings, network or data differ from this run's.
    pub fn resume(&mut self, path: &Path, bytes: &[u8]) -> Result<(), Error> {
        let LearnerPair {
            translation,
            rotation,
        } = &mut self.learners;
        let sizes = [&*translation, &*rotation].map(|l| l.network().parameter_count());
        let (header, states) = checkpoint::from_bytes(path, bytes, sizes)?;
        let refuse = |what: &str, theirs: String, ours: String| Error::Checkpoint {
            path: path.display().to_string(),
            reason: format!("{what} differs: the checkpoint has {theirs}, this run {ours}"),
        };
        if header.config != self.config {
            let (a, b) = (format!("{:?}", header.config), format!("{:?}", self.config));
            return Err(refuse("training configuration", a, b));
        }
        if header.process != self.process.config() {
            let (a, b) = (
                format!("{:?}", header.process),
                format!("{:?}", self.process.config()),
            );
            return Err(refuse("diffusion process", a, b));
        }
        if header.network != self.network {
            let (a, b) = (
                format!("{:?}", header.network),
                format!("{:?}", self.network),
            );
            return Err(refuse("network", a, b));
        }
        if header.data != self.data {
            return Err(refuse("training data", header.data, self.data.clone()));
        }
        translation.restore(header.step as u64, &states[0])?;
        rotation.restore(header.step as u64, &states[1])?;
        self.step = header.step;
        self.log = header.log;
        self.pending = Default::default();
        self.heard = self.log.last().copied().unwrap_or_default();
        Ok(())
    }

    /// The run's state as checkpoint bytes; call it on multiples of `log_every`.
    ///
    /// # Errors
    /// Where the state cannot be serialised.
    pub fn checkpoint(&self) -> Result<Vec<u8>, Error> {
        let header = checkpoint::Header {
            config: self.config,
            process: self.process.config(),
            network: self.network.clone(),
            data: self.data.clone(),
            step: self.step,
            log: self.log.clone(),
        };
        let LearnerPair {
            translation,
            rotation,
        } = &self.learners;
        checkpoint::to_bytes(&header, &[translation.state()?, rotation.state()?])
    }

    /// Optimiser steps done.
    pub fn step_count(&self) -> usize {
        self.step
    }

    /// The log so far.
    pub fn log(&self) -> &[LogRow] {
        &self.log
    }

    /// The averaged weights: what a finished run is kept for.
    ///
    /// # Errors
    /// Where the averages are not finite.
    pub fn averaged(&self) -> Result<PairParameters, Error> {
        let take = |learner: &dyn Learner| -> Result<Parameters, Error> {
            let values = learner.averaged()?;
            Ok(Parameters::new(learner.network().clone(), values)?)
        };
        Ok(PairParameters {
            translation: take(self.learners.translation.as_ref())?,
            rotation: take(self.learners.rotation.as_ref())?,
        })
    }

    /// Runs to the end. `on_step` sees every step, as [`Trainer::advance`] answers; `on_checkpoint` gets the bytes to
    /// keep every `checkpoint_every` steps and at the end.
    ///
    /// # Errors
    /// Divergence, or whatever `on_step` and `on_checkpoint` answer.
    pub fn run(
        &mut self,
        on_step: &mut dyn FnMut(&LogRow) -> Result<(), Error>,
        on_checkpoint: &mut dyn FnMut(&Self) -> Result<(), Error>,
    ) -> Result<(), Error> {
        while self.step < self.config.steps {
            let row = self.advance()?;
            on_step(&row)?;
            let due = self.config.checkpoint_every > 0
                && self.step.is_multiple_of(self.config.checkpoint_every);
            if due || self.step == self.config.steps {
                on_checkpoint(self)?;
            }
        }
        Ok(())
    }

    /// One optimiser step of both branches. Answers its means; where the networks are trained on a device, those that
    /// were read from it last: of this run's first step, then of the steps up to each row of the log.
    ///
    /// # Errors
    /// Divergence, as soon as losses are read, or a network's refusal.
    pub fn advance(&mut self) -> Result<LogRow, Error> {
        let mut rng = self.rng(1 + self.step as u64);
        let (train, steps) = (self.train, self.process.steps());
        let picks: Vec<(usize, usize)> = (0..self.config.batch)
            .map(|_| (rng.random_range(0..train.len()), rng.random_range(0..steps)))
            .collect();
        let batch = Batch::assemble(&self.process, train, &picks, &mut rng)?;
        let step = self.step + 1;
        let last = step == self.config.steps;
        let due = last || step.is_multiple_of(self.config.log_every);
        let rates = Rates {
            learning_rate: self.config.rate(self.step),
            ema_decay: self.config.ema(self.step),
        };
        let objective = Objective {
            process: &self.process,
            loss: &self.config.loss,
        };
        let LearnerPair {
            translation,
            rotation,
        } = &mut self.learners;
        let tell = due || self.heard.step == 0;
        let t = translation.step(&objective, &batch.translation(), rates, tell)?;
        let r = rotation.step(&objective, &batch.rotation(), rates, tell)?;
        if let (Some(t), Some(r)) = (t, r) {
            t.check("translation", self.step)?;
            r.check("rotation", self.step)?;
            self.pending[0].add(&t);
            self.pending[1].add(&r);
            self.heard = LogRow::of(step, rates.learning_rate, &t, &r);
        }
        self.heard.step = step;
        self.heard.learning_rate = rates.learning_rate;

        self.step = step;
        if due {
            let [t, r] = std::mem::take(&mut self.pending);
            let mut row = LogRow::of(step, rates.learning_rate, &t, &r);
            let every = self.config.validate_every;
            let due = every > 0 && step.is_multiple_of(every);
            if (due || last) && !self.validation.is_empty() {
                let (t, r) = self.validate()?;
                row.translation_validation = Some(t);
                row.rotation_validation = Some(r);
            }
            self.log.push(row);
        }
        Ok(self.heard)
    }

    /// Noise losses `(translation, rotation)` of the averaged weights on the validation
    /// windows, with fixed noise and steps spread evenly.
    ///
    /// # Errors
    /// A network's refusal.
    fn validate(&mut self) -> Result<(f64, f64), Error> {
        let source = self.validation;
        let count = self.config.validation_windows.clamp(1, source.len());
        let picks: Vec<(usize, usize)> = (0..count)
            .map(|i| (i * source.len() / count, i % self.process.steps()))
            .collect();
        let mut rng = self.rng(0);
        let batch = Batch::assemble(&self.process, source, &picks, &mut rng)?;
        let (t, r) = (batch.translation(), batch.rotation());
        let size = source.length() * 3;
        let mut translation = vec![0.0; count * size];
        let mut rotation = vec![0.0; count * size];
        self.learners
            .translation
            .forward_averaged(t.input, &mut translation)?;
        self.learners
            .rotation
            .forward_averaged(r.input, &mut rotation)?;
        let (mut sums, mut scratch) = ((0.0, 0.0), vec![0.0; size]);
        let loss = crate::loss::LossConfig {
            x0_weight: 0.0,
            ..self.config.loss
        };
        let objective = Objective {
            process: &self.process,
            loss: &loss,
        };
        for b in 0..count {
            let rows = b * size..(b + 1) * size;
            sums.0 += t
                .loss(&objective, b, &translation[rows.clone()], &mut scratch)
                .eps;
            sums.1 += r.loss(&objective, b, &rotation[rows], &mut scratch).eps;
        }
        Ok((sums.0 / count as f64, sums.1 / count as f64))
    }

    fn rng(&self, stream: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.config.seed);
        rng.set_stream(stream);
        rng
    }
}
