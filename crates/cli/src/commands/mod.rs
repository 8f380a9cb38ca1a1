//! The subcommands: they read, call the library, and print.

mod demo;
mod eval;
mod fit;
pub mod inspect;
mod sample;
pub mod score;
mod shell;
mod train;
mod watch;

use crate::args::{self, Args, Command, FrameOf, Reading, StampName};
use crate::command_line;
use crate::explain::explain;
use crate::terminal::{count, say};
use anyhow::{Result, bail};
use dose3::logs::{ReadOptions, find_each};
use dose3::{Computing, Model, Trajectory};
use dose3_datasets::LoadOptions;
use std::path::{Path, PathBuf};

/// More threads than any machine that this runs on has cores; their stacks alone would fill memory.
const MOST_THREADS: usize = 256;

/// Runs a subcommand; answers the exit code.
pub fn run(args: Args) -> Result<u8> {
    let threads = args.command.threads();
    if threads > MOST_THREADS {
        bail!("--threads {threads}: expected at most {MOST_THREADS} (0: all cores)");
    }
    // Everything beside the engine shares rayon's pool: density fits, Adam, noising.
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()?;
    dispatch(args.command, command_line::own())
}

/// Runs a subcommand that was given as `line`.
fn dispatch(command: Command, line: String) -> Result<u8> {
    match command {
        Command::Demo(a) => demo::run(&a),
        Command::Train(a) => train::run(&a).map(|()| 0),
        Command::Fit(a) => fit::run(&a).map(|()| 0),
        Command::Score(mut a) => {
            a.command = line;
            score::run(&a)
        }
        Command::Eval(a) => eval::run(&a).map(|()| 0),
        Command::Inspect(a) => inspect::run(&a),
        Command::Sample(a) => sample::run(&a).map(|()| 0),
        Command::Watch(a) => watch::run(&a),
        Command::Completions(a) => shell::completions(&a).map(|()| 0),
        Command::Man(a) => shell::man(&a).map(|()| 0),
    }
}

fn computing(computing: &args::Computing) -> Computing {
    Computing {
        backend: computing.backend,
        threads: computing.threads,
    }
}

fn read_options(reading: &Reading) -> ReadOptions {
    let frame = reading.frame.iter().rev().find_map(|frame| match frame {
        FrameOf::Unknown(frame) => Some(*frame),
        FrameOf::Log(..) => None,
    });
    let frames = reading.frame.iter().filter_map(|frame| match frame {
        FrameOf::Log(log, frame) => Some((log.clone(), *frame)),
        FrameOf::Unknown(_) => None,
    });
    ReadOptions {
        load: LoadOptions {
            format: reading.format,
            times: reading.times.clone(),
            max_gap: reading.max_gap,
            stamp_unit: reading.stamp_unit,
            columns: reading.columns.clone(),
            log_column: reading.log_column.clone(),
            lost: reading.lost.clone(),
            strict: reading.strict,
            topics: reading.topic.clone(),
            rate: reading.rate,
            tf: reading.tf.clone(),
            record_time: reading.stamp == StampName::Record,
            ..LoadOptions::default()
        },
        frame,
        frames: frames.collect(),
        nominal_rate: reading.nominal_rate,
        unit: reading.unit,
    }
}

/// Reads the logs of a set: those that cannot be read are named and left out, or stop it where reading is strict.
fn read_set(paths: &[PathBuf], options: &ReadOptions) -> Result<Vec<Trajectory>> {
    let found = find_each(paths, options)?;
    say_skipped(&found.skipped);
    let (mut logs, mut bad) = (Vec::new(), 0);
    for (_, log) in found.logs {
        match log {
            Ok(log) => logs.push(log),
            Err(error) => {
                say(&format!("error: {}", explain(&error.into())));
                bad += 1;
            }
        }
    }
    if bad > 0 && (options.load.strict || logs.is_empty()) {
        bail!("{} cannot be read", count(bad, "log"));
    }
    if bad > 0 {
        say(&format!(
            "{} left out (--strict stops instead)",
            count(bad, "log")
        ));
    }
    Ok(logs)
}

/// Files that are no logs and are named.
const SKIPPED: usize = 8;

/// Names the first files of folders that are no logs.
fn say_skipped(skipped: &[(PathBuf, String)]) {
    for (path, reason) in skipped.iter().take(SKIPPED) {
        say(&format!("skipped {}: {reason}", path.display()));
    }
    if skipped.len() > SKIPPED {
        let more = count(skipped.len() - SKIPPED, "more file");
        say(&format!("skipped {more} that are no logs"));
    }
}

/// The built-in model of that name, else the model file.
fn model(name: &Path) -> Result<Model> {
    Ok(match name.to_str() {
        Some("motion") => dose3::built_in::motion()?,
        Some("paper") => dose3::built_in::paper()?,
        _ => Model::read(name)?,
    })
}
