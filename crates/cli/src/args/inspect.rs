//! Arguments of `dose3 inspect`.

use super::Reading;
use clap::Args as ClapArgs;
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    dose3 inspect drive.txt\n  \
    dose3 inspect recording.mcap --topic /odom\n  \
    dose3 inspect recording.bag --tf map:base_link --json")]
pub struct Inspect {
    /// Files or folders with logs; detectors; models
    #[arg(required = true, value_name = "LOG|DETECTOR|MODEL")]
    pub logs: Vec<PathBuf>,
    /// One JSON document instead of text
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub reading: Reading,
}
