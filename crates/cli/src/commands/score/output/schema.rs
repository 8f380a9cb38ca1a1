//! JSON schemas of what `score` writes.

use super::super::summary::{Counts, Failure};
use super::json::Head;
use super::jsonl::Line;
use dose3::Report;
use schemars::{JsonSchema, Schema, schema_for};

/// The document of `score --output json`, which is written log by log.
#[derive(JsonSchema)]
#[expect(dead_code, reason = "stands for its schema")]
struct Document {
    #[serde(flatten)]
    head: Head,
    /// The logs that were judged, in order.
    logs: Vec<Report>,
    /// Logs that could not be read or judged.
    errors: Vec<Failure>,
    /// Files in folders that are no logs.
    skipped: Vec<Failure>,
    /// Counts over all logs.
    summary: Counts,
}

/// Of the document, and of a line of `--output jsonl`.
pub fn schemas() -> [(&'static str, Schema); 2] {
    [
        ("score.json", schema_for!(Document)),
        ("score-line.json", schema_for!(Line<'static>)),
    ]
}
