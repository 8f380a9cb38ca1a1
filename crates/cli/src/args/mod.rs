//! The command line: a file for each subcommand, and for what several share.

// What is written above an item is shown as help.
#![allow(missing_docs)]

mod computing;
mod demo;
mod eval;
mod fit;
mod inspect;
mod reading;
mod sample;
mod score;
mod shell;
mod train;
mod watch;

pub use computing::Computing;
pub use demo::Demo;
pub use eval::Eval;
pub use fit::Fit;
pub use inspect::Inspect;
pub use reading::{FrameOf, Reading, StampName};
pub use sample::Sample;
pub use score::{OutputName, Score, Showing};
pub use shell::{Completions, Man};
pub use train::{RotationNoiseName, RotationProcessName, ScheduleName, Train};
pub use watch::Watch;

use clap::{Parser, Subcommand};

/// Is this pose log like the logs I trust, and if not, where and why?
#[derive(Debug, Parser)]
#[command(name = "dose3", version, max_term_width = 100)]
#[command(after_help = "Examples:\n  \
      dose3 fit --trusted good/ --out trusted.dose3\n  \
      dose3 score --detector trusted.dose3 new/\n\n\
    Exit codes: 0 in distribution (or done); 1 a log is out of distribution; 2 an error, or a log that could \
    not be judged, whatever the others are.\n\
    Formats are told by content: KITTI, TUM, EuRoC, RobotCar, csv with named columns, matrices, JSON, \
    npy, npz, IROS20, g2o, COLMAP, NeRF, Open3D; MCAP, ROS 1 and ROS 2 bags, PX4 ULog; .gz and .zst of text; \
    - is standard input.")]
pub struct Args {
    /// What to do
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// See it work in ten seconds: generated logs, a detector, two verdicts, and a page to look at
    Demo(Demo),
    /// Train the two noise estimators on pose logs (trained models are built in)
    Train(Train),
    /// Learn what trusted logs look like to a model, without retraining it
    Fit(Fit),
    /// Judge logs: verdict, p-value, where and why
    Score(Score),
    /// Measure a detector on logs known to be in and out of distribution
    Eval(Eval),
    /// Show what a log holds, and what had to be repaired when reading it
    Inspect(Inspect),
    /// Generate pose sequences from a model
    Sample(Sample),
    /// Judge poses as they come on standard input, and raise an alarm: JSON lines
    Watch(Watch),
    /// Print completions for a shell
    Completions(Completions),
    /// Write manual pages
    Man(Man),
}

impl Command {
    /// Threads asked for; 0 for all cores.
    pub fn threads(&self) -> usize {
        match self {
            Self::Train(a) => a.computing.threads,
            Self::Fit(a) => a.computing.threads,
            Self::Score(a) => a.computing.threads,
            Self::Eval(a) => a.computing.threads,
            Self::Sample(a) => a.computing.threads,
            Self::Inspect(_) | Self::Completions(_) | Self::Man(_) | Self::Demo(_) => 0,
            // One stream is judged on one core.
            Self::Watch(_) => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Args;
    use clap::{CommandFactory, Parser};

    /// The words of a shell line: single quotes keep blanks.
    fn words(line: &str) -> Vec<String> {
        let quoted = line.split('\'').enumerate();
        let parts = quoted.flat_map(|(index, part)| match index % 2 {
            1 => vec![part.to_owned()],
            _ => part.split_whitespace().map(str::to_owned).collect(),
        });
        parts.collect()
    }

    #[test]
    fn every_subcommand_has_examples_and_they_are_valid() {
        let command = Args::command();
        let mut valid = 0;
        for sub in std::iter::once(&command).chain(command.get_subcommands()) {
            let help = sub
                .get_after_help()
                .map(ToString::to_string)
                .unwrap_or_default();
            let lines = help.lines().filter(|line| line.starts_with("  "));
            let lines: Vec<&str> = lines.filter(|line| line.contains("dose3 ")).collect();
            assert!(!lines.is_empty(), "{}: no example", sub.get_name());
            for line in lines {
                let own = line.find("dose3 ").map_or("", |start| &line[start..]);
                let own = [" > ", " < ", " | "]
                    .into_iter()
                    .fold(own, |own, end| own.split(end).next().unwrap_or_default());
                let parsed = Args::try_parse_from(words(own));
                let error = parsed.err().map(|e| e.to_string()).unwrap_or_default();
                assert!(error.is_empty(), "{line}\n{error}");
                valid += 1;
            }
        }
        assert!(valid > 15, "{valid}");
    }

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }
}
