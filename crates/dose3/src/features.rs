//! From windows of poses to statistics: represent, noise, estimate, summarise. Windows are taken
//! a few at a time, so memory does not grow with the log.

use anyhow::{Context, Result, anyhow};
use dose3_datasets::{Frame, Representation, Trajectory, Window, WindowTensor};
use dose3_diffusion::{
    Branches, ModelPair, NoiseSharing, ProbeConfig, Process, rotation_tangents, trace,
};
use dose3_lie::{Pose, so3};
use dose3_ood::localise::pose_numbers;
use dose3_ood::statistics::{PoseWindow, Sample, StatisticsSet, Trace, TraceSummary};
use rayon::prelude::*;
use std::ops::Range;

/// Samples that a network is given at once: windows times draws times visited steps. Large enough
/// that threads end together, small enough that a batch takes about 10 MB.
const BATCH: usize = 480;

/// What turns windows into statistics.
pub struct Extractor<'a> {
    /// The networks; not touched where no statistic needs them.
    pub models: &'a mut ModelPair,
    /// Their diffusion process.
    pub process: &'a Process,
    /// Steps, draws, seed.
    pub probe: ProbeConfig,
    /// How poses become numbers.
    pub representation: Representation,
}

/// Everything known of one window, owned.
pub struct WindowData {
    /// One summary per draw; empty where no statistic needs the networks.
    pub traces: Vec<TraceSummary>,
    /// The represented window.
    pub tensor: WindowTensor,
    /// Logarithms of the represented rotations, `[length, 3]`.
    pub tangents: Vec<f32>,
    /// Body-frame increments, `[poses - 1, 6]`.
    pub increments: Vec<f64>,
}

impl WindowData {
    /// The view that statistics are computed from.
    pub fn sample(&self) -> Sample<'_> {
        Sample {
            traces: &self.traces,
            window: Some(PoseWindow {
                translation: &self.tensor.translation,
                tangent: &self.tangents,
            }),
            increments: Some(&self.increments),
            linear: None,
        }
    }
}

/// Hears the index of a log, a pose of it, and the pose's numbers.
pub type PoseVisitor<'a> = &'a mut dyn FnMut(usize, usize, &[f64]) -> Result<()>;

