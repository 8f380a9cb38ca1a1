//! False alarms: every log of a set judged by a detector that was fitted on the others.

use super::methods::METHODS;
use super::prober::{SetRows, Settings, fit};
use super::protocol::LogSet;
use anyhow::Result;
use serde::Serialize;

/// What a row says of the logs of a set, each left out in turn.
#[derive(Clone, Debug, Serialize)]
pub struct Alarms {
    /// Letter of the set.
    pub set: char,
    /// Key of the row.
    pub method: &'static str,
    /// Logs judged.
    pub logs: usize,
    /// Logs called OOD.
    pub ood: Vec<String>,
    /// Share of all windows beyond the window threshold.
    pub windows_beyond: f64,
    /// How many logs each test decided.
    pub decided: Vec<(String, usize)>,
}

/// Leaves out one group of logs after the other.
///
/// # Errors
/// Too few rows.
pub fn run(
    set: &LogSet,
    rows: &SetRows,
    methods: &[usize],
    overlap: usize,
    settings: &Settings,
    tick: &dyn Fn(),
) -> Result<Vec<Alarms>> {
    let groups = set.groups();
    let count = groups.iter().max().map_or(0, |g| g + 1);
    let mut all = Vec::new();
    for &method in methods {
        let mut alarms = Alarms {
            set: set.letter,
            method: METHODS[method].key,
            logs: 0,
            ood: Vec::new(),
            windows_beyond: 0.0,
            decided: Vec::new(),
        };
        let mut windows = 0;
        let mut beyond = 0;
        for left_out in 0..count {
            let others = rows.select(method, |_, w| groups[w.trajectory] != left_out);
            let detector = fit(method, &others, &groups, overlap, settings)?;
            for log in (0..set.logs.len()).filter(|&log| groups[log] == left_out) {
                let (own, spots) = rows.select(method, |_, w| w.trajectory == log);
                // A log shorter than a window cannot be judged.
                if own.is_empty() {
                    continue;
                }
                let stretches: Vec<usize> = spots.iter().map(|spot| spot.stretch).collect();
                let verdict = detector.judge(&own, &stretches)?;
                alarms.logs += 1;
                windows += verdict.windows;
                beyond += verdict.beyond;
                if verdict.verdict.is_ood() {
                    alarms.ood.push(set.raw[log].name.clone());
                }
                let test = &verdict.deciding().name;
                match alarms.decided.iter_mut().find(|(name, _)| name == test) {
                    Some((_, logs)) => *logs += 1,
                    None => alarms.decided.push((test.clone(), 1)),
                }
            }
            tick();
        }
        alarms.windows_beyond = beyond as f64 / windows.max(1) as f64;
        all.push(alarms);
    }
    Ok(all)
}
