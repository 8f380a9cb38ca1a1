//! Short windows beside the usual ones, by the same statistics: for streams, which see a fault sooner by them, and for logs
//! that are too short for the usual ones.
//!
//! A fault fills a window of 128 steps after 13 s only, and medians over it move when it fills half. Windows of 32
//! steps see it within a few seconds. Verdicts on logs that have a usual window do not use them. Short logs that have one
//! of 64 steps are judged by those: they overlap by half, and two that share a fault weigh more than one.

use super::extent::MOST_STRIDE;
use crate::error::Result;
use dose3_datasets::{Trajectory, Window, stretches, windows_of_each};
use dose3_ood::DetectorStatistics;
use serde::{Deserialize, Serialize};

/// Steps of short windows, the longer ones first; streams look at the shortest.
pub const SHORT_STEPS: [usize; 2] = [64, 32];
/// Poses from the start of one trusted short window to the next, so that a fit of those of one length takes no longer than
/// that of the usual ones.
pub(super) const STRIDE: usize = 32;
/// Fewest steps that any statistic of steps can do with.
const FEWEST: usize = 12;

/// Densities and calibration of short windows; stored in a detector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShortWindows {
    /// Steps of a window.
    pub steps: usize,
    /// Poses from the start of one trusted window to the next.
    pub stride: usize,
    /// Fitted to the statistics of trusted short windows.
    pub statistics: DetectorStatistics,
}

impl ShortWindows {
    /// Whether they are shorter than the usual ones, and long enough for every statistic.
    pub(super) fn sound(&self, usual: usize) -> bool {
        (FEWEST..usual).contains(&self.steps) && (1..=MOST_STRIDE).contains(&self.stride)
    }
}

/// The short windows of a log. Where they do not overlap and leave poses over at the end of a stretch, one more ends with
/// it: else half of a log of 64 poses would not be looked at.
///
/// # Errors
/// A log without one.
pub(super) fn of_log(log: &Trajectory, poses: usize, stride: usize) -> Result<Vec<Window>> {
    let mut all = windows_of_each(std::slice::from_ref(log), poses, stride)?;
    if stride + 1 < poses {
        return Ok(all);
    }
    let long = stretches(log, log.max_gap).into_iter();
    let long = long.filter(|stretch| stretch.len() >= poses);
    all.extend(long.filter_map(|stretch| {
        let left = (stretch.len() - poses) % stride;
        (left > 0).then(|| Window {
            trajectory: 0,
            start: stretch.end - poses,
            length: poses,
        })
    }));
    all.sort_by_key(|window| window.start);
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_datasets::synthetic::{Platform, trajectory};

    #[test]
    fn every_pose_of_a_stretch_lies_in_a_window() {
        for (poses, starts) in [
            (33, vec![0]),
            (60, vec![0, 27]),
            (65, vec![0, 32]),
            (100, vec![0, 32, 64, 67]),
        ] {
            let log = trajectory(Platform::Vehicle, 1, poses, 10.0);
            let found = of_log(&log, 33, 32).unwrap();
            let of: Vec<usize> = found.iter().map(|window| window.start).collect();
            assert_eq!(of, starts, "{poses}");
        }
        let half = of_log(&trajectory(Platform::Vehicle, 1, 128, 10.0), 65, 32).unwrap();
        assert_eq!(half.len(), 2);
        assert!(of_log(&trajectory(Platform::Vehicle, 1, 32, 10.0), 33, 32).is_err());
    }
}
