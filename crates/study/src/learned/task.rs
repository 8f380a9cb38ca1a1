//! The tasks `train-baselines` and `baseline-scores`.

use super::{Baseline, Request};
#[cfg(feature = "baselines")]
use super::{scoring, training};
use anyhow::Result;
use clap::Args;
use dose3_datasets::Kind;
use std::path::PathBuf;

/// Arguments of `train-baselines`.
#[derive(Debug, Args)]
pub struct TrainArgs {
    /// Which baseline (default: both)
    #[arg(long, value_enum)]
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
    /// File to write (default: the shipped one, in crates/study/weights/baselines/)
    #[arg(long, value_name = "FILE", requires = "baseline")]
    pub out: Option<PathBuf>,
    /// Optimiser steps, for Glow of each of its two models (default: Glow 2000, JEM 1000)
    #[arg(long)]
    pub steps: Option<usize>,
    /// Threads (0: all cores)
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
}

/// Arguments of `baseline-scores`.
#[derive(Debug, Args)]
pub struct ScoresArgs {
    /// What is asked for
    #[command(flatten)]
    pub request: Request,
    /// JSON file to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

/// Trains on KITTI and writes weights.
///
/// # Errors
/// An xtask without the feature `baselines`, no data, failing training.
#[cfg(feature = "baselines")]
pub fn train(args: &TrainArgs) -> Result<()> {
    training::run(args)
}

/// Writes the scores of a request.
///
/// # Errors
/// An xtask without the feature `baselines`, no data, no weights.
#[cfg(feature = "baselines")]
pub fn write_scores(args: &ScoresArgs) -> Result<()> {
    scoring::run(args)
}

/// Fails: this build has no learned baselines.
///
/// # Errors
/// Always, with the command that works.
#[cfg(not(feature = "baselines"))]
pub fn train(_: &TrainArgs) -> Result<()> {
    Err(not_built("train-baselines"))
}

/// Fails: this build has no learned baselines.
///
/// # Errors
/// Always, with the command that works.
#[cfg(not(feature = "baselines"))]
pub fn write_scores(_: &ScoresArgs) -> Result<()> {
    Err(not_built("baseline-scores"))
}

#[cfg(not(feature = "baselines"))]
fn not_built(task: &str) -> anyhow::Error {
    anyhow::anyhow!(
        "this xtask was built without the learned baselines: \
         cargo run --release -p xtask --features baselines -- {task}"
    )
}
