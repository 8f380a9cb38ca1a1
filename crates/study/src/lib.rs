//! The study: data sets, networks, rows, injected faults, learned baselines, and the tables, page and figures
//! that are made of what was measured.

// A benchmark talks to the person at the terminal; the libraries that are published never print.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod all;
pub mod benchmark;
mod cells;
pub mod data;
pub mod faults;
pub mod learned;
pub mod networks;
mod paper;
pub mod provenance;
pub mod release;
mod report;
mod sets;
