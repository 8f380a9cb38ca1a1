//! `cargo xtask train-release-model`: the weights that ship with the program.

use crate::benchmark::faults::protocol::{Role, role};
use crate::benchmark::sets;
use crate::data::DataRoot;
use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use dose3::backend::Backend;
use dose3::train::{HoldOut, TrainOptions, train};
use dose3::{atomic, plot};
use dose3_datasets::{Kind, LoadOptions, Scaling, Trajectory, load_all, resample};
use dose3_diffusion::trainer::{TrainConfig, to_csv};
use dose3_diffusion::{NoiseSchedule, ProcessConfig};
use dose3_model::{PairConfig, Precision};
use std::path::PathBuf;
use std::time::Instant;

/// Optimiser steps of the shipped models. Three times as many lower the validation loss and not the
/// AUROC (docs/RESULTS.md).
const STEPS: usize = 4000;
/// Rate of the `motion` model, hertz: that of KITTI, the slowest of the data sets.
pub const RATE: f64 = 10.0;

/// Which of the shipped models.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Recipe {
    /// The paper's windows and schedules, trained on KITTI alone
    #[default]
    Paper,
    /// Body-frame motion at 10 Hz with noise levels even in log sigma, trained on logs of KITTI,
    /// RobotCar and IROS20
    Motion,
}

impl Recipe {
    fn file(self) -> &'static str {
        match self {
            Self::Paper => "crates/cli/weights/kitti-paper.dose3",
            Self::Motion => "crates/cli/weights/motion.dose3",
        }
    }

    fn diffusion_steps(self) -> usize {
        match self {
            Self::Paper => 30,
            Self::Motion => 24,
        }
    }
}

/// KITTI logs that the shipped networks never see: they are the in-distribution test logs.
pub const HELD_OUT: [&str; 3] = ["07", "09", "10"];

/// Arguments of `train-release-model`.
#[derive(Debug, Args)]
pub struct ReleaseArgs {
    /// Which model
    #[arg(long, value_enum, default_value_t)]
    pub recipe: Recipe,
    /// Folder with the data sets (default: $DOSE3_DATA, else data/)
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Model file to write (default: the shipped one); log and loss plot go to docs/training/ under
    /// its name
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Optimiser steps (default: those of the shipped model)
    #[arg(long)]
    pub steps: Option<usize>,
    /// Windows a step
    #[arg(long, default_value_t = 64)]
    pub batch: usize,
    /// Width of the first level
    #[arg(long, default_value_t = 16)]
    pub width: usize,
    /// Width multipliers
    #[arg(long, value_delimiter = ',', default_value = "1,2,4")]
    pub multipliers: Vec<usize>,
    /// Diffusion steps T (default: paper 30, motion 24)
    #[arg(long)]
    pub diffusion_steps: Option<usize>,
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

    /// The model file to write.
    pub fn out(&self) -> PathBuf {
        self.out
            .clone()
            .unwrap_or_else(|| self.recipe.file().into())
    }

    /// Optimiser steps.
    pub fn steps(&self) -> usize {
        self.steps.unwrap_or(STEPS)
    }

    /// The settings of the run; `hold_out` names the validation logs.
    pub fn options(&self, hold_out: Vec<String>) -> TrainOptions {
        let (kind, scaling, schedule) = match self.recipe {
            Recipe::Paper => (Kind::Paper, Scaling::PerWindow, NoiseSchedule::COSINE),
            Recipe::Motion => (Kind::Motion, Scaling::PerAxis, NoiseSchedule::LOG_SIGMA),
        };
        let diffusion_steps = self.recipe.diffusion_steps();
        TrainOptions {
            kind,
            scaling,
            window: self.window,
            network: PairConfig::new(self.width, &self.multipliers),
            process: ProcessConfig {
                steps: self.diffusion_steps.unwrap_or(diffusion_steps),
                translation: schedule,
                rotation: schedule,
                ..ProcessConfig::default()
            },
            config: TrainConfig {
                steps: self.steps(),
                batch: self.batch,
                seed: self.seed,
                ..TrainConfig::default()
            },
            hold_out: HoldOut::Names(hold_out),
            backend: self.backend,
            threads: self.threads,
            checkpoint: Some(self.out().with_extension("checkpoint")),
        }
    }

    /// The logs to train on, validation logs among them, and the names of those.
    fn logs(&self) -> Result<(Vec<Trajectory>, Vec<String>)> {
        let root = DataRoot::find(self.data.as_deref())?;
        if self.recipe == Recipe::Paper {
            let logs = load_all(&[root.kitti()?], &LoadOptions::default())?;
            return Ok((logs, HELD_OUT.map(String::from).to_vec()));
        }
        let (mut logs, mut held_out) = (Vec::new(), Vec::new());
        let sets = sets::real(&root)?;
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
                logs.push(match log.rate.hertz > RATE * 1.05 {
                    true => resample(log, RATE)?,
                    false => log.clone(),
                });
            }
        }
        Ok((logs, held_out))
    }
}

/// Trains on real logs and writes model, log and plot.
///
/// # Errors
/// Without the data, or where training fails.
pub fn run(args: &ReleaseArgs) -> Result<()> {
    let (trajectories, hold_out) = args.logs()?;
    let start = Instant::now();
    let (steps, out) = (args.steps(), args.out());
    let trained = train(
        &trajectories,
        &args.options(hold_out),
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
    trained.model.write(&out, precision)?;
    let name = out
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
        out.display(),
        record.translation_validation,
        record.rotation_validation,
        start.elapsed().as_secs_f64()
    );
    Ok(())
}
