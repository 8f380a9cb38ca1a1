//! `cargo xtask benchmark`: the command line of the study's benchmarks.

use crate::use_threads;
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use dose3::backend::{Backend, Computing};
use dose3_study::benchmark::{self, Source, TableOptions};
use dose3_study::faults::{self, FaultOptions, Part, Section};
use dose3_study::learned;
use dose3_study::live::{self, LiveOptions};
use dose3_study::options::Options;
use dose3_study::reproduction::{self, ReproductionOptions};
use dose3_study::verdicts::{self, VerdictOptions};
use std::path::PathBuf;
use std::process::Command;

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
    /// Verdicts on logs
    #[command(flatten)]
    pub verdicts: VerdictArgs,
    /// Alarms while a log is recorded
    #[command(flatten)]
    pub live: LiveArgs,
    /// Everything that the paper shows
    #[command(flatten)]
    pub all: AllArgs,
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
    /// Noise draws of the row with shared noise (default: 2), or of --faults (default: 1)
    #[arg(long)]
    pub draws: Option<usize>,
    /// Density over the statistics
    #[arg(long, default_value = "mixture:5")]
    pub density: String,
    /// Bootstrap resamples of the intervals
    #[arg(long, default_value_t = 1000)]
    pub resamples: usize,
    /// Folder of results, as JSON and Markdown
    #[arg(long, value_name = "DIR", default_value = "results")]
    pub out: PathBuf,
    /// Also write the tables as a document into this folder (docs/results where none is named)
    #[arg(long, value_name = "DIR", num_args = 0..=1, default_missing_value = "docs/results")]
    pub render: Option<PathBuf>,
    /// Where the networks run
    #[arg(long, value_name = "BACKEND", default_value_t)]
    pub backend: Backend,
    /// Threads (0: all cores); results do not depend on it
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
}

/// Arguments of `--all`.
#[derive(Debug, Args)]
pub struct AllArgs {
    /// All tables and figures of the paper, with every baseline: all.html, all.json and all.md
    #[arg(
        long,
        conflicts_with_all = ["faults", "model", "retrain", "seeds", "stride", "steps", "draws"]
    )]
    pub all: bool,
    /// Measure everything anew, also what an earlier run measured
    #[arg(long, requires = "all")]
    pub fresh: bool,
    /// Leave out JEM and Glow, which are built with burn the first time (about eight minutes)
    #[arg(long, requires = "all")]
    pub without_baselines: bool,
}

/// Arguments of `--faults`.
#[derive(Debug, Args)]
pub struct FaultArgs {
    /// Measure detection of injected faults, false alarms and near platforms instead of the
    /// paper's table; writes faults.json and faults.md
    #[arg(long)]
    pub faults: bool,
    /// Which logs are tested: validation (settings are chosen on them) or test
    #[arg(long, default_value_t)]
    pub part: Part,
    /// Places a set that faults are injected at (with --quick at most 40)
    #[arg(long, value_name = "N", default_value_t = 150, requires = "faults")]
    pub sites: usize,
    /// Seed of noise, fits and faults
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Sections to run: windows, logs, controls, alarms, cells, near, and into verdicts.json and verdicts.md
    /// couplings, timing, short, lengths, throughout, few, whole, calibration; reasons into reasons.json and reasons.md (default:
    /// all; --quick leaves out near and the verdicts)
    #[arg(long, value_delimiter = ',', requires = "faults")]
    pub only: Vec<Section>,
}

/// Arguments of `--real` and of the sections of `--faults` that are about verdicts.
#[derive(Debug, Args)]
pub struct VerdictArgs {
    /// Judge real failures of odometries (vio, kitti-estimates); writes real.json and real.md
    #[arg(long, conflicts_with_all = ["faults", "all", "synthetic", "retrain"])]
    pub real: bool,
    /// Rows of --real and of the verdicts to measure, by their names in the tables (default: all)
    #[arg(long, value_delimiter = ',', value_name = "ROW")]
    pub rows: Vec<String>,
    /// Most pieces of logs a set (default: all; 6 with --quick)
    #[arg(long, value_name = "N")]
    pub pieces: Option<usize>,
    /// Measure verdicts at this rate, hertz, not above 10 (pieces and faults span the same time)
    #[arg(long, value_name = "HZ")]
    pub rate: Option<f64>,
    /// Measure verdicts in windows of so many steps (default: 128)
    #[arg(long, value_name = "N")]
    pub window: Option<usize>,
    /// Judge the test logs alone, not every group of logs left out in turn
    #[arg(long)]
    pub one_fold: bool,
}

