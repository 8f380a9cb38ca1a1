//! `cargo xtask train-release-model`: the weights that ship with the program, and those of the study.

use crate::use_threads;
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use dose3::atomic;
use dose3::backend::{Backend, Computing};
use dose3::progress::Progress;
use dose3::train::{HoldOut, train};
use dose3_cli::plot;
use dose3_datasets::{Kind, Scaling};
use dose3_diffusion::NoiseSchedule;
use dose3_diffusion::trainer::{LogRow, to_csv};
use dose3_model::{PairConfig, Precision};
use dose3_study::data::DataRoot;
use dose3_study::networks::{self, NETWORKS, Network};
use dose3_study::say;
use dose3_study::training::{Training, shipped_file, shipped_shape};
use std::path::PathBuf;
use std::time::Instant;

/// Noise schedule of the rotation branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RotationSchedule {
    /// As the translation branch of `paper`, cosine
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
        conflicts_with_all = ["set", "rotation_schedule", "one_scale", "representation", "out", "steps", "seed"]
    )]
    pub study: Vec<String>,
    /// Train on one data set: O (RobotCar), K (KITTI) or I (IROS20). Default: `paper` K, `motion` all
    #[arg(long, value_name = "LETTER")]
    pub set: Option<char>,
    /// Noise schedule of the rotations (default: that of the representation's model)
    #[arg(long, value_enum)]
    pub rotation_schedule: Option<RotationSchedule>,
    /// One scale for all windows, the largest displacement of any, instead of one a window (`paper`)
    #[arg(long)]
    pub one_scale: bool,
    /// Which model: paper (the paper's windows and schedules, KITTI alone) or motion (body-frame
    /// motion at 10 Hz, noise levels even in log sigma, logs of KITTI, RobotCar and IROS20)
    #[arg(long, alias = "recipe", default_value_t = Kind::Paper)]
    pub representation: Kind,
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

/// A training and where its results go.
struct Task {
    training: Training,
    shape: PairConfig,
    out: PathBuf,
    logs: PathBuf,
}

impl ReleaseArgs {
    fn task(&self) -> Task {
        let shipped = match self.representation {
            Kind::Paper => Training::PAPER,
            Kind::Motion => Training::MOTION,
        };
        let training = Training {
            set: self.set.or(shipped.set),
            scaling: match self.one_scale && self.representation == Kind::Paper {
                true => Scaling::PerDataset,
                false => shipped.scaling,
            },
            rotation: match self.rotation_schedule {
                None => shipped.rotation,
                Some(RotationSchedule::Cosine) => NoiseSchedule::COSINE,
                Some(RotationSchedule::Linear) => NoiseSchedule::LINEAR,
            },
            steps: self.steps.unwrap_or(shipped.steps),
            diffusion_steps: self.diffusion_steps.unwrap_or(shipped.diffusion_steps),
            batch: self.batch,
            window: self.window,
            seed: self.seed,
            ..shipped
        };
        Task {
            training,
            shape: PairConfig::new(self.width, &self.multipliers),
            out: self
                .out
                .clone()
                .unwrap_or_else(|| shipped_file(self.representation)),
            logs: self.logs.clone(),
        }
    }
}

/// Trains on real logs and writes model, log and plot.
///
/// # Errors
/// Without the data, or where training fails.
pub fn run(args: &ReleaseArgs) -> Result<()> {
    use_threads(args.threads)?;
    if args.study.is_empty() {
        return trained(&args.task(), args);
    }
    let networks: Vec<Network> = match args.study.iter().any(|name| name == "all") {
        true if args.study.len() > 1 => bail!("--study takes `all` or names"),
        true => NETWORKS.to_vec(),
        false => {
            let named = args.study.iter().map(|name| Network::named(name));
            named.collect::<Result<_>>()?
        }
    };
    for network in networks {
        let out = network.file();
        if out.exists() {
            say!("{} is trained already", out.display());
            continue;
        }
        say!("{}: {:?}", network.name, network.training);
        let task = Task {
            training: network.training,
            shape: shipped_shape(),
            out,
            logs: networks::folder().join("training"),
        };
        trained(&task, args)?;
    }
    Ok(())
}

/// Prints how far training is.
struct Heard {
    steps: usize,
    start: Instant,
}

impl Progress for Heard {
    fn training(&mut self, training: usize, validation: usize) {
        say!("{training} training windows, {validation} validation windows");
    }

    fn step(&mut self, row: &LogRow) {
        if row.step.is_multiple_of(50) || row.step == self.steps {
            say!(
                "step {} of {}: translation {:.4} rotation {:.4} ({:.1} s)",
                row.step,
                self.steps,
                row.translation_eps,
                row.rotation_eps,
                self.start.elapsed().as_secs_f64()
            );
        }
    }
}

fn trained(task: &Task, args: &ReleaseArgs) -> Result<()> {
    let root = DataRoot::find(args.data.as_deref())?;
    let (logs, hold_out) = task.training.logs(&root)?;
    let out = &task.out;
    let mut heard = Heard {
        steps: task.training.steps,
        start: Instant::now(),
    };
    let hold_out = HoldOut::Names(hold_out);
    let mut options = task.training.options(task.shape.clone(), hold_out);
    options.computing = Computing {
        backend: args.backend,
        threads: args.threads,
    };
    options.checkpoint = Some(out.with_extension("checkpoint"));
    let trained = train(&logs, &options, &mut heard)?;
    let precision = match args.full_precision {
        true => Precision::F32,
        false => Precision::F16,
    };
    trained.model.write(out, precision)?;
    let name = out.file_stem().context("--out names no file")?;
    let name = name.to_string_lossy();
    let log = to_csv(&trained.log);
    atomic::write(&task.logs.join(format!("{name}.log.csv")), log.as_bytes())?;
    let svg = plot::losses(&trained.log)?;
    atomic::write(&task.logs.join(format!("{name}.loss.svg")), svg.as_bytes())?;
    let record = &trained.model.header.training;
    say!(
        "wrote {}; validation: translation {:?}, rotation {:?}; {:.0} s",
        out.display(),
        record.translation_validation,
        record.rotation_validation,
        heard.start.elapsed().as_secs_f64()
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: ReleaseArgs,
    }

    #[test]
    fn without_arguments_the_shipped_models_are_trained() {
        let task = |line: &[&str]| Line::parse_from([&["train"], line].concat()).args.task();
        let paper = task(&[]);
        assert_eq!(paper.training, Training::PAPER);
        assert_eq!(paper.shape, shipped_shape());
        assert_eq!(task(&["--recipe", "motion"]).training, Training::MOTION);
        let of_set = task(&[
            "--representation",
            "motion",
            "--steps",
            "1500",
            "--set",
            "K",
        ]);
        assert_eq!(of_set.training, networks::KITTI_MOTION.training);
        let scaled = task(&["--steps", "1500", "--one-scale"]);
        assert_eq!(scaled.training, networks::ONE_SCALE.training);
    }
}
