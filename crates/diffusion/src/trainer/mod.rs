//! The trainer: Algorithm 1 over any [`NoiseModel`], reproducible and resumable to the bit.
//!
//! Everything random in step `k` comes from a generator seeded by `(seed, k)`, so a run that
//! resumes from a checkpoint draws what the uninterrupted run would have drawn.

mod checkpoint;
mod config;
mod log;

pub use config::TrainConfig;
pub use log::{COLUMNS, LogRow, to_csv};

use crate::error::Error;
use crate::loss::SampleLoss;
use crate::probe::ModelPair;
use crate::process::{Process, ProcessConfig, rotation_logs};
use crate::window::{Noise, Window};
use dose3_engine::{Adam, AdamConfig};
use dose3_model::{Input, NoiseModel, PairConfig, PairParameters};
use log::{Accumulator, finite};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::sync::Mutex;

/// Where training windows come from.
pub trait WindowSource {
    /// Number of windows.
    fn len(&self) -> usize;
    /// Whether there is none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Poses a window.
    fn length(&self) -> usize;
    /// Writes window `index`: translation `[length, 3]`, rotation `[length, 9]`.
    ///
    /// # Errors
    /// [`Error::Window`] where the window cannot be represented.
    fn read(
        &self,
        index: usize,
        translation: &mut [f32],
        rotation: &mut [f32],
    ) -> Result<(), Error>;
}

/// One network with its optimiser.
pub(crate) struct Branch {
    name: &'static str,
    values: Vec<f32>,
    gradient: Vec<f32>,
    adam: Adam,
}

impl Branch {
    fn new(name: &'static str, values: Vec<f32>, clip: f64) -> Self {
        let config = AdamConfig {
            max_grad_norm: Some(clip as f32),
            ..AdamConfig::default()
        };
        let adam = Adam::new(&values, config);
        Self {
            name,
            gradient: vec![0.0; values.len()],
            values,
            adam,
        }
    }

    fn adam_mut(&mut self) -> &mut Adam {
        &mut self.adam
    }

    fn parts(&self) -> [(&'static str, &[f32]); 4] {
        let (m, v, ema) = self.adam.state();
        [("values", &self.values), ("m", m), ("v", v), ("ema", ema)]
    }

    fn parts_mut(&mut self) -> [(&'static str, &mut [f32]); 4] {
        let (m, v, ema) = self.adam.state_mut();
        [
            ("values", &mut self.values),
            ("m", m),
            ("v", v),
            ("ema", ema),
        ]
    }
}

/// One batch of noised windows.
struct Batch {
    steps: Vec<usize>,
    times: Vec<f32>,
    noise: Vec<Noise>,
    clean_rotation: Vec<f32>,
    translation: Vec<f32>,
    rotation: Vec<f32>,
}

/// A training run.
pub struct Trainer<'a> {
    config: TrainConfig,
    process: Process,
    network: PairConfig,
    data: String,
    models: &'a mut ModelPair,
    train: &'a dyn WindowSource,
    validation: &'a dyn WindowSource,
    translation: Branch,
    rotation: Branch,
    step: usize,
    log: Vec<LogRow>,
    pending: Accumulator,
}

impl<'a> Trainer<'a> {
    /// Starts a run. `models` must have the shape of `network`; `data` identifies the training
    /// data and guards resumption; `validation` may be empty.
    ///
    /// # Errors
    /// Settings out of range, no training window, or a network that refuses its parameters.
    pub fn new(
        config: TrainConfig,
        process: ProcessConfig,
        network: PairConfig,
        data: String,
        models: &'a mut ModelPair,
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
        let parameters = PairParameters::init(&network, config.seed)?;
        let branch = |name, values| Branch::new(name, values, config.clip);
        Ok(Self {
            config,
            process: Process::new(process)?,
            network,
            data,
            models,
            train,
            validation,
            translation: branch("translation", parameters.translation.values),
            rotation: branch("rotation", parameters.rotation.values),
            step: 0,
            log: Vec::new(),
            pending: Accumulator::default(),
        })
    }

