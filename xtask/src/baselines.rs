//! `cargo xtask train-baselines`: Glow and JEM, trained on KITTI.

use clap::Args;
use dose3_datasets::Kind;
use dose3_study::learned::Baseline;
use std::path::PathBuf;

/// Arguments of `train-baselines`.
#[derive(Debug, Args)]
pub struct TrainArgs {
    /// Which baseline: glow or jem (default: both)
    #[arg(long)]
    pub baseline: Option<Baseline>,
    /// How poses become numbers: paper or motion
    #[arg(long, default_value_t = Kind::Paper)]
    pub representation: Kind,
    /// Seed
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Folder with the data sets (default: $DOSE3_DATA, else data/)
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// File to write (default: that of the study, in crates/study/weights/baselines/)
    #[arg(long, value_name = "FILE", requires = "baseline")]
    pub out: Option<PathBuf>,
    /// Optimiser steps, for Glow of each of its two models (default: Glow 2000, JEM 1000)
    #[arg(long)]
    pub steps: Option<usize>,
    /// Threads (0: all cores)
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
}

/// Trains on KITTI what `args` name, and writes the weights.
///
/// # Errors
/// No data, failing training.
#[cfg(feature = "baselines")]
pub fn run(args: &TrainArgs) -> anyhow::Result<()> {
    use dose3_datasets::{LoadOptions, load_all};
    use dose3_study::learned::{Options, train_on, training_logs};

    crate::use_threads(args.threads)?;
    let root = dose3_study::data::DataRoot::find(args.data.as_deref())?;
    let logs = training_logs(&load_all(&[root.kitti()?], &LoadOptions::default())?)?;
    for baseline in Baseline::ALL {
        if args.baseline.is_some_and(|only| only != baseline) {
            continue;
        }
        let options = Options {
            baseline,
            representation: args.representation,
            seed: args.seed,
            steps: args.steps,
        };
        let learned = train_on(&logs, options, &mut |at| {
            if at.step.is_multiple_of(100) || at.step == at.steps {
                let (stage, step, steps) = (at.stage, at.step, at.steps);
                dose3_study::say!("{stage} step {step} of {steps}: loss {:.4}", at.loss);
            }
        })?;
        let of_study = || baseline.weights(args.representation, args.seed);
        let out = args.out.clone().unwrap_or_else(of_study);
        learned.write(&out)?;
        dose3_study::say!(
            "wrote {}; {} windows of {} logs, {} parameters, {}, {:.0} s",
            out.display(),
            learned.record.windows,
            logs.len(),
            learned.parameters(),
            learned.record.outcome,
            learned.seconds.unwrap_or_default()
        );
    }
    Ok(())
}

/// Fails: this build has no learned baselines.
///
/// # Errors
/// Always, with the command that works.
#[cfg(not(feature = "baselines"))]
pub fn run(_: &TrainArgs) -> anyhow::Result<()> {
    anyhow::bail!(
        "this xtask was built without the learned baselines: \
         cargo run --release -p xtask --features baselines -- train-baselines"
    )
}
