//! Arguments of `dose3 sample`.

use super::Computing;
use clap::Args as ClapArgs;
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    dose3 sample --out sequences/ --count 8 --seed 1")]
pub struct Sample {
    /// Model file, or a built-in one: `motion` or `paper`
    #[arg(long, value_name = "FILE|NAME", default_value = "motion")]
    pub model: PathBuf,
    /// Folder for the generated sequences, KITTI format
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Replace what lies there, whatever it is
    #[arg(long)]
    pub force: bool,
    /// How many
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub count: usize,
    /// Seed of the first; the others follow
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub computing: Computing,
}
