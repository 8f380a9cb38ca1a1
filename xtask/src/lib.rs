//! Tasks of the DOSE3 workspace, run as `cargo xtask <task>`.

// A task talks to the person at the terminal; the libraries that are published never print.
#![allow(clippy::print_stdout, clippy::print_stderr)]

pub mod baselines;
pub mod bench;
pub mod benchmark;
pub mod ci;
pub mod fetch;
pub mod joint;
pub mod train;

/// Sizes rayon's global pool, once, at the start of a command; 0 means all cores. Results do not depend on it.
///
/// # Errors
/// A pool that is running already.
pub fn use_threads(threads: usize) -> anyhow::Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    Ok(pool.build_global()?)
}
