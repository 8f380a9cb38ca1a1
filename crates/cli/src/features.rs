//! From windows of poses to statistics: represent, noise, estimate, summarise. Windows are taken
//! a few at a time, so memory does not grow with the log.

use anyhow::{Context, Result, anyhow};
use dose3_datasets::{Representation, Trajectory, Window, WindowTensor};
use dose3_diffusion::{ModelPair, ProbeConfig, Process, rotation_tangents, trace};
use dose3_lie::{Pose, so3};
use dose3_ood::statistics::{PoseWindow, Sample, StatisticsSet, Trace, TraceSummary};

/// Networks evaluated at once: windows times visited steps.
const BATCH: usize = 240;

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
        }
    }
}

impl Extractor<'_> {
    /// Calls `visit` with every window in order. `needs_trace` tells whether the networks run.
    ///
    /// # Errors
    /// A window that cannot be represented, a failing network, or `visit`'s own error.
    pub fn for_each(
        &mut self,
        trajectories: &[Trajectory],
        windows: &[Window],
        needs_trace: bool,
        visit: &mut dyn FnMut(usize, WindowData) -> Result<()>,
    ) -> Result<()> {
        let steps = self.probe.step_indices(self.process.steps()).len();
        let at_once = (BATCH / steps).max(1);
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
            if needs_trace {
                for draw in 0..self.probe.draws {
                    self.summarise(&tensors, draw, &mut summaries)?;
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
                    increments: increments(poses),
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
        self.for_each(
            trajectories,
            windows,
            set.needs_trace(),
            &mut |index, data| {
                rows.push(set.evaluate(&data.sample())?);
                progress(index + 1);
                Ok(())
            },
        )?;
        Ok(rows)
    }

    fn summarise(
        &mut self,
        tensors: &[WindowTensor],
        draw: usize,
        summaries: &mut [Vec<TraceSummary>],
    ) -> Result<()> {
        let views: Vec<dose3_diffusion::Window<'_>> = tensors
            .iter()
            .map(|t| dose3_diffusion::Window {
                translation: &t.translation,
                rotation: &t.rotation,
            })
            .collect();
        let traces = trace(self.models, self.process, &self.probe, &views, draw)?;
        for (w, summaries) in summaries.iter_mut().enumerate() {
            summaries.push(TraceSummary::of(&Trace {
                steps: traces.steps.len(),
                length: traces.length,
                eps_hat: traces.eps_hat(w),
                eps: traces.eps(w),
            })?);
        }
        Ok(())
    }
}

/// Body-frame motion between consecutive poses, `[poses - 1, 6]`: the translation of
/// `T_i^-1 T_{i+1}` in metres and the logarithm of its rotation in radians.
pub fn increments(poses: &[Pose]) -> Vec<f64> {
    poses
        .windows(2)
        .flat_map(|pair| {
            let back = pair[0].rotation.inverse();
            let t = back * (pair[1].translation - pair[0].translation);
            let r = so3::log(&(back * pair[1].rotation));
            [t.x, t.y, t.z, r.x, r.y, r.z]
        })
        .collect()
}
