//! The subcommands: they read, call the library, and print.

mod eval;
mod fit;
mod inspect;
mod sample;
mod score;
mod train;

use crate::args::{self, Args, Command, FrameOf, Reading, StampName};
use crate::explain::explain;
use anyhow::{Context, Result, bail};
use dose3::logs::{ReadOptions, find_each};
use dose3::progress::Progress;
use dose3::{Computing, Model, Trajectory};
use dose3_datasets::LoadOptions;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write;
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
    match args.command {
        Command::Train(a) => train::run(&a).map(|()| 0),
        Command::Fit(a) => fit::run(&a).map(|()| 0),
        Command::Score(a) => score::run(&a),
        Command::Eval(a) => eval::run(&a).map(|()| 0),
        Command::Inspect(a) => inspect::run(&a),
        Command::Sample(a) => sample::run(&a).map(|()| 0),
    }
}

/// A line for people, to standard error.
pub fn say(text: &str) {
    // Nobody is left to tell where standard error is closed.
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Results, to standard output. A closed pipe (`| head`) ends the program quietly.
fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => Ok(other?),
    }
}

/// A value as one indented JSON document.
fn print_json(value: &impl serde::Serialize) -> Result<()> {
    print(&format!("{}\n", serde_json::to_string_pretty(value)?))
}

/// A progress bar with ETA; nothing where standard error is no terminal.
fn progress(total: u64, what: &'static str) -> Result<ProgressBar> {
    let style = ProgressStyle::with_template(
        "{prefix} [{bar:30}] {pos}/{len} {elapsed} elapsed, {eta} left {msg}",
    )?
    .progress_chars("=> ");
    Ok(ProgressBar::new(total).with_style(style).with_prefix(what))
}

/// Windows of the logs at hand, or whole logs, as a bar.
struct Bar(ProgressBar);

impl Progress for Bar {
    fn windows(&mut self, done: usize, total: usize) {
        self.0.set_length(total as u64);
        self.0.set_position(done as u64);
    }

    fn log(&mut self, name: &str) {
        self.0.set_message(name.to_owned());
        self.0.inc(1);
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

/// Names the files of folders that are no logs.
fn say_skipped(skipped: &[(PathBuf, String)]) {
    for (path, reason) in skipped {
        say(&format!("skipped {}: {reason}", path.display()));
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

/// Refuses, before hours of work, an output path that cannot be written, and one under which something lies that is
/// no model or detector: a pose log, a device.
fn check_output(path: &Path) -> Result<()> {
    let shown = path.display();
    if path.is_dir() {
        bail!("{shown} is a folder, expected the name of a file to write");
    }
    if path.symlink_metadata().is_ok_and(|found| !found.is_file()) {
        bail!("{shown} is a link or a device, expected the name of a file to write");
    }
    if path.is_file() && !is_safetensors(path) {
        bail!(
            "{shown} is there and is no model or detector; hint: it is not replaced, name another file"
        );
    }
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    check_folder(folder)
}

/// Whether a file is empty, or begins as a safetensors file does: the length of its header, then JSON.
fn is_safetensors(path: &Path) -> bool {
    let mut start = [0; 9];
    let read = std::fs::File::open(path).and_then(|mut file| {
        let empty = file.metadata()?.len() == 0;
        if !empty {
            std::io::Read::read_exact(&mut file, &mut start)?;
        }
        Ok(empty)
    });
    read.is_ok_and(|empty| empty || start[8] == b'{')
}

/// Refuses a folder that cannot be made or written to.
fn check_folder(folder: &Path) -> Result<()> {
    let writable =
        std::fs::create_dir_all(folder).and_then(|()| tempfile::tempfile_in(folder).map(|_| ()));
    writable.with_context(|| format!("cannot write into {}", folder.display()))
}

/// `1 log`, `2 logs`.
fn count(n: usize, what: &str) -> String {
    if n == 1 {
        format!("1 {what}")
    } else {
        format!("{n} {what}s")
    }
}
