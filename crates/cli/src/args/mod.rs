//! The command line: a file for each subcommand, and for what several share.

mod computing;
mod eval;
mod fit;
mod inspect;
mod reading;
mod sample;
mod score;
mod train;

pub use computing::Computing;
pub use eval::Eval;
pub use fit::Fit;
pub use inspect::Inspect;
pub use reading::{FrameOf, Reading, StampName};
pub use sample::Sample;
pub use score::{OutputName, Score, Showing};
pub use train::{RotationNoiseName, RotationProcessName, ScheduleName, Train};

use clap::{Parser, Subcommand};

/// Is this pose log like the logs I trust, and if not, where and why?
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
#[command(
    after_help = "Exit codes: 0 in distribution (or done), 1 out of distribution, 2 error.\n\
    Formats are told by content: KITTI, TUM, EuRoC, RobotCar, csv with named columns, matrices, npy, \
    IROS20, g2o, COLMAP, NeRF, Open3D; MCAP, ROS 1 and ROS 2 bags, PX4 ULog; .gz and .zst of text; \
    - is standard input."
)]
pub struct Args {
    /// What to do
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Train the two noise estimators on pose logs (needed once; a trained model is built in)
    Train(Train),
    /// Learn what trusted logs look like to a model, without retraining it
    Fit(Fit),
    /// Judge logs: verdict, p-value, where and why
    Score(Score),
    /// Measure a detector on logs known to be in and out of distribution
    Eval(Eval),
    /// Show what a log holds, and what had to be repaired when reading it
    Inspect(Inspect),
    /// Generate pose sequences from a model
    Sample(Sample),
}

impl Command {
    /// Threads asked for; 0 for all cores.
    pub fn threads(&self) -> usize {
        match self {
            Self::Train(a) => a.computing.threads,
            Self::Fit(a) => a.computing.threads,
            Self::Score(a) => a.computing.threads,
            Self::Eval(a) => a.computing.threads,
            Self::Sample(a) => a.computing.threads,
            Self::Inspect(_) => 0,
        }
    }
}
