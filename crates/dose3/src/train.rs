//! Training: from trajectories to a model.

use crate::atomic;
use crate::backend::Computing;
use crate::error::{Error, Result};
use crate::model_file::{LogRecord, Model, ModelHeader, TrainingRecord, VERSION};
use crate::progress::Progress;
use dose3_datasets::{
    Frame, Kind, Representation, Scaling, Trajectory, Window, hex, same_rate, split_by_log, windows,
};
use dose3_diffusion::trainer::{LogRow, TrainConfig, Trainer, WindowSource};
use dose3_diffusion::{Error as DiffusionError, NoiseSchedule, ProcessConfig};
use dose3_model::PairConfig;
use sha2::{Digest, Sha256};
use std::path::PathBuf;

/// Which logs are held out of training.
#[derive(Clone, Debug, PartialEq)]
pub enum HoldOut {
    /// Logs by name.
    Names(Vec<String>),
    /// About this share of the logs, drawn with the run's seed.
    Fraction(f64),
}

/// Settings of [`train`].
#[derive(Clone, Debug, PartialEq)]
pub struct TrainOptions {
    /// `paper` or `motion`.
    pub kind: Kind,
    /// Per window, or constants fitted to the training logs and stored in the model.
    pub scaling: Scaling,
    /// Poses a window.
    pub window: usize,
    /// Both networks.
    pub network: PairConfig,
    /// Diffusion process.
    pub process: ProcessConfig,
    /// Optimisation.
    pub config: TrainConfig,
    /// Logs that the networks never see.
    pub hold_out: HoldOut,
    /// Where and on how many threads the networks run.
    pub computing: Computing,
    /// Where checkpoints are kept; a run goes on from one that is there.
    pub checkpoint: Option<PathBuf>,
}

impl TrainOptions {
    /// The usual settings for a representation: networks of 1.6 million parameters, 4000 steps of 64 windows, about
    /// 15 % of the logs held out, no checkpoint.
    #[must_use]
    pub fn of(kind: Kind) -> Self {
        let (scaling, schedule) = match kind {
            Kind::Paper => (Scaling::PerWindow, NoiseSchedule::COSINE),
            Kind::Motion => (Scaling::PerAxis, NoiseSchedule::LOG_SIGMA),
        };
        Self {
            kind,
            scaling,
            window: 128,
            network: PairConfig::new(16, &[1, 2, 4]),
            process: ProcessConfig {
                steps: 30,
                translation: schedule,
                rotation: schedule,
                ..ProcessConfig::default()
            },
            config: TrainConfig {
                steps: 4000,
                batch: 64,
                learning_rate: 1e-3,
                seed: 0,
                ..TrainConfig::default()
            },
            hold_out: HoldOut::Fraction(0.15),
            computing: Computing::default(),
            checkpoint: None,
        }
    }
}

/// The paper's windows.
impl Default for TrainOptions {
    fn default() -> Self {
        Self::of(Kind::Paper)
    }
}

/// A finished run.
pub struct Trained {
    /// The model, with averaged weights.
    pub model: Model,
    /// The training log.
    pub log: Vec<LogRow>,
    /// The step a checkpoint let it start from.
    pub resumed_at: Option<usize>,
}

/// Splits the logs into `(training, validation)`.
///
/// # Errors
/// Names that no log has, or nothing left to train on.
pub fn split(
    trajectories: &[Trajectory],
    hold_out: &HoldOut,
    seed: u64,
) -> Result<(Vec<Trajectory>, Vec<Trajectory>)> {
    let held: Vec<usize> = match hold_out {
        HoldOut::Names(names) => {
            for name in names {
                if !trajectories.iter().any(|t| t.name == *name) {
                    let known: Vec<&str> = trajectories.iter().map(|t| t.name.as_str()).collect();
                    return Err(Error::UnknownName {
                        what: "log",
                        found: name.clone(),
                        known: known.join(", "),
                    });
                }
            }
            (0..trajectories.len())
                .filter(|i| names.contains(&trajectories[*i].name))
                .collect()
        }
        HoldOut::Fraction(f) if *f == 0.0 => Vec::new(),
        HoldOut::Fraction(f) => split_by_log(trajectories, *f, seed)?.held_out,
    };
    let (mut training, mut validation) = (Vec::new(), Vec::new());
    for (i, t) in trajectories.iter().enumerate() {
        if held.contains(&i) {
            &mut validation
        } else {
            &mut training
        }
        .push(t.clone());
    }
    if training.is_empty() {
        return Err(Error::AllHeldOut {
            logs: trajectories.len(),
        });
    }
    Ok((training, validation))
}

