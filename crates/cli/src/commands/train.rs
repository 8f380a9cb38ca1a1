//! `dose3 train`

use super::read_options;
use crate::args::{RotationNoiseName, RotationProcessName, ScheduleName, Train};
use crate::output_file::{DETECTOR, Kind, OutputFile};
use crate::terminal::{count, progress, say};
use anyhow::{Context, Result, bail};
use dose3::logs;
use dose3::progress::Progress;
use dose3::train::{HoldOut, TrainOptions, train};
use dose3_cli::plot;
use dose3_datasets::{resample, same_rate};
use dose3_diffusion::trainer::{LogRow, TrainConfig, to_csv};
use dose3_diffusion::{NoiseSchedule, ProcessConfig, RotationNoise, RotationProcess};
use dose3_model::{PairConfig, Precision};
use indicatif::ProgressBar;
use std::io::IsTerminal;

pub fn run(args: &Train) -> Result<()> {
    let files = Files::new(args)?;
    if checkpoint(args) == args.out {
        bail!(
            "--out and the checkpoint are the same file: {}",
            args.out.display()
        );
    }
    let mut trajectories = logs::read(&args.data, &read_options(&args.reading))?;
    if let Some(rate) = args.resample {
        for t in &mut trajectories {
            if t.rate.hertz > rate && !same_rate(t.rate.hertz, rate) {
                *t = resample(t, rate)
                    .with_context(|| format!("log {} cannot be resampled to {rate} Hz", t.name))?;
            }
        }
    }
    let poses: usize = trajectories.iter().map(|t| t.poses.len()).sum();
    say(&format!(
        "read {}, {poses} poses",
        count(trajectories.len(), "log")
    ));
    let options = options(args);
    let mut heard = Heard {
        args,
        parameters: options.network.parameter_count(),
        bar: progress(args.steps as u64, "training", false)?,
    };
    let trained = train(&trajectories, &options, &mut heard)?;
    heard.bar.finish_and_clear();
    finish(args, &files, &trained)
}

/// What a training writes.
struct Files {
    model: OutputFile,
    losses: OutputFile,
    plot: OutputFile,
}

/// Losses step by step.
const LOSSES: Kind = Kind {
    name: "log of a training",
    begins: |start| start.starts_with(b"step,"),
};

/// Plots are SVG files.
const PLOT: Kind = Kind {
    name: "plot",
    begins: |start| start.starts_with(b"<svg"),
};

impl Files {
    fn new(args: &Train) -> Result<Self> {
        let beside = |end, kind| OutputFile::new(&args.out.with_extension(end), kind, args.force);
        Ok(Self {
            model: OutputFile::new(&args.out, DETECTOR, args.force)?,
            losses: beside("log.csv", LOSSES)?,
            plot: beside("loss.svg", PLOT)?,
        })
    }
}

/// Training as it goes: a bar on a terminal, else a line now and then.
struct Heard<'a> {
    args: &'a Train,
    parameters: usize,
    bar: ProgressBar,
}

impl Progress for Heard<'_> {
    fn training(&mut self, training: usize, validation: usize) {
        say(&format!(
            "{training} training windows, {validation} validation windows of {} poses; {} parameters \
             on {}",
            self.args.window, self.parameters, self.args.computing.backend
        ));
    }

    fn step(&mut self, row: &LogRow) {
        self.bar.set_position(row.step as u64);
        let text = format!(
            "translation {:.4} rotation {:.4}",
            row.translation_eps, row.rotation_eps
        );
        if !std::io::stderr().is_terminal() && row.step.is_multiple_of(100) {
            say(&format!("step {} of {}: {text}", row.step, self.args.steps));
        }
        self.bar.set_message(text);
    }
}

fn finish(args: &Train, files: &Files, trained: &dose3::train::Trained) -> Result<()> {
    if let Some(step) = trained.resumed_at {
        say(&format!("went on from the checkpoint at step {step}"));
    }
    let precision = if args.half {
        Precision::F16
    } else {
        Precision::F32
    };
    files.model.save(&trained.model.to_bytes(precision, &[])?)?;
    files.losses.save(to_csv(&trained.log).as_bytes())?;
    files.plot.save(plot::losses(&trained.log)?.as_bytes())?;
    let training = &trained.model.header.training;
    if let (Some(t), Some(r)) = (
        training.translation_validation,
        training.rotation_validation,
    ) {
        say(&format!(
            "validation: translation {t:.4} (mean L1), rotation {r:.4} (mean squared angle, rad²)"
        ));
    }
    say(&format!(
        "wrote {}, {} and {}",
        files.model.path().display(),
        files.losses.path().display(),
        files.plot.path().display()
    ));
    Ok(())
}

fn options(args: &Train) -> TrainOptions {
    let usual = TrainOptions::of(args.representation);
    let hold_out = match args.hold_out.as_slice() {
        [] => HoldOut::Fraction(0.15),
        [none] if none == "none" => HoldOut::Fraction(0.0),
        names => HoldOut::Names(names.to_vec()),
    };
    TrainOptions {
        window: args.window,
        network: PairConfig::new(args.width, &args.multipliers),
        process: ProcessConfig {
            steps: args.diffusion_steps,
            translation: args
                .translation_schedule
                .map_or(usual.process.translation, schedule),
            rotation: args
                .rotation_schedule
                .map_or(usual.process.rotation, schedule),
            rotation_process: match args.rotation_process {
                RotationProcessName::Group => RotationProcess::Group,
                RotationProcessName::Tangent => RotationProcess::Tangent,
            },
            rotation_noise: match args.rotation_noise {
                RotationNoiseName::Tangent => RotationNoise::Tangent,
                RotationNoiseName::IgSo3 => RotationNoise::IgSo3,
            },
        },
        config: TrainConfig {
            steps: args.steps,
            batch: args.batch,
            learning_rate: args.learning_rate,
            seed: args.seed,
            ..usual.config
        },
        hold_out,
        computing: super::computing(&args.computing),
        checkpoint: Some(checkpoint(args)),
        ..usual
    }
}

fn schedule(name: ScheduleName) -> NoiseSchedule {
    match name {
        ScheduleName::Cosine => NoiseSchedule::COSINE,
        ScheduleName::Linear => NoiseSchedule::LINEAR,
        ScheduleName::LogSigma => NoiseSchedule::LOG_SIGMA,
    }
}

fn checkpoint(args: &Train) -> std::path::PathBuf {
    args.checkpoint
        .clone()
        .unwrap_or_else(|| args.out.with_extension("checkpoint"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Args, Command};
    use clap::Parser;
    use dose3_datasets::Kind;

    #[test]
    fn the_defaults_of_the_program_are_those_of_the_library() {
        for kind in [Kind::Paper, Kind::Motion] {
            let line = ["dose3", "train", "--data", "logs", "--out", "m.dose3"];
            let line = line.into_iter().chain(["--representation", kind.name()]);
            let Command::Train(args) = Args::parse_from(line).command else {
                panic!("no training");
            };
            let library = TrainOptions {
                checkpoint: Some("m.checkpoint".into()),
                ..TrainOptions::of(kind)
            };
            assert_eq!(options(&args), library);
        }
    }
}
