//! One file after the other: read, and what the detector says of its logs.

use super::super::read_options;
use crate::args::Score;
use crate::explain::explain;
use crate::terminal::Bar;
use anyhow::Result;
use dose3::logs::{LogFile, ReadOptions};
use dose3::{Detector, JudgeOptions, Report, Trajectory};
use indicatif::ProgressBar;
use std::path::PathBuf;

/// A log, and what became of it.
#[derive(Debug)]
pub struct Judged {
    /// Its file.
    pub path: PathBuf,
    /// The log as it was read, with what is said of it; else what is wrong.
    pub outcome: Result<(Trajectory, Report), String>,
}

impl Judged {
    /// What is said of the log, where it could be judged.
    pub fn report(&self) -> Option<&Report> {
        self.outcome.as_ref().ok().map(|(_, report)| report)
    }

    /// The log's name; the path of one that could not be read.
    pub fn name(&self) -> String {
        match &self.outcome {
            Ok((log, _)) => log.name.clone(),
            Err(_) => self.path.display().to_string(),
        }
    }
}

/// How logs are judged, on any thread.
pub struct Judge<'a> {
    reading: ReadOptions,
    options: JudgeOptions,
    bar: &'a ProgressBar,
    /// Whether the bar shows windows, not logs.
    single: bool,
}

impl<'a> Judge<'a> {
    pub fn new(args: &Score, bar: &'a ProgressBar, single: bool) -> Self {
        Self {
            reading: read_options(&args.reading),
            options: JudgeOptions { alpha: args.alpha },
            bar,
            single,
        }
    }

    /// The logs of a file, at least one entry. An error of one log is a result like any other.
    pub fn file(&self, detector: &Detector, file: &LogFile) -> Vec<Judged> {
        let logs = file.read(&self.reading).into_iter();
        logs.map(|log| Judged {
            path: file.path.clone(),
            outcome: self
                .judge(detector, log)
                .map_err(|error| explain(&anyhow::Error::from(error))),
        })
        .collect()
    }

    fn judge(
        &self,
        detector: &Detector,
        log: dose3::Result<Trajectory>,
    ) -> dose3::Result<(Trajectory, Report)> {
        let log = log?;
        let report = match self.single {
            true => detector.judge_with(&log, &self.options, &mut Bar(self.bar.clone())),
            false => detector.judge_with(&log, &self.options, &mut ()),
        }?;
        Ok((log, report))
    }
}
