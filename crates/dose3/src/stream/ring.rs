//! The last poses of a stretch, as far back as a window goes.

use super::state::{Flat, MOST};
use dose3_datasets::{Format, Frame, Trajectory, increment};
use dose3_lie::Pose;
use serde::{Deserialize, Serialize};

/// Numbers of a step.
const AXES: usize = 6;

/// Stamps and steps of the last poses. What is asked for lies in one piece: buffers hold two windows and are moved
/// back when they are full.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ring {
    /// Poses of the longest window.
    poses: usize,
    /// Poses of the stretch so far.
    count: u64,
    stamps: Vec<i64>,
    /// `[n, 6]`, steps between the poses.
    steps: Vec<f64>,
    last: Option<Flat>,
    /// The poses themselves, where something is computed from them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    kept: Option<Vec<Flat>>,
}

impl Ring {
    pub fn new(poses: usize, keep: bool) -> Self {
        Self {
            poses,
            count: 0,
            stamps: Vec::with_capacity(2 * poses),
            steps: Vec::with_capacity(2 * AXES * poses),
            last: None,
            kept: keep.then(|| Vec::with_capacity(2 * poses)),
        }
    }

    /// Whether it is one for windows of so many poses, from a file.
    pub fn fits(&self, poses: usize, keep: bool) -> bool {
        let known = self.stamps.len();
        let steps = known.saturating_sub(1);
        self.poses == poses
            && known as u64 == self.count.min(known as u64)
            && known < 2 * poses
            && known >= self.count.min(poses as u64) as usize
            && self.steps.len() == steps * AXES
            && self.last.is_some() == (known > 0)
            && self.kept.is_some() == keep
            && self.kept.as_ref().is_none_or(|k| k.len() == known)
            && self.count < MOST
            && self.steps.iter().all(|x| x.is_finite())
            && self
                .last
                .iter()
                .chain(self.kept.iter().flatten())
                .all(Flat::is_pose)
            && self.stamps.windows(2).all(|pair| pair[0] < pair[1])
    }

    pub fn clear(&mut self) {
        self.count = 0;
        self.stamps.clear();
        self.steps.clear();
        self.last = None;
        if let Some(kept) = &mut self.kept {
            kept.clear();
        }
    }

    pub fn push(&mut self, stamp: i64, pose: Pose, frame: Frame) {
        if self.stamps.len() + 1 == 2 * self.poses {
            let from = self.stamps.len() + 1 - self.poses;
            self.stamps.drain(..from);
            self.steps.drain(..from * AXES);
            if let Some(kept) = &mut self.kept {
                kept.drain(..from);
            }
        }
        if let Some(last) = &self.last {
            self.steps.extend(increment(&last.pose(), &pose, frame));
        }
        let flat = Flat::from(&pose);
        self.stamps.push(stamp);
        if let Some(kept) = &mut self.kept {
            kept.push(flat);
        }
        self.last = Some(flat);
        self.count += 1;
    }

    /// Index within the stretch of the first of the last `poses`; none before there are so many.
    pub fn window_start(&self, poses: usize) -> Option<u64> {
        self.count.checked_sub(poses as u64)
    }

    /// Steps between the last `poses`, `[poses - 1, 6]`; of as many as there are, where there are fewer.
    pub fn steps(&self, poses: usize) -> &[f64] {
        let wanted = AXES * (poses - 1);
        &self.steps[self.steps.len().saturating_sub(wanted)..]
    }

    /// Stamps of the last `poses`, or of as many as there are.
    pub fn stamps(&self, poses: usize) -> &[i64] {
        &self.stamps[self.stamps.len().saturating_sub(poses)..]
    }

    /// The last `poses` as a log of their own, where poses are kept.
    pub fn window(&self, poses: usize, frame: Frame) -> Trajectory {
        let (stamps, poses) = (
            self.stamps(poses).to_vec(),
            self.window_poses(poses).collect(),
        );
        Trajectory::new("stream", Format::Memory, frame, stamps, poses)
    }

    /// Poses of the last window, where they are kept.
    fn window_poses(&self, poses: usize) -> impl Iterator<Item = Pose> + '_ {
        let kept = self.kept.as_deref().unwrap_or_default();
        kept[kept.len().saturating_sub(poses)..]
            .iter()
            .map(Flat::pose)
    }

    pub fn first_stamp(&self, poses: usize) -> i64 {
        self.stamps(poses).first().copied().unwrap_or_default()
    }

    /// Stamp of the last pose of the stretch.
    pub fn newest(&self) -> Option<i64> {
        self.stamps.last().copied()
    }

    pub fn last_stamp(&self) -> i64 {
        self.newest().unwrap_or_default()
    }
}
