//! A row for each log.

use super::super::judge::Judged;
use super::super::sink::{Sink, Target};
use super::super::summary::Summary;
use anyhow::Result;
use dose3::Report;

/// Names of the columns.
const COLUMNS: [&str; 21] = [
    "log",
    "path",
    "verdict",
    "chance",
    "alpha",
    "decided_by",
    "excess",
    "windows",
    "beyond",
    "mean_score",
    "worst_score",
    "threshold",
    "poses",
    "rate_hz",
    "first_row",
    "last_row",
    "start_s",
    "end_s",
    "calibration_chance",
    "notes",
    "error",
];

pub struct Csv {
    to: Target,
}

impl Csv {
    pub fn new(mut to: Target) -> Result<Self> {
        to.write(&line(COLUMNS.map(str::to_owned))?)?;
        Ok(Self { to })
    }
}

impl Sink for Csv {
    fn log(&mut self, judged: &Judged, _: bool) -> Result<()> {
        let path = judged.path.display().to_string();
        let row = match &judged.outcome {
            Ok((_, report)) => row(report, path),
            Err(error) => failed(error, path),
        };
        self.to.write(&line(row)?)
    }

    fn end(self: Box<Self>, _: &Summary) -> Result<()> {
        self.to.end()
    }
}

/// The cells of a log that was judged. Rows and seconds are those of the worst stretch.
fn row(report: &Report, path: String) -> [String; COLUMNS.len()] {
    let e = &report.evidence;
    let worst = report
        .segments
        .iter()
        .max_by_key(|segment| segment.worst_score);
    let of_worst = |text: fn(&dose3::report::Segment) -> String| worst.map_or(String::new(), text);
    let scores = report.windows.iter().map(|window| window.score);
    [
        report.log.name.clone(),
        path,
        report.verdict.name().to_owned(),
        e.p_value.to_string(),
        e.alpha.to_string(),
        e.deciding().name.clone(),
        e.excess.to_string(),
        e.windows.to_string(),
        e.beyond.to_string(),
        e.mean_score.value().to_string(),
        scores
            .max()
            .map_or(String::new(), |score| score.value().to_string()),
        e.threshold.value().to_string(),
        report.log.poses.to_string(),
        report.log.rate_hz.to_string(),
        of_worst(|segment| segment.place.first_row.to_string()),
        of_worst(|segment| segment.place.last_row.to_string()),
        of_worst(|segment| segment.place.start_s.to_string()),
        of_worst(|segment| segment.place.end_s.to_string()),
        report
            .whole
            .calibration
            .as_ref()
            .map_or(String::new(), |found| found.chance.to_string()),
        report.notes.join("; "),
        String::new(),
    ]
}

/// The cells of a log that could not be judged.
fn failed(error: &str, path: String) -> [String; COLUMNS.len()] {
    let mut row = [const { String::new() }; COLUMNS.len()];
    row[1] = path;
    row[2] = "error".to_owned();
    row[COLUMNS.len() - 1] = error.to_owned();
    row
}

fn line(cells: [String; COLUMNS.len()]) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(cells)?;
    Ok(String::from_utf8(writer.into_inner()?)?)
}
