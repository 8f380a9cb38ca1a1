//! Alarms on sound logs that were left out by group.

use super::Fitted;
use crate::verdicts::defects::known;
use anyhow::Result;
use dose3_datasets::Trajectory;
use dose3_ood::alarm::RaisedBy;
use rayon::prelude::*;
use serde::Serialize;

/// Seconds around an alarm in which a known defect of the reference is looked for.
const AROUND: f64 = 15.0;

/// What was heard of one sound log.
#[derive(Clone, Debug, Serialize)]
pub struct Sound {
    /// Name of the set.
    pub set: &'static str,
    /// Name of the log.
    pub log: String,
    /// Hours of windows: number of windows times the time from one to the next.
    pub hours: f64,
    /// The alarms.
    pub alarms: Vec<FalseAlarm>,
}

/// One alarm.
#[derive(Clone, Debug, Serialize)]
pub struct FalseAlarm {
    /// Seconds from the start of the log.
    pub at: f64,
    /// What is known to be wrong with the reference there.
    pub defect: Option<String>,
    /// How far its worst window is.
    pub excess: f64,
    /// What drove it.
    pub reason: String,
    /// Which watcher raised it.
    pub by: RaisedBy,
}

/// All tested logs.
pub fn run(
    name: &'static str,
    (letter, logs, tested): (char, &[Trajectory], &[usize]),
    fitted: &Fitted,
) -> Result<Vec<Sound>> {
    let every = fitted.every();
    tested
        .par_iter()
        .map(|&log| {
            let log = &logs[log];
            let (heard, windows) = fitted.listen(log)?;
            let start = log.stamps.first().copied().unwrap_or_default();
            let alarms = heard.iter().map(|alarm| {
                let (from, to) = (alarm.raised.since_ns, alarm.raised.raised_ns);
                let around = (AROUND * 1e9) as i64;
                let first = log.stamps.partition_point(|s| *s < from - around);
                let last = log.stamps.partition_point(|s| *s <= to);
                FalseAlarm {
                    at: (to - start) as f64 * 1e-9,
                    defect: known(letter, &log.name, first..last, &log.cut(first..last)),
                    excess: alarm.raised.worst_excess,
                    by: alarm.raised.raised_by,
                    reason: alarm
                        .raised
                        .groups
                        .first()
                        .map(|first| first.group.clone())
                        .unwrap_or_default(),
                }
            });
            Ok(Sound {
                set: name,
                log: log.name.clone(),
                hours: windows as f64 * every / 3600.0,
                alarms: alarms.collect(),
            })
        })
        .collect()
}
