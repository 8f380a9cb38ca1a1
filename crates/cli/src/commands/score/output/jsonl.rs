//! A JSON document a line, each as soon as its log is judged.

use super::super::judge::Judged;
use super::super::sink::{Sink, Target};
use super::super::summary::Summary;
use anyhow::Result;
use dose3::Report;
use serde::Serialize;

/// A line: what is said of the log, or what is wrong with it.
#[derive(Serialize)]
struct Line<'a> {
    path: String,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    report: Option<&'a Report>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<&'a str>,
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
        let line = Line {
            path: judged.path.display().to_string(),
            report: judged.report(),
            error: judged.outcome.as_ref().err().map(String::as_str),
        };
        self.to
            .write(&format!("{}\n", serde_json::to_string(&line)?))
    }

    fn end(self: Box<Self>, _: &Summary) -> Result<()> {
        self.to.end()
    }
}
