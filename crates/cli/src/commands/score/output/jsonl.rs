//! A JSON document a line, each as soon as its log is judged.

use super::super::judge::Judged;
use super::super::sink::{Sink, Target};
use super::super::summary::{Failure, Summary};
use anyhow::Result;
use dose3::Report;
use serde::Serialize;

/// A line: what is said of the log, or what is wrong with it.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Line<'a> {
    /// A log that was judged.
    Judged {
        /// Its file.
        path: String,
        #[serde(flatten)]
        report: &'a Report,
    },
    /// A log that could not be read or judged.
    Failed(Failure),
}

pub struct Jsonl {
    to: Target,
}

impl Jsonl {
    pub fn new(to: Target) -> Self {
        Self { to }
    }
}

impl Sink for Jsonl {
    fn log(&mut self, judged: &Judged, _: bool) -> Result<()> {
        let path = judged.path.display().to_string();
        let line = match &judged.outcome {
            Ok((_, report)) => Line::Judged { path, report },
            Err(error) => Line::Failed(Failure {
                path,
                error: error.clone(),
            }),
        };
        self.to
            .write(&format!("{}\n", serde_json::to_string(&line)?))
    }

    fn end(self: Box<Self>, _: &Summary) -> Result<()> {
        self.to.end()
    }
}
