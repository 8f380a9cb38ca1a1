//! One JSON document, written log by log.

use super::super::judge::Judged;
use super::super::sink::{Sink, Target};
use super::super::summary::{Counts, Failure, Summary};
use crate::args::Score;
use anyhow::{Context, Result};
use dose3::Detector;
use dose3::table::Versions;
use serde::{Deserialize, Serialize};

/// What the document says before the logs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Head {
    /// The detector's file.
    pub detector: String,
    /// Its statistics.
    pub statistics: String,
    /// Seed of its noise.
    pub seed: u64,
    /// Noise draws a window.
    pub draws: usize,
    /// Diffusion steps visited.
    pub steps: usize,
    /// What made the results, for tables.
    #[serde(skip)]
    pub versions: Versions,
}

/// What it says behind them.
#[derive(Serialize)]
struct Tail<'a> {
    errors: &'a [Failure],
    skipped: &'a [Failure],
    summary: &'a Counts,
}

impl Head {
    pub fn new(args: &Score, detector: &Detector) -> Self {
        let plan = detector.header().plan();
        Self {
            detector: args.detector.display().to_string(),
            statistics: detector.header().statistics.config().statistics.to_string(),
            seed: plan.seed,
            draws: plan.draws,
            steps: plan.steps,
            versions: Versions::of(detector),
        }
    }
}

pub struct Json {
    to: Target,
    /// Whether a log was written.
    any: bool,
}

impl Json {
    pub fn new(mut to: Target, head: &Head) -> Result<Self> {
        // The list of logs stands within the head's braces.
        let head = serde_json::to_string_pretty(head)?;
        let open = head.strip_suffix("\n}").context("the head is an object")?;
        to.write(&format!("{open},\n  \"logs\": ["))?;
        Ok(Self { to, any: false })
    }
}

impl Sink for Json {
    fn log(&mut self, judged: &Judged, _: bool) -> Result<()> {
        let Some(report) = judged.report() else {
            return Ok(());
        };
        let text = serde_json::to_string_pretty(report)?.replace('\n', "\n    ");
        let comma = if self.any { "," } else { "" };
        self.any = true;
        self.to.write(&format!("{comma}\n    {text}"))
    }

    fn end(mut self: Box<Self>, summary: &Summary) -> Result<()> {
        let tail = serde_json::to_string_pretty(&Tail {
            errors: &summary.errors,
            skipped: &summary.skipped,
            summary: &summary.counts,
        })?;
        let rest = tail.strip_prefix("{\n").context("the tail is an object")?;
        let close = if self.any { "\n  ]" } else { "]" };
        self.to.write(&format!("{close},\n{rest}\n"))?;
        self.to.end()
    }
}
