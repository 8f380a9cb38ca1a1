//! Arguments of `dose3 score`.

use super::{Computing, Reading};
use clap::{Args as ClapArgs, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    dose3 score --detector trusted.dose3 drive.txt\n  \
    dose3 score --detector trusted.dose3 drive.txt --html drive.html --mcap drive.mcap\n  \
    dose3 score --detector trusted.dose3 --fdr 0.05 --out results.csv drives/\n  \
    dose3 score --detector trusted.dose3 --output junit estimates/*.txt > dose3.xml\n  \
    dose3 score --detector trusted.dose3 --topic /odom bag/\n  \
    zcat drive.csv.gz | dose3 score --detector trusted.dose3 --format csv -\n  \
    find . -name '*.tum' | dose3 score --detector trusted.dose3 --list - --output jsonl")]
pub struct Score {
    /// Detector file
    #[arg(long, value_name = "FILE")]
    pub detector: PathBuf,
    /// Files or folders with logs to judge; - is a log on standard input
    #[arg(required_unless_present = "list", value_name = "LOG")]
    pub logs: Vec<PathBuf>,
    /// A file that names more logs: one path a line, or csv with a column `path` (from the list's own folder on);
    /// - is standard input
    #[arg(long, value_name = "FILE")]
    pub list: Option<PathBuf>,
    /// Share of trusted logs that may be rejected (default: the detector's)
    #[arg(long, value_name = "SHARE")]
    pub alpha: Option<f64>,
    /// For many logs: call those that differ if of all that are called at most this share may be false alarms (Benjamini
    /// and Hochberg). Exit code and junit go by it, where each log's own verdict goes by alpha
    #[arg(long, value_name = "SHARE")]
    pub fdr: Option<f64>,
    #[command(flatten)]
    pub showing: Showing,
    /// The command as it was given.
    #[arg(skip)]
    pub command: String,
    #[command(flatten)]
    pub reading: Reading,
    #[command(flatten)]
    pub computing: Computing,
}

/// What is shown, and how.
#[derive(Debug, ClapArgs)]
#[command(next_help_heading = "Results")]
pub struct Showing {
    /// Form of the results on standard output
    #[arg(long, value_enum, default_value_t, value_name = "FORM")]
    pub output: OutputName,
    /// The same as --output json
    #[arg(long, conflicts_with = "output")]
    pub json: bool,
    /// Write the results to this file as well; its ending says the form: .json, .jsonl, .csv, .xml (JUnit), .txt,
    /// .parquet. Several times for several files
    #[arg(long, value_name = "FILE")]
    pub out: Vec<PathBuf>,
    /// A page to look at, with the path, the scores and the reasons: FILE.html; of several logs FILE.html lists them and
    /// their pages lie in the folder FILE
    #[arg(long, value_name = "FILE.html")]
    pub html: Option<PathBuf>,
    /// A recording for Foxglove, PlotJuggler or rerun: poses, scores, motion against what is trusted, bad stretches;
    /// of several logs each has its own in the folder FILE
    #[arg(long, value_name = "FILE.mcap")]
    pub mcap: Option<PathBuf>,
    /// Replace what lies there, whatever it is
    #[arg(long)]
    pub force: bool,
    /// Of many logs too everything that is known of each, as of a single one
    #[arg(short, long)]
    pub verbose: bool,
    /// Show every window
    #[arg(long)]
    pub windows: bool,
    /// Show only logs that are out of distribution or cannot be judged
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,
}

impl Showing {
    /// The form of the results on standard output.
    pub fn form(&self) -> OutputName {
        match self.json {
            true => OutputName::Json,
            false => self.output,
        }
    }
}

/// A form of results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum OutputName {
    /// A line for each log, for people; of a single log everything
    #[default]
    Table,
    /// One document with everything
    Json,
    /// One JSON document a line for each log, as soon as it is judged
    Jsonl,
    /// A row for each log
    Csv,
    /// An XML file that continuous integration shows: a test for each log
    Junit,
    /// A Parquet file with a row for each log, stretches and notes as lists; only as --out results.parquet
    #[value(skip)]
    Parquet,
}
