//! `cargo xtask train-release-model`: the weights that ship with the program.

use crate::data::DataRoot;
use anyhow::{Context, Result};
use clap::Args;
use dose3::backend::Backend;
use dose3::train::{HoldOut, TrainOptions, train};
use dose3::{atomic, plot};
use dose3_datasets::{Kind, LoadOptions, Scaling, load_all};
use dose3_diffusion::ProcessConfig;
use dose3_diffusion::trainer::{TrainConfig, to_csv};
use dose3_model::{PairConfig, Precision};
use std::path::PathBuf;
use std::time::Instant;

/// KITTI logs that the shipped networks never see: they are the in-distribution test logs.
pub const HELD_OUT: [&str; 3] = ["07", "09", "10"];

/// Arguments of `train-release-model`.
#[derive(Debug, Args)]
pub struct ReleaseArgs {
    /// Folder with the data sets (default: $DOSE3_DATA, else data/)
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Model file to write; the log and the loss plot go to docs/training/ under its name
    #[arg(
        long,
        value_name = "FILE",
        default_value = "crates/cli/weights/kitti-paper.dose3"
    )]
    pub out: PathBuf,
    /// Optimiser steps
    #[arg(long, default_value_t = 4000)]
    pub steps: usize,
    /// Windows a step
    #[arg(long, default_value_t = 64)]
    pub batch: usize,
    /// Width of the first level
    #[arg(long, default_value_t = 16)]
    pub width: usize,
    /// Width multipliers
    #[arg(long, value_delimiter = ',', default_value = "1,2,4")]
    pub multipliers: Vec<usize>,
    /// Diffusion steps T
    #[arg(long, default_value_t = 30)]
    pub diffusion_steps: usize,
    /// Poses a window
    #[arg(long, default_value_t = 128)]
    pub window: usize,
    /// Seed
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Keep weights as f32 (the shipped file is f16)
    #[arg(long)]
    pub full_precision: bool,
    /// Folder of log and loss plot
    #[arg(long, default_value = "docs/training")]
    pub logs: PathBuf,
    /// Where to train
    #[arg(long, value_enum, default_value_t)]
    pub backend: Backend,
    /// Threads (0: all cores); results do not depend on it
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
}

impl ReleaseArgs {
    /// The settings of the shipped model with another seed.
    pub fn shipped(seed: u64) -> Self {
        #[derive(clap::Parser)]
        struct Defaults {
            #[command(flatten)]
            args: ReleaseArgs,
        }
        use clap::Parser;
        // No argument is required, so parsing none gives the defaults.
        let mut args = Defaults::parse_from(["defaults"]).args;
        args.seed = seed;
        args
    }

    /// The settings of the run.
    pub fn options(&self) -> TrainOptions {
        TrainOptions {
            kind: Kind::Paper,
            scaling: Scaling::PerWindow,
            window: self.window,
            network: PairConfig::new(self.width, &self.multipliers),
            process: ProcessConfig {
                steps: self.diffusion_steps,
                ..ProcessConfig::default()
            },
            config: TrainConfig {
                steps: self.steps,
                batch: self.batch,
                seed: self.seed,
                ..TrainConfig::default()
            },
            hold_out: HoldOut::Names(HELD_OUT.map(String::from).to_vec()),
            backend: self.backend,
            threads: self.threads,
            checkpoint: Some(self.out.with_extension("checkpoint")),
        }
    }
}

/// Trains on KITTI and writes model, log and plot.
///
/// # Errors
/// Without KITTI, or where training fails.
pub fn run(args: &ReleaseArgs) -> Result<()> {
    let kitti = DataRoot::find(args.data.as_deref())?.kitti()?;
    let trajectories = load_all(&[kitti], &LoadOptions::default())?;
    let start = Instant::now();
    let steps = args.steps;
    let trained = train(
        &trajectories,
        &args.options(),
        &mut |training, validation| {
            println!("{training} training windows, {validation} validation windows");
        },
        &mut |row| {
            if row.step.is_multiple_of(50) || row.step == steps {
                println!(
                    "step {} of {steps}: translation {:.4} rotation {:.4} ({:.1} s)",
                    row.step,
                    row.translation_eps,
                    row.rotation_eps,
                    start.elapsed().as_secs_f64()
                );
            }
        },
    )?;
    let precision = if args.full_precision {
        Precision::F32
    } else {
        Precision::F16
    };
    trained.model.write(&args.out, precision)?;
    let name = args
        .out
        .file_stem()
        .context("--out names no file")?
        .to_string_lossy();
    atomic::write(
        &args.logs.join(format!("{name}.log.csv")),
        to_csv(&trained.log).as_bytes(),
    )?;
    let svg = plot::losses(&trained.log)?;
    atomic::write(&args.logs.join(format!("{name}.loss.svg")), svg.as_bytes())?;
    let record = &trained.model.header.training;
    println!(
        "wrote {}; validation: translation {:?}, rotation {:?}; {:.0} s",
        args.out.display(),
        record.translation_validation,
        record.rotation_validation,
        start.elapsed().as_secs_f64()
    );
    Ok(())
}
