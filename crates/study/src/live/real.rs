//! Estimates of an odometry that diverges, beside another one's of the same recordings.

use super::Fitted;
use crate::data::DataRoot;
use crate::verdicts::real::{numbers, read, recording};
use anyhow::Result;
use dose3_datasets::Trajectory;
use dose3_ood::alarm::RaisedBy;
use serde::Serialize;

/// Poses of the windows of verdicts.
const POSES: usize = 129;
/// An estimate has diverged where it travels so many times farther in a second than the trusted estimate of the recording
/// does in any.
const FARTHER: f64 = 2.0;

/// The folder `vio` at the model's rate.
pub struct Vio {
    /// Trusted estimates.
    pub trusted: Vec<Trajectory>,
    /// Number of the recording of each.
    pub groups: Vec<usize>,
    others: Vec<Trajectory>,
}

/// One diverged estimate.
#[derive(Clone, Debug, Serialize)]
pub struct Diverged {
    /// Its name.
    pub log: String,
    /// Whether the verdict on the whole log calls it.
    pub called: bool,
    /// Seconds from the start of the log to where it has diverged; none where it never travels that fast.
    pub onset: Option<f64>,
    /// Seconds from the start of the log to the end of its first window.
    pub first_window: f64,
    /// Seconds from the start of the log to the first alarm.
    pub alarm: Option<f64>,
    /// Which watcher raised it.
    pub by: Option<RaisedBy>,
}

impl Diverged {
    /// Seconds from where it has diverged, or from the first window where that comes later, to the alarm.
    pub fn delay(&self) -> Option<f64> {
        let from = self.onset.unwrap_or(0.0).max(self.first_window);
        Some((self.alarm? - from).max(0.0))
    }
}

impl Vio {
    /// `None` without the folder.
    pub fn read(root: &DataRoot, hertz: f64) -> Result<Option<Self>> {
        let folder = root.path.join("vio");
        if !folder.is_dir() {
            return Ok(None);
        }
        let mut left = Vec::new();
        let trusted = read(&folder.join("trusted"), hertz, POSES, &mut left)?;
        let recordings: Vec<String> = trusted.iter().map(|log| recording(&log.name)).collect();
        Ok(Some(Self {
            groups: numbers(&recordings),
            trusted,
            others: read(&folder.join("diverged"), hertz, POSES, &mut left)?,
        }))
    }

    /// Trusted logs by rig: what their names begin with.
    pub fn rigs(&self) -> Vec<Vec<usize>> {
        let rig = |log: &Trajectory| log.name.split('_').next().unwrap_or_default().to_owned();
        let mut rigs: Vec<(String, Vec<usize>)> = Vec::new();
        for (index, log) in self.trusted.iter().enumerate() {
            let name = rig(log);
            match rigs.iter_mut().find(|(known, _)| *known == name) {
                Some((_, logs)) => logs.push(index),
                None => rigs.push((name, vec![index])),
            }
        }
        rigs.into_iter().map(|(_, logs)| logs).collect()
    }

    /// The diverged estimates of the recordings of some trusted logs.
    pub fn diverged(&self, tested: &[usize], fitted: &Fitted) -> Result<Vec<Diverged>> {
        let first = fitted.monitor.first_look() - 1;
        let mut found = Vec::new();
        for log in &self.others {
            let of = recording(&log.name);
            let beside = tested
                .iter()
                .find(|t| recording(&self.trusted[**t].name) == of);
            let Some(trusted) = beside.map(|t| &self.trusted[*t]) else {
                continue;
            };
            let start = log.stamps[0];
            let seconds = |ns: i64| (ns - start) as f64 * 1e-9;
            let usual = paths(trusted).map(|(_, path)| path).fold(0.0, f64::max);
            let onset = paths(log).find(|(_, path)| *path > FARTHER * usual);
            let (heard, _) = fitted.listen(log)?;
            found.push(Diverged {
                log: log.name.clone(),
                called: fitted.detector.judge(log)?.verdict.differs(),
                onset: onset.map(|(stamp, _)| seconds(stamp)),
                first_window: log.stamps.get(first).map_or(0.0, |s| seconds(*s)),
                alarm: heard.first().map(|alarm| seconds(alarm.raised.raised_ns)),
                by: heard.first().map(|alarm| alarm.raised.raised_by),
            });
        }
        Ok(found)
    }
}

/// Groups numbered from 0 on, in order of their first members.
pub fn numbered(groups: &[usize]) -> Vec<usize> {
    let mut known = Vec::new();
    let number = |group: &usize| match known.iter().position(|k| k == group) {
        Some(number) => number,
        None => {
            known.push(*group);
            known.len() - 1
        }
    };
    groups.iter().map(number).collect()
}

/// Metres travelled in the second before each pose.
fn paths(log: &Trajectory) -> impl Iterator<Item = (i64, f64)> + '_ {
    let mut first = 0;
    (1..log.len()).map(move |last| {
        while log.stamps[last] - log.stamps[first] > 1_050_000_000 {
            first += 1;
        }
        let steps = log.poses[first..=last].windows(2);
        let path = steps.map(|pair| (pair[1].translation - pair[0].translation).norm());
        (log.stamps[last], path.sum())
    })
}
