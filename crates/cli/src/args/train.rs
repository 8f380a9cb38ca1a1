//! Arguments of `dose3 train`.

use super::{Computing, Reading};
use clap::{Args as ClapArgs, ValueEnum};
use dose3_datasets::Kind;
use std::path::PathBuf;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ScheduleName {
    Cosine,
    Linear,
    /// Ratios of noise to signal from 0.003 to 20, evenly spaced in their logarithm
    LogSigma,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RotationNoiseName {
    /// A Gaussian in the tangent space, as in the paper
    Tangent,
    /// The heat kernel on SO(3)
    IgSo3,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RotationProcessName {
    /// exactly invertible for every rotation and noise
    Group,
    /// invertible while the sum stays shorter than pi
    Tangent,
}

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    dose3 train --data recordings/ --out model.dose3\n  \
    dose3 train --data a/ b/ --representation motion --resample 10 --frame body-flu --out motion.dose3")]
pub struct Train {
    /// Files or folders with logs
    #[arg(long, required = true, num_args = 1.., value_name = "PATH")]
    pub data: Vec<PathBuf>,
    /// Model file to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Replace what lies there, whatever it is
    #[arg(long)]
    pub force: bool,
    /// How poses become numbers: `paper` (positions from the window's start, divided by their largest;
    /// rotations as given) or `motion` (body-frame increments: free of the world's frame, scale stored
    /// in the model)
    #[arg(long, alias = "protocol", value_name = "NAME", default_value = "paper")]
    pub representation: Kind,
    /// Poses a window
    #[arg(long, value_name = "N", default_value_t = 128)]
    pub window: usize,
    /// Logs held out for validation, by name, or `none` (default: about 15 % of them, by seed)
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub hold_out: Vec<String>,
    /// Resample faster logs to this rate first, hertz
    #[arg(long, value_name = "HZ")]
    pub resample: Option<f64>,
    /// Width of the first level of both networks
    #[arg(long, value_name = "N", default_value_t = 16)]
    pub width: usize,
    /// Width multipliers, one a level
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "1,2,4")]
    pub multipliers: Vec<usize>,
    /// Diffusion steps T
    #[arg(long, value_name = "T", default_value_t = 30)]
    pub diffusion_steps: usize,
    /// Noise schedule of the translations (default: cosine, log-sigma with --representation motion)
    #[arg(long, value_enum)]
    pub translation_schedule: Option<ScheduleName>,
    /// Noise schedule of the rotations (default: as above; the authors' code: linear)
    #[arg(long, value_enum)]
    pub rotation_schedule: Option<ScheduleName>,
    /// Noise of the rotations
    #[arg(long, value_enum, default_value = "tangent")]
    pub rotation_noise: RotationNoiseName,
    /// How rotations are noised: the equations' group product or Algorithm 1's tangent sum
    #[arg(long, value_enum, default_value = "group")]
    pub rotation_process: RotationProcessName,
    /// Optimiser steps
    #[arg(long, value_name = "N", default_value_t = 4000)]
    pub steps: usize,
    /// Windows a step
    #[arg(long, value_name = "N", default_value_t = 64)]
    pub batch: usize,
    /// Peak learning rate
    #[arg(long, value_name = "RATE", default_value_t = 1e-3)]
    pub learning_rate: f64,
    /// Seed of everything random
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Store weights as f16 (half the size)
    #[arg(long)]
    pub half: bool,
    /// Checkpoint file; a run goes on from it where it exists (default: OUT with .checkpoint)
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    #[command(flatten)]
    pub reading: Reading,
    #[command(flatten)]
    pub computing: Computing,
}
