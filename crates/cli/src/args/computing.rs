//! Where networks run.

use clap::Args as ClapArgs;
use dose3::backend::Backend;

/// Where networks run.
#[derive(Clone, Copy, Debug, ClapArgs)]
#[command(next_help_heading = "Computing")]
pub struct Computing {
    /// Where the networks run
    #[arg(long, value_name = "BACKEND", default_value_t)]
    pub backend: Backend,
    /// Threads (0: all cores); results do not depend on it
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
}