    /// Goes on from a checkpoint's bytes; `path` only names it in errors.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] where settings, network or data differ from this run's.
    pub fn resume(&mut self, path: &Path, bytes: &[u8]) -> Result<(), Error> {
        let header =
            checkpoint::from_bytes(path, bytes, [&mut self.translation, &mut self.rotation])?;
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
        self.step = header.step;
        self.log = header.log;
        self.pending = Accumulator::default();
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
        checkpoint::to_bytes(&header, [&self.translation, &self.rotation])
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
        let take = |branch: &Branch, config: &dose3_model::UNetConfig| {
            dose3_model::Parameters::new(config.clone(), branch.parts()[3].1.to_vec())
        };
        Ok(PairParameters {
            translation: take(&self.translation, &self.network.translation)?,
            rotation: take(&self.rotation, &self.network.rotation)?,
        })
    }

    /// Runs to the end. `on_step` sees every step's means; `on_checkpoint` gets the bytes to
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

    /// One optimiser step of both branches.
    ///
    /// # Errors
    /// Divergence, or a network's refusal.
    pub fn advance(&mut self) -> Result<LogRow, Error> {
        let mut rng = self.rng(1 + self.step as u64);
        let batch = {
            let (train, steps) = (self.train, self.process.steps());
            let picks: Vec<(usize, usize)> = (0..self.config.batch)
                .map(|_| (rng.random_range(0..train.len()), rng.random_range(0..steps)))
                .collect();
            self.assemble(train, &picks, &mut rng)?
        };
        let rate = self.config.rate(self.step);
        let step = self.step;
        let (config, process, length) = (&self.config, &self.process, self.train.length());
        let samples = config.batch as f32;
        let average = |g: &mut [f32]| g.iter_mut().for_each(|v| *v /= samples);

        let translation_loss = |b: usize, out: &[f32], grad: &mut [f32]| {
            let loss = process.translation_loss(
                &config.loss,
                batch.steps[b],
                out,
                &batch.noise[b].translation,
                grad,
            );
            average(grad);
            loss
        };
        let t = update(
            self.models.translation.as_mut(),
            &mut self.translation,
            batch.input(&batch.translation, length),
            rate,
            config.ema(step),
            step,
            &translation_loss,
        )?;
        let rotation_loss = |b: usize, out: &[f32], grad: &mut [f32]| {
            let rows = b * length * 9..(b + 1) * length * 9;
            let loss = process.rotation_loss(
                &config.loss,
                batch.steps[b],
                out,
                &batch.noise[b].rotation,
                &batch.rotation[rows.clone()],
                &batch.clean_rotation[rows],
                grad,
            );
            average(grad);
            loss
        };
        let r = update(
            self.models.rotation.as_mut(),
            &mut self.rotation,
            batch.input(&batch.rotation, length),
            rate,
            config.ema(step),
            step,
            &rotation_loss,
        )?;

        self.step += 1;
        let row = LogRow {
            step: self.step,
            learning_rate: rate,
            translation_eps: t.0.eps,
            translation_x0: t.0.x0,
            rotation_eps: r.0.eps,
            rotation_x0: r.0.x0,
            translation_gradient: t.1,
            rotation_gradient: r.1,
            ..LogRow::default()
        };
        self.pending.add(&row);
        if self.step.is_multiple_of(self.config.log_every) || self.step == self.config.steps {
            let mut row = self.pending.take();
            let due = self.config.validate_every > 0
                && self.step.is_multiple_of(self.config.validate_every);
            if (due || self.step == self.config.steps) && !self.validation.is_empty() {
                let (t, r) = self.validate()?;
                row.translation_validation = Some(t);
                row.rotation_validation = Some(r);
            }
            self.log.push(row);
        }
        Ok(row)
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
        let batch = self.assemble(source, &picks, &mut rng)?;
        let length = source.length();
        let evaluate = |model: &mut dyn NoiseModel, branch: &Branch, x: &[f32]| {
            model.set_parameters(branch.parts()[3].1)?;
            let mut out = vec![0.0; count * length * 3];
            model.forward(batch.input(x, length), &mut out)?;
            Ok::<_, Error>(out)
        };
        let translation = evaluate(
            self.models.translation.as_mut(),
            &self.translation,
            &batch.translation,
        )?;
        let rotation = evaluate(
            self.models.rotation.as_mut(),
            &self.rotation,
            &batch.rotation,
        )?;
        let (mut sums, mut scratch) = ((0.0, 0.0), vec![0.0; length * 3]);
        let loss = crate::loss::LossConfig {
            x0_weight: 0.0,
            ..self.config.loss
        };
        for b in 0..count {
            let rows = b * length * 3..(b + 1) * length * 3;
            let t = batch.steps[b];
            let noise = &batch.noise[b];
            sums.0 += self
                .process
                .translation_loss(
                    &loss,
                    t,
                    &translation[rows.clone()],
                    &noise.translation,
                    &mut scratch,
                )
                .eps;
            for i in 0..length {
                let e = crate::window::read_vector(&rotation[rows.clone()], i);
                let z = crate::window::read_vector(&noise.rotation, i);
                sums.1 += crate::loss::geodesic_loss(&e, &z).0 / length as f64;
            }
        }
        Ok((sums.0 / count as f64, sums.1 / count as f64))
    }

