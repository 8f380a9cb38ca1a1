//! `cargo xtask fetch-data`: brings the public data sets to where the benchmark looks for them.
//!
//! KITTI's poses can be downloaded without an account; they are verified against pinned checksums.
//! RobotCar wants a registration and IROS20 is a 22 GB download, so for these the task says where
//! to go and checks a folder that is already there.

pub mod check;
pub mod checksums;
pub mod download;
pub mod guide;
pub mod kitti;

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, Subcommand};

/// Arguments of `cargo xtask fetch-data`.
#[derive(Debug, Args)]
pub struct FetchArgs {
    #[command(subcommand)]
    dataset: Dataset,
}

#[derive(Debug, Subcommand)]
enum Dataset {
    /// Download, unpack and verify the KITTI odometry ground truth poses.
    Kitti {
        /// Folder for the data sets; the poses go to <OUT>/kitti/poses.
        #[arg(long, default_value = "data")]
        out: PathBuf,
        /// Where the archive is.
        #[arg(long, default_value = kitti::ARCHIVE)]
        url: String,
    },
    /// Say how to get the Oxford (Radar) RobotCar poses, and check a folder of them.
    #[command(name = "robotcar")]
    RobotCar {
        /// Folder to check; exit code 1 where something is missing or does not load.
        #[arg(long, value_name = "DIR")]
        check: Option<PathBuf>,
    },
    /// Say how to get the IROS20 (YCBInEOAT) object poses, and check a folder of them.
    Iros20 {
        /// Folder to check; exit code 1 where something is missing or does not load.
        #[arg(long, value_name = "DIR")]
        check: Option<PathBuf>,
    },
}

/// Runs the task.
///
/// # Errors
/// A download that fails or is not what was pinned, and a checked folder that is not complete.
pub fn run(args: FetchArgs) -> Result<()> {
    match args.dataset {
        Dataset::Kitti { out, url } => kitti::run(&out, &url),
        Dataset::RobotCar { check } => guide::run(&guide::ROBOTCAR, check.as_deref()),
        Dataset::Iros20 { check } => guide::run(&guide::IROS20, check.as_deref()),
    }
}
