//! Windows of consecutive poses.

use serde::{Deserialize, Serialize};

use crate::stretch::stretches;
use crate::{Error, Trajectory};

/// `length` consecutive poses of one log, from `start` on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Window {
    /// Index of the log in the slice that the windows were cut from.
    pub trajectory: usize,
    /// Index of the first pose.
    pub start: usize,
    /// Number of poses.
    pub length: usize,
}

impl Window {
    /// The poses of the window; `None` where the slice of logs is not the one it was cut from.
    pub fn poses<'a>(&self, trajectories: &'a [Trajectory]) -> Option<&'a [dose3_lie::Pose]> {
        let end = self.start.checked_add(self.length)?;
        trajectories
            .get(self.trajectory)?
            .poses
            .get(self.start..end)
    }
}

/// All windows of `length` poses, `stride` poses apart, within the gap-free stretches of each log.
///
/// Every stretch begins with a window at its first pose; poses at its end that fill no window are left out,
/// and a log without a long enough stretch has none. `length` or `stride` 0 gives none. Use
/// [`windows_of_each`] where a log without a window is an error.
///
/// ```
/// use dose3_datasets::{synthetic, windows};
///
/// let drive = synthetic::trajectory(synthetic::Platform::Vehicle, 7, 300, 10.0);
/// let cut = windows(&[drive], 128, 64);
/// assert_eq!(cut.iter().map(|window| window.start).collect::<Vec<_>>(), [0, 64, 128]);
/// ```
pub fn windows(trajectories: &[Trajectory], length: usize, stride: usize) -> Vec<Window> {
    if length == 0 || stride == 0 {
        return Vec::new();
    }
    let mut cut = Vec::new();
    for (trajectory, log) in trajectories.iter().enumerate() {
        for stretch in stretches(log, log.max_gap) {
            let starts = stretch
                .clone()
                .step_by(stride)
                .take_while(|start| start + length <= stretch.end);
            cut.extend(starts.map(|start| Window {
                trajectory,
                start,
                length,
            }));
        }
    }
    cut
}

/// For each of `windows`, cut `stride` apart, the number of the gap-free stretch of its log that it lies in.
///
/// ```
/// use dose3_datasets::{Window, stretch_numbers};
///
/// let at = |trajectory, start| Window { trajectory, start, length: 128 };
/// let cut = [at(0, 0), at(0, 64), at(0, 300), at(1, 364)];
/// assert_eq!(stretch_numbers(&cut, 64), [0, 0, 1, 0]);
/// ```
pub fn stretch_numbers(windows: &[Window], stride: usize) -> Vec<usize> {
    let mut numbers = Vec::with_capacity(windows.len());
    let mut number = 0;
    for (i, window) in windows.iter().enumerate() {
        let before = i.checked_sub(1).map(|before| &windows[before]);
        number = match before.filter(|before| before.trajectory == window.trajectory) {
            None => 0,
            Some(before) if before.start + stride == window.start => number,
            Some(_) => number + 1,
        };
        numbers.push(number);
    }
    numbers
}

/// As [`windows`], but every log must give at least one.
///
/// # Errors
/// [`Error::TooShort`] names the first log without a window; [`Error::Parameter`] for `length` or `stride` 0.
pub fn windows_of_each(
    trajectories: &[Trajectory],
    length: usize,
    stride: usize,
) -> Result<Vec<Window>, Error> {
    for (what, value) in [("window length", length), ("window stride", stride)] {
        if value == 0 {
            return Err(Error::Parameter {
                what,
                expected: "at least 1",
                found: "0".to_owned(),
            });
        }
    }
    for log in trajectories {
        let longest = stretches(log, log.max_gap)
            .iter()
            .map(ExactSizeIterator::len)
            .max()
            .unwrap_or(0);
        if longest < length {
            return Err(Error::TooShort {
                name: log.name.clone(),
                longest,
                needed: length,
                hint: "leave the log out, choose a shorter window, or allow longer gaps",
            });
        }
    }
    Ok(windows(trajectories, length, stride))
}
