//! `cargo xtask <task>`: the command line of the tasks in the library beside it.

#![allow(clippy::print_stderr)]

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use dose3::backend::use_threads;

#[derive(Debug, Parser)]
#[command(name = "cargo xtask", about = "Tasks of the DOSE3 workspace")]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// The AUROC table of the paper, on real data where it is at hand, else on synthetic data.
    Benchmark(dose3_study::benchmark::BenchmarkArgs),
    /// Speed of the engine beside burn, PyTorch and the machine's own sgemm.
    Bench(xtask::bench::BenchArgs),
    /// Train the weights that ship with the program (about ten minutes on 2 idle cores).
    TrainReleaseModel(dose3_study::release::ReleaseArgs),
    /// Train the learned baselines, Glow and JEM, on KITTI (needs the feature `baselines`)
    TrainBaselines(dose3_study::learned::TrainArgs),
    /// Scores of the learned baselines for the windows of the benchmark
    #[command(hide = true)]
    BaselineScores(dose3_study::learned::ScoresArgs),
    /// Download KITTI poses; say how to get RobotCar and IROS20, and check what is there.
    FetchData(xtask::fetch::FetchArgs),
}

fn main() -> ExitCode {
    let result = match Cli::parse().task {
        Task::Benchmark(args) => use_threads(args.threads)
            .map_err(anyhow::Error::from)
            .and_then(|()| dose3_study::benchmark::run(&args)),
        Task::Bench(args) => xtask::bench::run(&args),
        Task::TrainReleaseModel(args) => use_threads(args.threads)
            .map_err(anyhow::Error::from)
            .and_then(|()| dose3_study::release::run(&args)),
        Task::TrainBaselines(args) => use_threads(args.threads)
            .map_err(anyhow::Error::from)
            .and_then(|()| dose3_study::learned::train(&args)),
        Task::BaselineScores(args) => use_threads(args.request.threads)
            .map_err(anyhow::Error::from)
            .and_then(|()| dose3_study::learned::write_scores(&args)),
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
