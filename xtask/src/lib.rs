//! Tasks of the DOSE3 workspace, run as `cargo xtask <task>`.

// A task talks to the person at the terminal; the libraries of the workspace never print.
#![allow(clippy::print_stdout, clippy::print_stderr)]

pub mod bench;
pub mod fetch;
