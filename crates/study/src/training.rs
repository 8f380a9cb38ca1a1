//! How the networks of the study and of the program are trained, as values.

use crate::data::DataRoot;
use crate::roles::{Role, role};
use crate::sets;
use anyhow::{Context, Result};
use dose3::backend::Computing;
use dose3::train::{HoldOut, TrainOptions};
use dose3_datasets::{Kind, Scaling, Trajectory, at_rate};
use dose3_diffusion::trainer::TrainConfig;
use dose3_diffusion::{NoiseSchedule, ProcessConfig};
use dose3_model::PairConfig;
use serde::Serialize;
use std::path::PathBuf;

/// Rate of `motion` networks, hertz: that of KITTI, the slowest of the data sets.
pub const RATE: f64 = 10.0;

/// What a network is trained on, and how long.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Training {
    /// How poses become numbers.
    pub representation: Kind,
    /// How they are scaled.
    pub scaling: Scaling,
    /// Letter of the set; none for those logs of all three that train networks ([`crate::roles`]).
    pub set: Option<char>,
    /// Optimiser steps.
    pub steps: usize,
    /// Windows a step.
    pub batch: usize,
    /// Elements of a window.
    pub window: usize,
    /// Diffusion steps T.
    pub diffusion_steps: usize,
    /// Noise schedule of the translations.
    pub translation: NoiseSchedule,
    /// Noise schedule of the rotations.
    pub rotation: NoiseSchedule,
    /// Seed of weights, batches and noise.
    pub seed: u64,
}

impl Training {
    /// The shipped model of `paper` windows: the paper's windows and schedules, KITTI alone. Three times as many
    /// steps lower the validation loss and not the AUROC (docs/RESULTS.md).
    pub const PAPER: Self = Self {
        representation: Kind::Paper,
        scaling: Scaling::PerWindow,
        set: Some('K'),
        steps: 4000,
        batch: 64,
        window: 128,
        diffusion_steps: 30,
        translation: NoiseSchedule::COSINE,
        rotation: NoiseSchedule::COSINE,
        seed: 0,
    };
    /// The shipped model of body-frame motion: 10 Hz, noise levels even in log sigma, logs of three data sets.
    pub const MOTION: Self = Self {
        representation: Kind::Motion,
        scaling: Scaling::PerAxis,
        set: None,
        diffusion_steps: 24,
        translation: NoiseSchedule::LOG_SIGMA,
        rotation: NoiseSchedule::LOG_SIGMA,
        ..Self::PAPER
    };

    /// The diffusion process.
    pub fn process(&self) -> ProcessConfig {
        ProcessConfig {
            steps: self.diffusion_steps,
            translation: self.translation,
            rotation: self.rotation,
            ..ProcessConfig::default()
        }
    }

    /// The settings of a run that trains networks of this shape.
    pub fn options(&self, network: PairConfig, hold_out: HoldOut) -> TrainOptions {
        TrainOptions {
            kind: self.representation,
            scaling: self.scaling,
            window: self.window,
            network,
            process: self.process(),
            config: TrainConfig {
                steps: self.steps,
                batch: self.batch,
                seed: self.seed,
                ..TrainConfig::default()
            },
            hold_out,
            computing: Computing::default(),
            checkpoint: None,
        }
    }

    /// The logs to train on, validation logs among them, and the names of those. One set: its held-out test logs
    /// are the validation logs; several: by their roles.
    ///
    /// # Errors
    /// Data that is missing or cannot be read.
    pub fn logs(&self, root: &DataRoot) -> Result<(Vec<Trajectory>, Vec<String>)> {
        let (logs, held_out) = match self.set {
            Some(letter) => of_set(root, letter)?,
            None => by_role(root)?,
        };
        let logs = logs.into_iter().map(|log| match self.representation {
            // Such windows count poses.
            Kind::Paper => Ok(log),
            Kind::Motion => at_rate(&log, RATE),
        });
        Ok((logs.collect::<Result<_, _>>()?, held_out))
    }
}

/// The shape of all networks that ship.
pub fn shipped_shape() -> PairConfig {
    PairConfig::new(16, &[1, 2, 4])
}

/// The file of the program's built-in model of this representation, seen from the root of the workspace.
pub fn shipped_file(representation: Kind) -> PathBuf {
    match representation {
        Kind::Paper => "crates/dose3/weights/kitti-paper.dose3",
        Kind::Motion => "crates/dose3/weights/motion.dose3",
    }
    .into()
}

fn of_set(root: &DataRoot, letter: char) -> Result<(Vec<Trajectory>, Vec<String>)> {
    let mut set = sets::real_set(root, letter)?;
    set.choose_test_logs(&sets::kitti_held_out(&set.trajectories), &[]);
    let held_out = set.test_names();
    Ok((set.trajectories, held_out))
}

fn by_role(root: &DataRoot) -> Result<(Vec<Trajectory>, Vec<String>)> {
    let (mut logs, mut held_out) = (Vec::new(), Vec::new());
    let sets = sets::real(root)?;
    for letter in ['K', 'O', 'I'] {
        let set = sets
            .iter()
            .find(|s| s.letter == letter)
            .with_context(|| format!("data set {letter} is missing in {}", root.source))?;
        for (i, log) in set.trajectories.iter().enumerate() {
            match role(letter, i, &log.name) {
                Role::Network => {}
                Role::Validation => held_out.push(log.name.clone()),
                Role::Density | Role::Test => continue,
            }
            logs.push(log.clone());
        }
    }
    Ok((logs, held_out))
}
