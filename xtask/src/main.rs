//! `cargo xtask <task>`: the command line of the tasks in the library beside it.

#![allow(clippy::print_stderr)]

use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Debug, Parser)]
#[command(name = "cargo xtask", about = "Tasks of the DOSE3 workspace")]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Download KITTI poses; say how to get RobotCar and IROS20, and check what is there.
    FetchData(xtask::fetch::FetchArgs),
}

fn main() -> ExitCode {
    let result = match Cli::parse().task {
        Task::FetchData(args) => xtask::fetch::run(args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