impl Extractor<'_> {
    /// Calls `visit` with every window in order; `networks` tells which of them run, if any.
    ///
    /// # Errors
    /// A window that cannot be represented, a failing network, or `visit`'s own error.
    pub fn for_each(
        &mut self,
        trajectories: &[Trajectory],
        windows: &[Window],
        networks: Option<Branches>,
        visit: &mut dyn FnMut(usize, WindowData) -> Result<()>,
    ) -> Result<()> {
        let steps = self.probe.step_indices(self.process.steps()).len();
        let at_once = (BATCH / (steps * self.probe.distinct_draws().max(1))).max(1);
        for (chunk_index, chunk) in windows.chunks(at_once).enumerate() {
            let tensors = chunk
                .iter()
                .map(|w| {
                    self.representation
                        .represent_window(w, trajectories)
                        .with_context(|| {
                            format!(
                                "log {} at pose {}",
                                trajectories[w.trajectory].name, w.start
                            )
                        })
                })
                .collect::<Result<Vec<_>>>()?;
            let mut summaries = vec![Vec::new(); chunk.len()];
            if let Some(branches) = networks {
                let at_once = (BATCH / steps).max(1);
                let all = self.probe.distinct_draws();
                for first in (0..all).step_by(at_once) {
                    let draws = first..(first + at_once).min(all);
                    self.summarise(&tensors, draws, branches, &mut summaries)?;
                }
            }
            for (i, ((window, tensor), traces)) in
                chunk.iter().zip(tensors).zip(summaries).enumerate()
            {
                let poses = window
                    .poses(trajectories)
                    .ok_or_else(|| anyhow!("window {window:?} lies outside its log"))?;
                let data = WindowData {
                    traces,
                    tangents: rotation_tangents(&tensor.rotation),
                    tensor,
                    increments: increments(poses, trajectories[window.trajectory].frame),
                };
                visit(chunk_index * at_once + i, data)?;
            }
        }
        Ok(())
    }

    /// The rows of `set` for all windows.
    ///
    /// # Errors
    /// As [`Extractor::for_each`], or a statistic that cannot be computed.
    pub fn rows(
        &mut self,
        trajectories: &[Trajectory],
        windows: &[Window],
        set: &StatisticsSet,
        progress: &dyn Fn(usize),
    ) -> Result<Vec<Vec<f64>>> {
        let mut rows = Vec::with_capacity(windows.len());
        self.for_each(trajectories, windows, networks(set), &mut |index, data| {
            rows.push(set.evaluate(&data.sample())?);
            progress(index + 1);
            Ok(())
        })?;
        Ok(rows)
    }

    /// As [`Extractor::rows`]; `pose` also hears `(log, pose, numbers)` of every pose in a window but
    /// the first of each stretch ([`pose_numbers`]), once: from the window in whose middle it lies.
    /// Where no noise is drawn, the numbers are those of the increments alone.
    ///
    /// # Errors
    /// As [`Extractor::rows`], or `pose`'s own error.
    pub fn rows_and_poses(
        &mut self,
        trajectories: &[Trajectory],
        windows: &[Window],
        set: &StatisticsSet,
        pose: PoseVisitor<'_>,
        progress: &dyn Fn(usize),
    ) -> Result<Vec<Vec<f64>>> {
        let mut rows = Vec::with_capacity(windows.len());
        let sharing = self.probe.sharing;
        self.for_each(trajectories, windows, networks(set), &mut |index, data| {
            let sample = data.sample();
            rows.push(set.evaluate(&sample)?);
            let window = &windows[index];
            let numbers = pose_numbers(&denoising(sample, sharing))?;
            for at in own_poses(windows, index) {
                // The first pose of a window has no step that leads to it.
                if let Some(step) = (at - window.start).checked_sub(1) {
                    pose(window.trajectory, at, &numbers[step])?;
                }
            }
            progress(index + 1);
            Ok(())
        })?;
        Ok(rows)
    }

    fn summarise(
        &mut self,
        tensors: &[WindowTensor],
        draws: Range<usize>,
        branches: Branches,
        summaries: &mut [Vec<TraceSummary>],
    ) -> Result<()> {
        let views: Vec<dose3_diffusion::Window<'_>> = tensors
            .iter()
            .map(|t| dose3_diffusion::Window {
                translation: &t.translation,
                rotation: &t.rotation,
            })
            .collect();
        let (probe, process) = (&self.probe, self.process);
        let traces = trace(self.models, process, probe, &views, draws, branches)?;
        let summary = |w, d| {
            TraceSummary::of(&Trace {
                steps: traces.steps.len(),
                length: traces.length,
                eps_hat: traces.eps_hat(w, d),
                eps: traces.eps(w, d),
            })
        };
        let all = summaries.par_iter_mut().enumerate();
        all.try_for_each(|(w, summaries)| {
            for d in 0..traces.draws {
                summaries.push(summary(w, d)?);
            }
            Ok(())
        })
    }
}

/// The poses that lie nearer to the middle of window `index` than to that of its neighbours: every
/// pose that some window holds is in one of these ranges. Windows are in order of log and start.
fn own_poses(windows: &[Window], index: usize) -> Range<usize> {
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

/// The networks that a set needs.
fn networks(set: &StatisticsSet) -> Option<Branches> {
    set.needs_trace().then(|| match set.needs_rotation_trace() {
        true => Branches::Both,
        false => Branches::Translation,
    })
}

/// The sample with its traces only where they hold denoising errors: on a path without drawn noise there
/// are none.
fn denoising(sample: Sample<'_>, sharing: NoiseSharing) -> Sample<'_> {
    match sharing {
        NoiseSharing::PerWindow | NoiseSharing::Common => sample,
        NoiseSharing::None => Sample {
            traces: &[],
            ..sample
        },
    }
}

/// Body-frame motion between consecutive poses, `[poses - 1, 6]`: the translation of
/// `T_i^-1 T_{i+1}` in metres and the logarithm of its rotation in radians, in forward-left-up axes
/// where `frame` defines them, else in the body's own.
pub fn increments(poses: &[Pose], frame: Frame) -> Vec<f64> {
    let axes = frame.to_forward_left_up();
    poses
        .windows(2)
        .flat_map(|pair| {
            let back = pair[0].rotation.inverse();
            let t = axes * (back * (pair[1].translation - pair[0].translation));
            let r = axes * so3::log(&(back * pair[1].rotation));
            [t.x, t.y, t.z, r.x, r.y, r.z]
        })
        .collect()
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
