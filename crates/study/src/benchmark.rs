//! `cargo xtask benchmark`: the AUROC table of the paper, with honest columns beside it.

use crate::all;
use crate::cells::{Cell, Fitted, Protocol, Rows};
use crate::data::DataRoot;
use crate::faults::{self, FaultArgs};
use crate::provenance::{commit, machine, render_into};
use crate::release::{HELD_OUT, ReleaseArgs};
use crate::report;
use crate::sets::{self, DataSet};
use anyhow::{Context, Result, bail};
use clap::Args;
use dose3::atomic;
use dose3::backend::Backend;
use dose3::features::Extractor;
use dose3::model_file::{LogRecord, Model};
use dose3::train::train;
use dose3_datasets::Trajectory;
use dose3_diffusion::{Branches, NoiseSharing, ProbeConfig, Process};
use dose3_model::Precision;
use dose3_ood::metrics::Bootstrap;
use dose3_ood::{DensityConfig, StatisticsSet};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `benchmark`.
#[derive(Debug, Args)]
pub struct BenchmarkArgs {
    /// Folder with kitti/poses, robotcar and iros20 (default: $DOSE3_DATA, else data/, else
    /// synthetic data)
    #[arg(long, value_name = "DIR", conflicts_with = "synthetic")]
    pub data: Option<PathBuf>,
    /// Use the synthetic data sets even where real data is at hand
    #[arg(long)]
    pub synthetic: bool,
    /// Model to use (default: the shipped weights); with --faults several, one a training seed
    #[arg(
        long,
        value_name = "FILE",
        value_delimiter = ',',
        conflicts_with = "retrain"
    )]
    pub model: Vec<PathBuf>,
    /// Faults instead of the paper's table
    #[command(flatten)]
    pub faults: FaultArgs,
    /// Everything that the paper shows
    #[command(flatten)]
    pub all: all::AllArgs,
    /// Train anew instead of using shipped weights, once per seed (KITTI, or the synthetic vehicle)
    #[arg(long)]
    pub retrain: bool,
    /// Optimiser steps of --retrain (default: those of the shipped model)
    #[arg(long, requires = "retrain")]
    pub train_steps: Option<usize>,
    /// Repetitions with other seeds: of noise and density fit, and of training with --retrain
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seeds: u64,
    /// A third of the windows and of the diffusion steps
    #[arg(long)]
    pub quick: bool,
    /// Poses between the starts of windows
    #[arg(long, default_value_t = 32)]
    pub stride: usize,
    /// Diffusion steps visited, evenly spread (default: all of the model's; 12 with --faults)
    #[arg(long, value_name = "N")]
    pub steps: Option<usize>,
    /// Noise draws of the row with common noise (default: 2), or of --faults (default: 1)
    #[arg(long)]
    pub draws: Option<usize>,
    /// Density over the statistics
    #[arg(long, default_value = "mixture:5")]
    pub density: String,
    /// Bootstrap resamples of the intervals
    #[arg(long, default_value_t = 1000)]
    pub resamples: usize,
    /// Folder for benchmark.json and benchmark.md, or faults.json and faults.md
    #[arg(long, value_name = "DIR", default_value = "results")]
    pub out: PathBuf,
    /// Also put the tables into this document, between its markers
    #[arg(long, value_name = "FILE")]
    pub render: Option<PathBuf>,
    /// Where the networks run
    #[arg(long, value_name = "BACKEND", default_value_t)]
    pub backend: Backend,
    /// Threads (0: all cores); results do not depend on it
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
}

/// A row of the table.
pub struct Method {
    /// Its name in results.
    pub key: &'static str,
    /// The statistics.
    pub statistics: &'static str,
    /// Which noise they are computed with.
    pub noise: NoiseSharing,
    /// What it is called in tables.
    pub label: &'static str,
}

