//! What is measured of one window.

use crate::error::Result;
use dose3_datasets::{Trajectory, Window, WindowTensor};
use dose3_diffusion::rotation_tangents;
use dose3_ood::localise::pose_numbers;
use dose3_ood::statistics::{
    JointErrors, LinearPredictor, PoseWindow, Sample, StatisticsSet, TraceSummary,
};
use std::cell::OnceCell;
use std::ops::Range;
use std::sync::Arc;

/// Everything that is known of one window; statistics are functions of it.
pub struct Measured<'a> {
    /// Which of the windows that were asked for.
    pub index: usize,
    /// Where it lies.
    pub window: Window,
    /// The log it was cut from.
    pub log: &'a Trajectory,
    /// What the networks said, one summary a draw; empty where they did not run.
    pub traces: Vec<TraceSummary>,
    /// The window as the networks see it.
    pub tensor: WindowTensor,
    /// Body-frame increments between its poses, `[poses - 1, 6]`: metres, then radians
    /// ([`dose3_datasets::increments`]).
    pub increments: Vec<f64>,
    /// What `lin` predicts the increments with, where it was learnt.
    pub linear: Option<Arc<LinearPredictor>>,
    /// What the joint network got wrong, where it runs.
    pub joint: Option<JointErrors>,
    /// Logarithms of the represented rotations, `[length, 3]`; few statistics ask for them.
    pub(super) tangents: OnceCell<Vec<f32>>,
    /// Poses of the log that lie nearer to the middle of this window than to that of its neighbours.
    pub(super) own: Range<usize>,
    /// Whether noise was drawn; without it the traces hold no denoising errors.
    pub(super) drawn: bool,
}

impl Measured<'_> {
    /// What any statistic is computed from.
    pub fn sample(&self) -> Sample<'_> {
        let tangents = || rotation_tangents(&self.tensor.rotation);
        Sample {
            window: Some(PoseWindow {
                translation: &self.tensor.translation,
                tangent: self.tangents.get_or_init(tangents),
            }),
            ..self.without_window()
        }
    }

    /// The numbers of `set`, in the order of its names.
    ///
    /// # Errors
    /// A statistic that cannot be computed, for one because its networks did not run.
    pub fn row(&self, set: &StatisticsSet) -> Result<Vec<f64>> {
        let sample = match set.needs_window() {
            true => self.sample(),
            false => self.without_window(),
        };
        Ok(set.evaluate(&sample)?)
    }

    /// `(pose of the log, its numbers)` for the poses of which this window knows most: those nearer to its
    /// middle than to that of another window, so that over all windows of a log every pose comes once. The first
    /// pose of a stretch, which no step leads to, has none. Where no noise is drawn, the numbers are those of
    /// the increments alone ([`pose_numbers`]).
    ///
    /// # Errors
    /// As [`pose_numbers`].
    pub fn poses(&self) -> Result<Vec<(usize, Vec<f64>)>> {
        let sample = self.without_window();
        let traces = if self.drawn { sample.traces } else { &[] };
        let mut numbers = pose_numbers(&Sample { traces, ..sample })?;
        let steps = self.own.clone().filter_map(|pose| {
            let step = (pose - self.window.start).checked_sub(1)?;
            Some((pose, std::mem::take(&mut numbers[step])))
        });
        Ok(steps.collect())
    }

    fn without_window(&self) -> Sample<'_> {
        Sample {
            traces: &self.traces,
            increments: Some(&self.increments),
            linear: self.linear.as_deref(),
            joint: self.joint.as_ref(),
            ..Sample::default()
        }
    }
}

/// The poses that lie nearer to the middle of window `index` than to that of its neighbours: every
/// pose that some window holds is in one of these ranges. Windows are in order of log and start.
pub(super) fn own_poses(windows: &[Window], index: usize) -> Range<usize> {
    let window = &windows[index];
    let end = window.start + window.length;
    let neighbour = |other: Option<&Window>| {
        other
            .filter(|o| o.trajectory == window.trajectory)
            .filter(|o| o.start < end && window.start < o.start + o.length)
            .map(|o| (o.start + window.start + window.length) / 2)
    };
    let before = index.checked_sub(1).and_then(|i| windows.get(i));
    let start = neighbour(before).unwrap_or(window.start);
    start..neighbour(windows.get(index + 1)).unwrap_or(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pose_belongs_to_the_window_it_lies_in_the_middle_of() {
        let at = |trajectory, start| Window {
            trajectory,
            start,
            length: 10,
        };
        // Two overlapping windows and one beyond a gap, then another log.
        let windows = [at(0, 0), at(0, 4), at(0, 30), at(1, 32)];
        let ranges: Vec<Range<usize>> = (0..4).map(|i| own_poses(&windows, i)).collect();
        assert_eq!(ranges, [0..7, 7..14, 30..40, 32..42]);
    }
}
