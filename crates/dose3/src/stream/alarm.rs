//! Alarms as they are told: since when, how bad, why.

use dose3_ood::alarm::RaisedBy;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What is said of an alarm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alarm {
    /// Whether it is raised, stands, or has ended.
    pub alarm: AlarmKind,
    /// Which alarm of the stream it is, from 1.
    pub number: u64,
    /// Stamp of the first pose that seems to be wrong, nanoseconds.
    pub since_ns: i64,
    /// Stamp of the pose at which it was raised.
    pub raised_ns: i64,
    /// Stamp of the pose that this is said at.
    pub at_ns: i64,
    /// Stamp by which the fault had ended; none while it stands.
    pub ended_ns: Option<i64>,
    /// What raised it: one window, a run of them, evidence that added up, or a single number of a few steps.
    pub raised_by: RaisedBy,
    /// How far the last window is: 0 is the median of trusted windows, 1 what one in a thousand reaches. Of a span of a
    /// few steps 0 is what nine trusted ones of ten do not reach.
    pub excess: f64,
    /// The same of the worst window so far.
    pub worst_excess: f64,
    /// Chance of the worst window among trusted ones.
    pub worst_chance: f64,
    /// Stamps of the first and last pose of the worst window.
    pub worst_window_ns: [i64; 2],
    /// The test that the worst window is farthest out in; `numbers` where a span of a few steps is the worst.
    pub test: String,
    /// What is unusual about the worst window in plain words, the strongest first; as of when the alarm was raised, or of
    /// a window that is far worse.
    pub why: Vec<String>,
    /// Groups of statistics that are unusual in the worst window, the strongest first; the number of a span that is.
    pub groups: Vec<GroupChance>,
}

/// Whether an alarm is raised, stands or has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlarmKind {
    /// It was raised now.
    Raised,
    /// It stands.
    Standing,
    /// The fault has ended.
    Ended,
}

/// A group of statistics that is unusual.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroupChance {
    /// Its name.
    pub group: String,
    /// Chance of its score among trusted windows.
    pub chance: f64,
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = |from: i64, to: i64| to.saturating_sub(from) as f64 * 1e-9;
        let stamp = |ns: i64| format!("{:.3} s", ns as f64 * 1e-9);
        match self.alarm {
            AlarmKind::Raised => write!(
                f,
                "alarm {}: since {} the motion is unlike the trusted logs",
                self.number,
                stamp(self.since_ns)
            )?,
            AlarmKind::Standing => write!(
                f,
                "alarm {} stands, {:.1} s since its start",
                self.number,
                seconds(self.since_ns, self.at_ns)
            )?,
            AlarmKind::Ended => write!(
                f,
                "alarm {} has ended: the motion was unlike the trusted logs from {} to about {}",
                self.number,
                stamp(self.since_ns),
                stamp(self.ended_ns.unwrap_or(self.at_ns))
            )?,
        }
        write!(
            f,
            "; at worst {:.1} times as far as one trusted window in a thousand",
            self.worst_excess
        )?;
        match (self.why.first(), self.groups.first()) {
            (Some(why), _) => write!(f, "; {why}"),
            (None, Some(first)) => write!(f, ", mostly by {}", first.group),
            (None, None) => Ok(()),
        }
    }
}