/// Arguments of `--live`.
#[derive(Debug, Args)]
pub struct LiveArgs {
    /// Measure how soon streams raise an alarm, and how often on sound logs; writes live.json and live.md
    #[arg(long, conflicts_with_all = ["faults", "real", "all", "retrain", "model"])]
    pub live: bool,
    /// False alarms an hour that are allowed
    #[arg(long, value_name = "N", default_value_t = 1.0, requires = "live")]
    pub alarms_per_hour: f64,
    /// Poses from window to window (default: a quarter of the detector's stride)
    #[arg(long, value_name = "N", requires = "live")]
    pub every: Option<usize>,
    /// Only faults of these names, such as freeze,jump (default: all)
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "live")]
    pub kinds: Vec<String>,
}

/// Runs a benchmark and writes its results.
///
/// # Errors
/// As the benchmarks of the study.
pub fn run(args: &BenchmarkArgs) -> Result<()> {
    use_threads(args.threads)?;
    ensure!(
        args.steps != Some(0)
            && args.draws != Some(0)
            && args.seeds > 0
            && args.stride > 0
            && args.faults.sites > 0,
        "--steps, --draws, --seeds, --stride and --sites must be at least 1"
    );
    let options = Options {
        data: args.data.clone(),
        synthetic: args.synthetic,
        quick: args.quick,
        density: args.density.clone(),
        resamples: args.resamples,
        out: args.out.clone(),
        render: args.render.clone(),
        computing: Computing {
            backend: args.backend,
            threads: args.threads,
        },
        command: std::env::args().skip(1).collect::<Vec<_>>().join(" "),
    };
    if args.all.all {
        return reproduce(args, &options);
    }
    if args.live.live {
        return live::run(
            &options,
            &LiveOptions {
                part: args.faults.part,
                pieces: args.verdicts.pieces,
                one_fold: args.verdicts.one_fold,
                seed: args.faults.seed,
                alarms_per_hour: args.live.alarms_per_hour,
                every: args.live.every,
                kinds: args.live.kinds.clone(),
            },
        );
    }
    if args.verdicts.real {
        return verdicts::real(&options, &fault_options(args));
    }
    if args.faults.faults {
        return faults::run(&options, &fault_options(args));
    }
    if args.model.len() > 1 {
        bail!("--model: several models are for --faults");
    }
    let network = match (args.model.first(), args.retrain) {
        (Some(path), _) => Source::File(path.clone()),
        (None, true) => Source::Trained(args.train_steps),
        (None, false) => Source::BuiltIn,
    };
    let of_table = TableOptions {
        network,
        seeds: args.seeds,
        stride: args.stride,
        steps: args.steps,
        draws: args.draws.unwrap_or(2),
    };
    benchmark::run(&options, &of_table)
}

fn fault_options(args: &BenchmarkArgs) -> FaultOptions {
    FaultOptions {
        models: args.model.clone(),
        part: args.faults.part,
        sites: args.faults.sites,
        seed: args.faults.seed,
        only: args.faults.only.clone(),
        stride: args.stride,
        steps: args.steps,
        draws: args.draws,
        verdicts: VerdictOptions {
            rows: args.verdicts.rows.clone(),
            pieces: args.verdicts.pieces,
            rate: args.verdicts.rate,
            window: args.verdicts.window,
            one_fold: args.verdicts.one_fold,
        },
    }
}

/// The reproduction, in an xtask with the learned baselines where this one is without them.
fn reproduce(args: &BenchmarkArgs, options: &Options) -> Result<()> {
    let mut of_reproduction = ReproductionOptions {
        fresh: args.all.fresh,
        without_baselines: None,
    };
    if args.all.without_baselines {
        of_reproduction.without_baselines = Some("left out (--without-baselines)".into());
    } else if !learned::BUILT {
        match with_baselines(&["build"], &[]) {
            Ok(()) => {
                let same: Vec<String> = std::env::args().skip(1).collect();
                return with_baselines(&["run"], &same);
            }
            Err(error) => of_reproduction.without_baselines = Some(format!("{error:#}")),
        }
    }
    let left_out = of_reproduction.without_baselines.clone();
    reproduction::run(options, &of_reproduction)?;
    match left_out.filter(|_| !args.all.without_baselines) {
        Some(reason) => bail!("the report was written without JEM and Glow: {reason}"),
        None => Ok(()),
    }
}

/// Has cargo build or run an xtask with the learned baselines.
fn with_baselines(task: &[&str], arguments: &[String]) -> Result<()> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args(task)
        .args(["--release", "--quiet", "--package", "xtask"])
        .args(["--features", "baselines", "--manifest-path"])
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"))
        .args((!arguments.is_empty()).then_some("--"))
        .args(arguments)
        .status()
        .context("cannot start cargo for the learned baselines")?;
    ensure!(
        status.success(),
        "an xtask with the learned baselines: {status}"
    );
    Ok(())
}
