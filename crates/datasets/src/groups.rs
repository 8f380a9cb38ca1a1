//! Logs that belong together: of one recording or one route.

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

    /// For each of `windows` of these logs the number of its group.
    pub fn of_windows(&self, windows: &[Window]) -> Vec<usize> {
        windows.iter().map(|w| self.of_log[w.trajectory]).collect()
    }
}