/// Trains a model; `progress` hears of the start and of every step.
///
/// # Errors
/// Logs shorter than a window or of different frames, settings out of range, divergence, a
/// checkpoint of another run.
pub fn train(
    trajectories: &[Trajectory],
    options: &TrainOptions,
    progress: &mut dyn Progress,
) -> Result<Trained> {
    let (training, validation) = split(trajectories, &options.hold_out, options.config.seed)?;
    let first = training.first().ok_or(Error::NoLog {
        purpose: "train on",
    })?;
    let (rate, frame) = (first.rate.hertz, first.frame);
    for t in trajectories {
        // Increments of known axes are mapped to one frame; unknown ones must be the same for all.
        let unknown = t.frame == Frame::Sensor || frame == Frame::Sensor;
        if t.frame != frame && (options.kind == Kind::Paper || unknown) {
            return Err(Error::MixedFrames {
                log: t.name.clone(),
                found: t.frame,
                first: first.name.clone(),
                expected: frame,
            });
        }
        if options.kind == Kind::Motion && !same_rate(t.rate.hertz, rate) {
            return Err(Error::MixedRates {
                log: t.name.clone(),
                found: t.rate.hertz,
                first: first.name.clone(),
                expected: rate,
            });
        }
    }
    let poses = options.kind.poses(options.window);
    let train_windows = windows(&training, poses, 1);
    if train_windows.is_empty() {
        return Err(Error::NoWindow { poses });
    }
    let representation =
        Representation::fit(options.kind, options.scaling, &training, &train_windows)?;
    let train_source = LogWindows::new(&training, train_windows, representation, options.window);
    let validation_windows = windows(&validation, poses, 1);
    let validation_source = LogWindows::new(
        &validation,
        validation_windows,
        representation,
        options.window,
    );
    progress.training(train_source.len(), validation_source.len());

    let initial = options.config.initial(&options.network)?;
    let learners = options.computing.learners(initial, options.config.clip)?;
    let mut trainer = Trainer::new(
        options.config,
        options.process,
        options.network.clone(),
        data_identity(&training, &validation, representation, options.window),
        learners,
        &train_source,
        &validation_source,
    )?;
    let mut resumed_at = None;
    if let Some(path) = options.checkpoint.as_ref().filter(|p| p.exists()) {
        let bytes = std::fs::read(path).map_err(Error::io("read", path))?;
        trainer
            .resume(path, &bytes)
            .map_err(|reason| Error::Checkpoint { reason })?;
        resumed_at = Some(trainer.step_count());
    }
    let mut on_step = |row: &LogRow| {
        progress.step(row);
        match progress.stop() {
            true => Err(DiffusionError::Stopped),
            false => Ok(()),
        }
    };
    let mut unwritten = None;
    let ran = trainer.run(&mut on_step, &mut |t| {
        let Some(path) = &options.checkpoint else {
            return Ok(());
        };
        atomic::write(path, &t.checkpoint()?).map_err(|e| {
            unwritten = Some(e);
            DiffusionError::Stopped
        })
    });
    match ran {
        Err(DiffusionError::Stopped) => return Err(unwritten.unwrap_or(Error::Stopped)),
        other => other?,
    }

    let log = trainer.log().to_vec();
    let last = log
        .iter()
        .rev()
        .find(|r| r.translation_validation.is_some());
    let header = ModelHeader {
        format_version: VERSION,
        representation,
        window: options.window,
        rate,
        frame,
        process: options.process,
        training: TrainingRecord {
            config: options.config,
            logs: training.iter().map(LogRecord::from).collect(),
            validation: validation.iter().map(LogRecord::from).collect(),
            version: env!("CARGO_PKG_VERSION").to_string(),
            translation_validation: last.and_then(|r| r.translation_validation),
            rotation_validation: last.and_then(|r| r.rotation_validation),
        },
    };
    Ok(Trained {
        model: Model {
            header,
            parameters: trainer.averaged()?,
            joint: None,
        },
        log,
        resumed_at,
    })
}

/// Windows of some logs, represented when asked for.
pub struct LogWindows<'a> {
    trajectories: &'a [Trajectory],
    windows: Vec<Window>,
    representation: Representation,
    length: usize,
}

impl<'a> LogWindows<'a> {
    /// Windows over `trajectories`, each giving `length` elements.
    pub fn new(
        trajectories: &'a [Trajectory],
        windows: Vec<Window>,
        representation: Representation,
        length: usize,
    ) -> Self {
        Self {
            trajectories,
            windows,
            representation,
            length,
        }
    }
}

impl WindowSource for LogWindows<'_> {
    fn len(&self) -> usize {
        self.windows.len()
    }

    fn length(&self) -> usize {
        self.length
    }

    fn read(
        &self,
        index: usize,
        translation: &mut [f32],
        rotation: &mut [f32],
    ) -> Result<(), DiffusionError> {
        let window = &self.windows[index];
        let tensor = self
            .representation
            .represent_window(window, self.trajectories)
            .map_err(|e| DiffusionError::Window(e.to_string()))?;
        translation.copy_from_slice(&tensor.translation);
        rotation.copy_from_slice(&tensor.rotation);
        Ok(())
    }
}

/// Identifies the data of a run, so that a checkpoint is not continued on other data.
fn data_identity(
    training: &[Trajectory],
    validation: &[Trajectory],
    representation: Representation,
    window: usize,
) -> String {
    let mut hash = Sha256::new();
    for (part, logs) in [("training", training), ("validation", validation)] {
        hash.update(part);
        logs.iter().for_each(|t| hash.update(t.fingerprint()));
    }
    hash.update(format!("{representation:?} {window}"));
    hex(hash.finalize())
}