    fn rng(&self, stream: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.config.seed);
        rng.set_stream(stream);
        rng
    }

    fn assemble(
        &self,
        source: &dyn WindowSource,
        picks: &[(usize, usize)],
        rng: &mut ChaCha8Rng,
    ) -> Result<Batch, Error> {
        let (length, n) = (source.length(), picks.len());
        let mut batch = Batch {
            steps: picks.iter().map(|p| p.1).collect(),
            times: picks.iter().map(|p| p.1 as f32).collect(),
            noise: Vec::with_capacity(n),
            clean_rotation: vec![0.0; n * length * 9],
            translation: vec![0.0; n * length * 3],
            rotation: vec![0.0; n * length * 9],
        };
        let mut clean = vec![0.0; length * 3];
        for (b, (index, t)) in picks.iter().enumerate() {
            let rows = b * length * 9..(b + 1) * length * 9;
            source.read(*index, &mut clean, &mut batch.clean_rotation[rows.clone()])?;
            let window = Window {
                translation: &clean,
                rotation: &batch.clean_rotation[rows.clone()],
            };
            let noise = Noise::draw(rng, length, self.process.config().rotation_noise);
            self.process.forward_into(
                window.translation,
                &rotation_logs(window.rotation),
                &noise,
                *t,
                &mut batch.translation[b * length * 3..(b + 1) * length * 3],
                &mut batch.rotation[rows],
            )?;
            batch.noise.push(noise);
        }
        Ok(batch)
    }
}

impl Batch {
    fn input<'b>(&'b self, x: &'b [f32], length: usize) -> Input<'b> {
        Input {
            x,
            steps: &self.times,
            batch: self.times.len(),
            length,
        }
    }
}

/// The loss of one sample (index, output, gradient to fill).
type BranchLoss<'a> = dyn Fn(usize, &[f32], &mut [f32]) -> SampleLoss + Sync + 'a;

/// One branch's step: forward, loss, backward, Adam. Answers the batch's mean loss and the
/// gradient norm before clipping.
fn update(
    model: &mut dyn NoiseModel,
    branch: &mut Branch,
    input: Input<'_>,
    rate: f64,
    ema_decay: f64,
    step: usize,
    loss: &BranchLoss<'_>,
) -> Result<(SampleLoss, f64), Error> {
    model.set_parameters(&branch.values)?;
    // Per sample, so that the sum does not depend on which thread came first.
    let losses = Mutex::new(vec![SampleLoss::default(); input.batch]);
    let size = input.length * model.config().out_channels;
    let callback = |first: usize, out: &[f32], grad: &mut [f32]| {
        let chunk: Vec<SampleLoss> = out
            .chunks_exact(size)
            .zip(grad.chunks_exact_mut(size))
            .enumerate()
            .map(|(i, (out, grad))| loss(first + i, out, grad))
            .collect();
        // Held for a copy only: no thread that holds it can be made to wait.
        if let Ok(mut losses) = losses.lock() {
            losses[first..first + chunk.len()].copy_from_slice(&chunk);
        }
    };
    model.forward_backward(input, &callback, &mut branch.gradient)?;
    let losses = losses
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let n = losses.len() as f64;
    let mut mean = SampleLoss::default();
    for l in &losses {
        mean.eps += l.eps / n;
        mean.x0 += l.x0 / n;
        mean.total += l.total / n;
    }
    finite(branch.name, "loss", step, mean.total)?;
    let norm = branch.adam.step(
        &mut branch.values,
        &branch.gradient,
        rate as f32,
        ema_decay as f32,
    );
    finite(branch.name, "gradient", step, f64::from(norm))?;
    Ok((mean, f64::from(norm)))
}