/// The rows of the table.
pub const METHODS: [Method; 6] = [
    Method {
        key: "paper24",
        statistics: "paper24",
        noise: NoiseSharing::PerWindow,
        label: "SE(3), rotation split (24 statistics)",
    },
    Method {
        key: "paper24-common",
        statistics: "paper24",
        noise: NoiseSharing::Common,
        label: "SE(3), rotation split (24), common noise draws",
    },
    Method {
        key: "paper12",
        statistics: "paper12",
        noise: NoiseSharing::PerWindow,
        label: "SE(3), no split (12)",
    },
    Method {
        key: "r3",
        statistics: "r3",
        noise: NoiseSharing::PerWindow,
        label: "R^3, translation alone (6)",
    },
    Method {
        key: "moments24",
        statistics: "moments24",
        noise: NoiseSharing::PerWindow,
        label: "no network: raw moments of the poses (24)",
    },
    Method {
        key: "kinematic",
        statistics: "kinematic",
        noise: NoiseSharing::PerWindow,
        label: "no network: body-frame kinematics",
    },
];

/// Runs the benchmark and writes its results.
///
/// # Errors
/// Data that cannot be read, a model that does not fit, a failing fit.
pub fn run(args: &BenchmarkArgs) -> Result<()> {
    let start = Instant::now();
    // Before the run: the checkout may move on meanwhile.
    let commit = commit();
    if args.steps == Some(0) {
        bail!("--steps must be at least 1");
    }
    if args.seeds == 0 || args.stride == 0 || args.draws == Some(0) {
        bail!("--seeds, --stride and --draws must be at least 1");
    }
    if args.all.all {
        return all::run(args);
    }
    if args.faults.faults {
        return faults::run(args);
    }
    if args.model.len() > 1 {
        bail!("--model: several models are for --faults");
    }
    let density: DensityConfig = args.density.parse()?;
    let (source, mut data) = load(args)?;
    let synthetic = source.is_none();
    let mut runs = Vec::new();
    let mut header = None;
    for seed in 0..args.seeds {
        let model = model(args, &data, seed)?;
        runs.push(one_run(args, &mut data, &model, &density, seed)?);
        header.get_or_insert(model.header);
    }
    let header = header.context("at least one seed ran")?;
    let report = report::Report {
        synthetic,
        source,
        command: std::env::args().skip(1).collect::<Vec<_>>().join(" "),
        commit,
        machine: machine(),
        seconds: start.elapsed().as_secs_f64(),
        retrained: args.retrain,
        stride: stride(args),
        steps: steps(args, header.process.steps),
        draws: draws(args),
        density: args.density.clone(),
        resamples: args.resamples,
        window: header.window,
        network_logs: names(&header.training.logs),
        network_held_out: names(&header.training.validation),
        sets: data.iter().map(report::SetSummary::new).collect(),
        runs,
    };
    let markdown = report.markdown();
    atomic::write(
        &args.out.join("benchmark.json"),
        serde_json::to_string_pretty(&report)?.as_bytes(),
    )?;
    atomic::write(&args.out.join("benchmark.md"), markdown.as_bytes())?;
    println!("\n{markdown}");
    println!(
        "wrote {} and benchmark.md",
        args.out.join("benchmark.json").display()
    );
    if let Some(path) = &args.render {
        let name = if synthetic {
            "benchmark-synthetic"
        } else {
            "benchmark"
        };
        render_into(path, &markdown, name)?;
        println!("updated {}", path.display());
    }
    Ok(())
}

/// The data sets, with where real ones came from. Fewer than two real sets make no table: found in
/// `data/` the benchmark goes on with synthetic ones, in a folder that was named that is an error.
pub(crate) fn load(args: &BenchmarkArgs) -> Result<(Option<String>, Vec<DataSet>)> {
    let root = if args.synthetic {
        None
    } else {
        DataRoot::find_optional(args.data.as_deref())?
    };
    if let Some(root) = &root {
        let sets = sets::real(root)?;
        let found: Vec<&str> = sets.iter().map(|s| s.name).collect();
        let found = if found.is_empty() {
            "no data set".into()
        } else {
            found.join(", ")
        };
        println!(
            "real data from {} ({}): {found}",
            root.path.display(),
            root.source
        );
        if sets.len() >= 2 {
            return Ok((Some(root.source.to_string()), sets));
        }
        if root.source != DataRoot::DEFAULT {
            bail!(
                "{} holds {found}; two of kitti/poses, robotcar and iros20 are needed for a table",
                root.path.display()
            );
        }
    }
    println!(
        "no table of real data can be made (--data, $DOSE3_DATA, data/): SYNTHETIC data sets, \
         generated here. These numbers say nothing about the paper's."
    );
    Ok((None, sets::synthetic(0, sets::synthetic_logs(args.quick))?))
}

