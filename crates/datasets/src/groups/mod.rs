//! Logs that belong together: of one recording or one route.

mod overlap;
mod pattern;

pub use overlap::{Overlap, Shared, overlaps};
pub use pattern::GroupBy;

use crate::{Trajectory, Window};

/// The groups of some logs, numbered in the order in which they first appear.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LogGroups {
    /// Names of the groups.
    pub names: Vec<String>,
    /// For each log the number of its group.
    pub of_log: Vec<usize>,
}

impl LogGroups {
    /// The groups of `logs`.
    ///
    /// ```
    /// use dose3_datasets::{LogGroups, synthetic};
    ///
    /// let mut logs = synthetic::suite(synthetic::Platform::Drone, 3, 1);
    /// logs[2].group = logs[0].group.clone();
    /// assert_eq!(LogGroups::of(&logs).of_log, [0, 1, 0]);
    /// ```
    pub fn of<'a>(logs: impl IntoIterator<Item = &'a Trajectory>) -> Self {
        let mut groups = Self::default();
        for log in logs {
            let known = groups.names.iter().position(|name| *name == log.group);
            groups.of_log.push(known.unwrap_or(groups.names.len()));
            if known.is_none() {
                groups.names.push(log.group.clone());
            }
        }
        groups
    }

    /// Makes one group of those that share a recording, as [`overlaps`] of the same logs found.
    #[must_use]
    pub fn joined(self, overlaps: &[Overlap]) -> Self {
        let mut of_log = self.of_log;
        for pair in overlaps.iter().filter(|pair| pair.shared.is_recording()) {
            let (a, b) = (of_log[pair.first], of_log[pair.second]);
            let (keep, drop) = (a.min(b), a.max(b));
            of_log
                .iter_mut()
                .filter(|g| **g == drop)
                .for_each(|g| *g = keep);
        }
        let mut joined = Self::default();
        let mut numbers: Vec<Option<usize>> = vec![None; self.names.len()];
        for group in of_log {
            let number = *numbers[group].get_or_insert_with(|| {
                joined.names.push(self.names[group].clone());
                joined.names.len() - 1
            });
            joined.of_log.push(number);
        }
        joined
    }

    /// For each of `windows` of these logs the number of its group.
    pub fn of_windows(&self, windows: &[Window]) -> Vec<usize> {
        windows.iter().map(|w| self.of_log[w.trajectory]).collect()
    }
}
