//! `cargo xtask bench`: forward pass, training step and a whole `score`, by the engine, by
//! burn-flex, and by PyTorch, all taking turns in one run. Times are the shortest of all turns: on a
//! shared machine that is what repeats.

mod network;
mod pytorch;
mod report;
mod score;
mod sgemm;
mod stream;
mod training;

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use dose3::atomic;
use dose3::backend::Backend;
use dose3_study::provenance::{Start, render_into};
use dose3_study::say;
use network::Pair;
use pytorch::{Mode, Pytorch};
use report::{NetworkRow, Report, ScoreRow};
use score::{LogFile, Spending};
use std::path::PathBuf;
use std::time::Instant;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Forward pass and training step.
    Networks,
    /// Training steps as `train` makes them, on the backends of --backends.
    Training,
    /// A whole `score`.
    Score,
    /// Streams of poses; writes stream.json and stream.md.
    Stream,
}

/// Arguments of `bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// What to measure
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "networks,score"
    )]
    pub parts: Vec<Part>,
    /// Widths of the first level of the networks
    #[arg(
        long,
        value_name = "N",
        value_delimiter = ',',
        default_value = "16,32,64"
    )]
    pub widths: Vec<usize>,
    /// Width multipliers, one a level
    #[arg(
        long,
        value_name = "N",
        value_delimiter = ',',
        default_value = "1,2,4,8"
    )]
    pub multipliers: Vec<usize>,
    /// Windows of a batch
    #[arg(long, value_name = "N", default_value_t = 32)]
    pub batch: usize,
    /// Poses of a window
    #[arg(long, value_name = "N", default_value_t = 128)]
    pub length: usize,
    /// Numbers of threads
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "1,2")]
    pub threads: Vec<usize>,
    /// Turns of every program
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub rounds: usize,
    /// Length of a turn, seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    pub seconds: f64,
    /// Also run PyTorch, eager and compiled
    #[arg(long)]
    pub with_pytorch: bool,
    /// Python with PyTorch
    #[arg(long, value_name = "PROGRAM", default_value = "python3")]
    pub python: String,
    /// Where PyTorch trains in the part `training`: cpu, cuda, ...
    #[arg(long, value_name = "DEVICE", default_value = "cpu")]
    pub pytorch_device: String,
    /// Backends of the part `training`
    #[arg(
        long,
        value_name = "NAME",
        value_delimiter = ',',
        default_value = "engine"
    )]
    pub backends: Vec<Backend>,
    /// Statistics of the scoring detector
    #[arg(long, value_name = "SET", default_value = "paper24")]
    pub statistics: String,
    /// Poses of the log to score; burn-flex gets a tenth of them
    #[arg(long, value_name = "N", default_value_t = 37_000)]
    pub score_poses: usize,
    /// Diffusion steps of a score
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "10")]
    pub score_steps: Vec<usize>,
    /// Noise draws of a score (`fit` takes 2 for a `paper` model, 1 for a `motion` model)
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "2,1")]
    pub score_draws: Vec<usize>,
    /// Times that a log is scored
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub score_rounds: usize,
    /// Streams
    #[command(flatten)]
    pub stream: stream::StreamArgs,
    /// Folder for bench.json and bench.md
    #[arg(long, value_name = "DIR", default_value = "results")]
    pub out: PathBuf,
    /// Also put the tables into this document, between the lines <!-- bench --> and <!-- /bench -->
    #[arg(long, value_name = "FILE")]
    pub render: Option<PathBuf>,
}

/// The networks of a measurement and what they are given.
#[derive(Clone, Debug)]
pub struct Shape {
    width: usize,
    multipliers: Vec<usize>,
    batch: usize,
    length: usize,
}

/// Runs the measurements and writes the results.
///
/// # Errors
/// Settings out of range, PyTorch where it is asked for and not there.
pub fn run(args: &BenchArgs) -> Result<()> {
    let command: Vec<String> = std::env::args().skip(1).collect();
    let start = Start::now(&command.join(" "));
    check(args)?;
    if args.parts.contains(&Part::Stream) {
        stream::run(&args.stream, &args.out, &command.join(" "))?;
        if args.parts.len() == 1 {
            return Ok(());
        }
    }
    let mut report = Report {
        flex: cfg!(feature = "flex"),
        multipliers: args.multipliers.clone(),
        batch: args.batch,
        length: args.length,
        statistics: args.statistics.clone(),
        score_poses: args.score_poses,
        ..Report::default()
    };
    for &width in &args.widths {
        let shape = Shape {
            width,
            multipliers: args.multipliers.clone(),
            batch: args.batch,
            length: args.length,
        };
        if args.parts.contains(&Part::Networks) {
            networks(args, &shape, &mut report)?;
        }
        if args.parts.contains(&Part::Training) {
            let (rows, version) = training::run(args, &shape)?;
            report.training.extend(rows);
            report.pytorch = version.or(report.pytorch.take());
        }
        if args.parts.contains(&Part::Score) {
            scores(args, &shape, &mut report)?;
        }
    }
    report.provenance = start.finish();
    let markdown = report.markdown();
    let json = serde_json::to_string_pretty(&report)?;
    atomic::write(&args.out.join("bench.json"), json.as_bytes())?;
    atomic::write(&args.out.join("bench.md"), markdown.as_bytes())?;
    say!("\n{markdown}");
    if let Some(path) = &args.render {
        render_into(path, &markdown, "bench")?;
        say!("updated {}", path.display());
    }
    Ok(())
}

