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
    /// The AUROC table of the paper, on real data where it is at hand, else on synthetic data.
    Benchmark(xtask::benchmark::BenchmarkArgs),
    /// Speed of the engine beside burn, PyTorch and the machine's own sgemm.
    Bench(xtask::bench::BenchArgs),
    /// The whole check of this repository: formatting, tests, lints, documentation.
    Ci,
    /// Train the weights that ship with the program (about ten minutes on 2 idle cores).
    TrainReleaseModel(xtask::train::ReleaseArgs),
    /// Train the joint network of body motion (about ten minutes on 2 idle cores)
    TrainJoint(xtask::joint::JointArgs),
    /// Train the learned baselines, Glow and JEM, on KITTI (needs the feature `baselines`)
    TrainBaselines(xtask::baselines::TrainArgs),
    /// Download KITTI poses; say how to get RobotCar and IROS20, and check what is there.
    FetchData(xtask::fetch::FetchArgs),
}

fn main() -> ExitCode {
    let result = match Cli::parse().task {
        Task::Benchmark(args) => xtask::benchmark::run(&args),
        Task::Bench(args) => xtask::bench::run(&args),
        Task::Ci => xtask::ci::run(),
        Task::TrainReleaseModel(args) => xtask::train::run(&args),
        Task::TrainJoint(args) => xtask::joint::run(&args),
        Task::TrainBaselines(args) => xtask::baselines::run(&args),
        Task::FetchData(args) => xtask::fetch::run(args),
    };
    match result.and_then(|()| dose3_study::said::whole()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
