//! Tasks of the DOSE3 workspace, run as `cargo xtask <task>`.

// A task talks to the person at the terminal; the libraries that are published never print.
#![allow(clippy::print_stdout, clippy::print_stderr)]

pub mod baselines;
pub mod bench;
pub mod benchmark;
pub mod ci;
pub mod fetch;
pub mod train;
