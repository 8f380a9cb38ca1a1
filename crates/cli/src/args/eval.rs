//! Arguments of `dose3 eval`.

use super::{Computing, Reading};
use clap::Args as ClapArgs;
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    dose3 eval --detector trusted.dose3 --id more-good/ --ood known-bad/")]
pub struct Eval {
    /// Detector file
    #[arg(long, value_name = "FILE")]
    pub detector: PathBuf,
    /// Files or folders with in-distribution logs (not those the detector was fitted on)
    #[arg(long, required = true, num_args = 1.., value_name = "PATH")]
    pub id: Vec<PathBuf>,
    /// Files or folders with out-of-distribution logs
    #[arg(long, required = true, num_args = 1.., value_name = "PATH")]
    pub ood: Vec<PathBuf>,
    /// One JSON document instead of text
    #[arg(long)]
    pub json: bool,
    /// Bootstrap resamples of the intervals
    #[arg(long, value_name = "N", default_value_t = 1000)]
    pub resamples: usize,
    #[command(flatten)]
    pub reading: Reading,
    #[command(flatten)]
    pub computing: Computing,
}