fn check(args: &BenchArgs) -> Result<()> {
    if args.widths.is_empty() || args.threads.is_empty() || args.threads.contains(&0) {
        bail!("--widths and --threads want positive numbers");
    }
    if args.batch == 0 || args.length == 0 || args.rounds == 0 || args.score_rounds == 0 {
        bail!("--batch, --length, --rounds and --score-rounds must be at least 1");
    }
    if !(args.seconds.is_finite() && args.seconds > 0.0) {
        bail!("--seconds {}: expected a positive number", args.seconds);
    }
    Ok(())
}

/// The contestants of one number of threads, with their shortest times.
struct Lane {
    threads: usize,
    engine: Pair,
    flex: Option<Pair>,
    pytorch: Option<Pytorch>,
    forward: Times,
    train: Times,
}

/// The shortest time of each contestant, seconds.
#[derive(Clone, Copy, Default)]
struct Times {
    engine: Option<f64>,
    flex: Option<f64>,
    eager: Option<f64>,
    compiled: Option<f64>,
}

fn shorter(best: &mut Option<f64>, time: f64) {
    *best = Some(best.map_or(time, |b| b.min(time)));
}

fn networks(args: &BenchArgs, shape: &Shape, report: &mut Report) -> Result<()> {
    say!("width {}: networks", shape.width);
    let (flops, instructions) = network::work(shape)?;
    report.instructions = format!("{instructions:?}");
    let mut lanes = Vec::new();
    for &threads in &args.threads {
        let flex = cfg!(feature = "flex").then(|| Pair::new(shape, Backend::BurnFlex, threads));
        let pytorch = args
            .with_pytorch
            .then(|| Pytorch::start(&args.python, shape, threads, args.seconds, "cpu"));
        lanes.push(Lane {
            threads,
            engine: Pair::new(shape, Backend::Engine, threads)?,
            flex: flex.transpose()?,
            pytorch: pytorch.transpose()?,
            forward: Times::default(),
            train: Times::default(),
        });
    }
    let mut sgemm: Option<f64> = None;
    for round in 0..args.rounds {
        say!("  turn {} of {}", round + 1, args.rounds);
        if let Some(peak) = sgemm::peak(args.seconds / 4.0) {
            sgemm = Some(sgemm.map_or(peak, |s| s.max(peak)));
        }
        for lane in &mut lanes {
            lane.turn(args.seconds)?;
        }
    }
    for lane in &mut lanes {
        if let Some(pytorch) = &mut lane.pytorch {
            report.pytorch = Some(pytorch.version()?);
        }
    }
    let first = lanes.first().map(|lane| (lane.forward, lane.train));
    for lane in &lanes {
        for (what, work, times, alone) in [
            ("forward", 1.0, lane.forward, first.map(|f| f.0)),
            ("training step", 3.0, lane.train, first.map(|f| f.1)),
        ] {
            let speed = |time: Option<f64>| time.map(|t| shape.batch as f64 / t);
            report.networks.push(NetworkRow {
                width: shape.width,
                threads: lane.threads,
                what,
                engine: speed(times.engine).unwrap_or_default(),
                gflops: speed(times.engine).unwrap_or_default() * work * flops / 1e9,
                sgemm,
                flex: speed(times.flex),
                eager: speed(times.eager),
                compiled: speed(times.compiled),
                over_first: alone
                    .and_then(|a| Some(a.engine? / times.engine?))
                    .unwrap_or(1.0),
            });
        }
    }
    Ok(())
}

impl Lane {
    fn turn(&mut self, seconds: f64) -> Result<()> {
        shorter(&mut self.forward.engine, self.engine.forward(seconds)?);
        shorter(&mut self.train.engine, self.engine.train(seconds)?);
        if let Some(pytorch) = &mut self.pytorch {
            let mut time = |what, mode| pytorch.time(what, mode);
            shorter(&mut self.forward.eager, time("forward", Mode::Eager)?);
            shorter(&mut self.train.eager, time("train", Mode::Eager)?);
            shorter(&mut self.forward.compiled, time("forward", Mode::Compiled)?);
            shorter(&mut self.train.compiled, time("train", Mode::Compiled)?);
        }
        if let Some(flex) = &mut self.flex {
            shorter(&mut self.forward.flex, flex.forward(seconds)?);
            shorter(&mut self.train.flex, flex.train(seconds)?);
        }
        Ok(())
    }
}

fn scores(args: &BenchArgs, shape: &Shape, report: &mut Report) -> Result<()> {
    let log = LogFile::new(args.score_poses)?;
    let part = LogFile::new((args.score_poses / 10).max(shape.length))?;
    for &steps in &args.score_steps {
        for &draws in &args.score_draws {
            say!("width {}: score, {steps} steps, {draws} draws", shape.width);
            let spending = Spending { steps, draws };
            let detector = score::detector(shape, &args.statistics, spending)?;
            for &threads in &args.threads {
                let time =
                    |log, backend, rounds| score::time(&detector, log, backend, threads, rounds);
                let (windows, seconds) = time(&log, Backend::Engine, args.score_rounds)?;
                let flex = if cfg!(feature = "flex") {
                    let (windows, seconds) = time(&part, Backend::BurnFlex, 1)?;
                    Some(windows as f64 / seconds)
                } else {
                    None
                };
                report.scores.push(ScoreRow {
                    width: shape.width,
                    threads,
                    steps,
                    draws,
                    windows,
                    seconds,
                    flex,
                });
            }
        }
    }
    Ok(())
}

/// The shortest time of a call among those of `seconds`, at least one.
fn best(seconds: f64, mut work: impl FnMut() -> Result<()>) -> Result<f64> {
    let start = Instant::now();
    let mut best = f64::INFINITY;
    while best.is_infinite() || start.elapsed().as_secs_f64() < seconds {
        let begin = Instant::now();
        work()?;
        best = best.min(begin.elapsed().as_secs_f64());
    }
    Ok(best)
}
