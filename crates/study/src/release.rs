//! `cargo xtask train-release-model`: the weights that ship with the program.

use crate::data::DataRoot;
use crate::faults::protocol::{Role, role};
use crate::networks;
use crate::sets;
use anyhow::{Context, Result};
use clap::{Args, Parser, ValueEnum};
use dose3::atomic;
use dose3::backend::Backend;
use dose3::train::{HoldOut, TrainOptions, train};
use dose3_cli::plot;
use dose3_datasets::{Kind, Scaling, Trajectory, at_rate};
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
            Self::Paper => "crates/dose3/weights/kitti-paper.dose3",
            Self::Motion => "crates/dose3/weights/motion.dose3",
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

/// Noise schedule of the rotation branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RotationSchedule {
    /// As the translation branch, cosine
    Cosine,
    /// Linear 1e-4 to 0.02, as in the authors' code
    Linear,
}

/// Arguments of `train-release-model`.
#[derive(Clone, Debug, Args)]
pub struct ReleaseArgs {
    /// Train the networks of `benchmark --all` by name, or all of them, where they are not trained yet;
    /// their settings stand in crates/study/src/networks.rs
    #[arg(
        long,
        value_name = "NAME|all",
        value_delimiter = ',',
        conflicts_with_all = ["set", "rotation_schedule", "one_scale", "recipe", "out", "steps", "seed"]
    )]
    pub study: Vec<String>,
    /// Train on one data set: O (RobotCar), K (KITTI) or I (IROS20). Default: `paper` K, `motion` all
    #[arg(long, value_name = "LETTER")]
    pub set: Option<char>,
    /// Noise schedule of the rotations (default: that of the recipe)
    #[arg(long, value_enum)]
    pub rotation_schedule: Option<RotationSchedule>,
    /// One scale for all windows, the largest displacement of any, instead of one a window (`paper`)
    #[arg(long)]
    pub one_scale: bool,
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
    #[arg(long, value_name = "BACKEND", default_value_t)]
    pub backend: Backend,
    /// Threads (0: all cores); results do not depend on it
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
}

#[derive(clap::Parser)]
struct Line {
    #[command(flatten)]
    args: ReleaseArgs,
}

impl ReleaseArgs {
    /// The settings of the shipped model with another seed.
    pub fn shipped(seed: u64) -> Self {
        // No argument is required, so parsing none gives the defaults.
        let mut args = Line::parse_from(["defaults"]).args;
        args.seed = seed;
        args
    }

    /// The settings that `line` gives, as typed after `train-release-model`.
    ///
    /// # Errors
    /// A line that is none.
    pub fn of_line(line: &str) -> Result<Self> {
        let words = std::iter::once("train-release-model").chain(line.split_whitespace());
        Ok(Line::try_parse_from(words)?.args)
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

    /// Diffusion steps T.
    pub fn diffusion_steps(&self) -> usize {
        self.diffusion_steps
            .unwrap_or_else(|| self.recipe.diffusion_steps())
    }

    /// The settings of the run; `hold_out` names the validation logs.
    pub fn options(&self, hold_out: Vec<String>) -> TrainOptions {
        let (kind, scaling, schedule) = match self.recipe {
            Recipe::Paper if self.one_scale => {
                (Kind::Paper, Scaling::PerDataset, NoiseSchedule::COSINE)
            }
            Recipe::Paper => (Kind::Paper, Scaling::PerWindow, NoiseSchedule::COSINE),
            Recipe::Motion => (Kind::Motion, Scaling::PerAxis, NoiseSchedule::LOG_SIGMA),
        };
        TrainOptions {
            kind,
            scaling,
            window: self.window,
            network: PairConfig::new(self.width, &self.multipliers),
            process: ProcessConfig {
                steps: self.diffusion_steps(),
                translation: schedule,
                rotation: match self.rotation_schedule {
                    None => schedule,
                    Some(RotationSchedule::Cosine) => NoiseSchedule::COSINE,
                    Some(RotationSchedule::Linear) => NoiseSchedule::LINEAR,
                },
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

    /// The logs to train on, validation logs among them, and the names of those. One set: its test logs of
    /// the benchmark are the validation logs; several: by the roles of the fault benchmark.
    fn logs(&self) -> Result<(Vec<Trajectory>, Vec<String>)> {
        let root = DataRoot::find(self.data.as_deref())?;
        let of_recipe = (self.recipe == Recipe::Paper).then_some('K');
        let Some(letter) = self.set.or(of_recipe) else {
            return self.logs_by_role(&root);
        };
        let mut set = sets::real_set(&root, letter)?;
        set.choose_test_logs(&sets::kitti_held_out(&set.trajectories), &[]);
        let held_out = set.test_names();
        let logs = set.trajectories.iter().map(|log| self.at_rate(log));
        Ok((logs.collect::<Result<_>>()?, held_out))
    }

    fn logs_by_role(&self, root: &DataRoot) -> Result<(Vec<Trajectory>, Vec<String>)> {
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
                logs.push(self.at_rate(log)?);
            }
        }
        Ok((logs, held_out))
    }

    /// The log at the rate of the recipe; `paper` counts poses and leaves it as it is.
    fn at_rate(&self, log: &Trajectory) -> Result<Trajectory> {
        match self.recipe {
            Recipe::Paper => Ok(log.clone()),
            Recipe::Motion => Ok(at_rate(log, RATE)?),
        }
    }
}

/// Trains on real logs and writes model, log and plot.
///
/// # Errors
/// Without the data, or where training fails.
pub fn run(args: &ReleaseArgs) -> Result<()> {
    if !args.study.is_empty() {
        return networks::train(args);
    }
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