fn one_run(
    args: &BenchmarkArgs,
    data: &mut [DataSet],
    model: &Model,
    density: &DensityConfig,
    seed: u64,
) -> Result<report::Run> {
    let start = Instant::now();
    let poses = model.header.representation.kind.poses(model.header.window);
    let hashes = |records: &[LogRecord]| -> Vec<String> {
        records.iter().map(|r| r.sha256.clone()).collect()
    };
    let held_out = hashes(&model.header.training.validation);
    let trained = hashes(&model.header.training.logs);
    data.iter_mut()
        .for_each(|set| set.prepare(poses, stride(args), &held_out, &trained));
    let rows: Vec<Vec<Vec<Vec<f64>>>> = data
        .iter()
        .map(|set| statistics(args, set, model, seed))
        .collect::<Result<_>>()?;
    let windows: usize = data.iter().map(|s| s.windows.len()).sum();
    let scoring_seconds = start.elapsed().as_secs_f64();

    let bootstrap = Bootstrap {
        resamples: args.resamples,
        seed,
        ..Bootstrap::default()
    };
    let bar = progress(
        (Protocol::ALL.len() * METHODS.len() * data.len()) as u64,
        "densities",
    )?;
    let mut tables = Vec::new();
    for protocol in Protocol::ALL {
        for (m, method) in METHODS.iter().enumerate() {
            let mut cells: Vec<Cell> = Vec::new();
            for (i, id) in data.iter().enumerate() {
                let side = Rows {
                    set: id,
                    rows: &rows[i][m],
                };
                let fitted = Fitted::new(&side, protocol, density, seed)?;
                for (o, ood) in data.iter().enumerate().filter(|(o, _)| *o != i) {
                    let ood = Rows {
                        set: ood,
                        rows: &rows[o][m],
                    };
                    cells.push(fitted.against(id.letter, &ood, bootstrap)?);
                }
                bar.inc(1);
            }
            tables.push(report::Table {
                protocol,
                method: method.key.to_string(),
                cells,
            });
        }
    }
    bar.finish_and_clear();
    Ok(report::Run {
        seed,
        model_sha256: report::sha256(&model.to_bytes(Precision::F32, &[])?),
        windows,
        scoring_seconds,
        tables,
    })
}

/// The statistics of every method for every window of a set, one pass of the networks for each
/// kind of noise: `[method][window][column]`.
fn statistics(
    args: &BenchmarkArgs,
    set: &DataSet,
    model: &Model,
    seed: u64,
) -> Result<Vec<Vec<Vec<f64>>>> {
    let process = Process::new(model.header.process)?;
    let mut models = args.backend.load(&model.parameters, args.threads)?;
    let bar = progress(2 * set.windows.len() as u64, set.name)?;
    let mut rows = vec![Vec::with_capacity(set.windows.len()); METHODS.len()];
    for (sharing, draws) in [
        (NoiseSharing::PerWindow, 1),
        (NoiseSharing::Common, draws(args)),
    ] {
        let methods: Vec<(usize, StatisticsSet)> = METHODS
            .iter()
            .enumerate()
            .filter(|(_, m)| m.noise == sharing)
            .map(|(i, m)| Ok((i, m.statistics.parse()?)))
            .collect::<Result<_>>()?;
        let mut extractor = Extractor {
            models: &mut models,
            process: &process,
            probe: ProbeConfig {
                steps: steps(args, process.steps()),
                draws,
                seed,
                sharing,
            },
            representation: model.header.representation,
        };
        let both = Some(Branches::Both);
        extractor.for_each(&set.trajectories, &set.windows, both, &mut |_, data| {
            for (i, method) in &methods {
                rows[*i].push(method.evaluate(&data.sample())?);
            }
            bar.inc(1);
            Ok(())
        })?;
    }
    bar.finish_and_clear();
    println!(
        "{}: {} logs, {} windows",
        set.name,
        set.trajectories.len(),
        set.windows.len()
    );
    Ok(rows)
}

