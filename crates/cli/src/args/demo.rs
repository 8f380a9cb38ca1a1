//! Arguments of `dose3 demo`.

use clap::Args as ClapArgs;
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    dose3 demo\n  \
    dose3 demo --out /tmp/dose3-demo --force")]
pub struct Demo {
    /// Folder for the logs, the detector and the pages
    #[arg(long, value_name = "DIR", default_value = "dose3-demo")]
    pub out: PathBuf,
    /// Replace what an earlier run left there
    #[arg(long)]
    pub force: bool,
}