/// The shipped model, the one of `--model`, or one trained now (kept under the results folder and
/// taken up again where it is finished or was interrupted).
fn model(args: &BenchmarkArgs, data: &[DataSet], seed: u64) -> Result<Model> {
    if let Some(path) = args.model.first() {
        return Ok(Model::read(path)?);
    }
    if !args.retrain {
        return Ok(dose3::built_in::paper()?);
    }
    let set = data
        .iter()
        .find(|s| matches!(s.letter, 'K' | 'V'))
        .context("the set to train on is missing")?;
    let kind = if set.letter == 'K' {
        "kitti"
    } else {
        "synthetic-vehicle"
    };
    let mut release = ReleaseArgs::shipped(seed);
    if let Some(steps) = args.train_steps {
        release.steps = Some(steps);
    }
    release.backend = args.backend;
    release.threads = args.threads;
    let name = format!("{kind}-{}-seed{seed}.dose3", release.steps());
    let out = args.out.join("models").join(name);
    release.out = Some(out.clone());
    let mut options = release.options(HELD_OUT.map(String::from).to_vec());
    if set.letter != 'K' {
        options.hold_out = dose3::train::HoldOut::Fraction(0.25);
    }
    if out.exists() {
        let old = Model::read(&out)?;
        let (training, validation) =
            dose3::train::split(&set.trajectories, &options.hold_out, seed)?;
        let records = |logs: &[Trajectory]| logs.iter().map(LogRecord::from).collect::<Vec<_>>();
        if old.header.training.config == options.config
            && old.header.process == options.process
            && old.parameters.config() == options.network
            && old.header.training.logs == records(&training)
            && old.header.training.validation == records(&validation)
        {
            println!("taking up {}, trained by an earlier run", out.display());
            return Ok(old);
        }
        bail!(
            "{} was trained with other settings or data; remove it to train anew",
            out.display()
        );
    }
    let bar = progress(release.steps() as u64, "training")?;
    let trained = train(&set.trajectories, &options, &mut |_, _| (), &mut |row| {
        bar.set_position(row.step as u64);
    })?;
    bar.finish_and_clear();
    trained.model.write(&out, Precision::F32)?;
    Ok(trained.model)
}

fn stride(args: &BenchmarkArgs) -> usize {
    if args.quick {
        args.stride.saturating_mul(3)
    } else {
        args.stride
    }
}

fn steps(args: &BenchmarkArgs, of_model: usize) -> usize {
    let steps = args.steps.unwrap_or(of_model).clamp(1, of_model);
    if args.quick { steps.div_ceil(3) } else { steps }
}

/// Noise draws of the row with common noise.
fn draws(args: &BenchmarkArgs) -> usize {
    args.draws.unwrap_or(2)
}

fn names(records: &[LogRecord]) -> Vec<String> {
    records.iter().map(|r| r.name.clone()).collect()
}

/// A progress bar with ETA on a terminal; elsewhere nothing.
pub(crate) fn progress(total: u64, what: &str) -> Result<ProgressBar> {
    if !std::io::stderr().is_terminal() {
        return Ok(ProgressBar::hidden());
    }
    let style = ProgressStyle::with_template(
        "{prefix:<28} [{bar:30}] {pos}/{len} {elapsed} elapsed, {eta} left",
    )?
    .progress_chars("=> ");
    Ok(ProgressBar::new(total)
        .with_style(style)
        .with_prefix(what.to_string()))
}
