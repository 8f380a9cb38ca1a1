//! One pass over windows: represent, noise, estimate, summarise. Windows are taken a few at a time, so memory
//! does not grow with the log.

use super::joint::JointProbe;
use super::measured::{Measured, own_poses};
use super::plan::ProbePlan;
use super::reference::Learnt;
use crate::error::{Error, Result};
use dose3_datasets::{Representation, Trajectory, Window, WindowTensor, increments};
use dose3_diffusion::{Branches, ModelPair, NoiseSharing, Process, trace};
use dose3_ood::statistics::{JointErrors, Trace, TraceSummary};
use rayon::prelude::*;
use std::cell::OnceCell;
use std::ops::Range;

/// Samples that a network is given at once: windows times draws times visited steps. Large enough
/// that threads end together, small enough that a batch takes about 10 MB.
const BATCH: usize = 480;

/// What a pass needs beside logs and windows.
pub(crate) struct Pass<'p> {
    /// The networks to run, if any.
    pub networks: Option<(&'p mut ModelPair, Branches)>,
    /// The joint network, where it runs.
    pub joint: Option<&'p mut JointProbe>,
    pub process: &'p Process,
    pub plan: ProbePlan,
    pub representation: Representation,
    pub learnt: &'p Learnt,
}

impl Pass<'_> {
    /// Calls `visit` with every window in order.
    pub fn run<'a, E: From<Error>>(
        &mut self,
        logs: &'a [Trajectory],
        windows: &[Window],
        mut visit: impl FnMut(Measured<'a>) -> Result<(), E>,
    ) -> Result<(), E> {
        let steps = self.plan.step_indices(self.process.steps()).len();
        let at_once = (BATCH / (steps * self.plan.distinct_draws().max(1))).max(1);
        for (chunk_index, chunk) in windows.chunks(at_once).enumerate() {
            let first = chunk_index * at_once;
            let tensors = self.represent(logs, chunk)?;
            let summaries = self.summaries(&tensors, steps)?;
            let mut errors = self.joint_errors(logs, chunk)?.into_iter();
            for (i, (tensor, traces)) in tensors.into_iter().zip(summaries).enumerate() {
                let index = first + i;
                let window = windows[index];
                let poses = window.poses(logs).ok_or_else(|| outside(&window))?;
                let log = &logs[window.trajectory];
                visit(Measured {
                    index,
                    window,
                    log,
                    traces,
                    tensor,
                    increments: increments(poses, log.frame),
                    linear: self.learnt.of_log(window.trajectory),
                    joint: errors.next(),
                    tangents: OnceCell::new(),
                    own: own_poses(windows, index),
                    drawn: self.plan.sharing != NoiseSharing::None,
                })?;
            }
        }
        Ok(())
    }

    fn represent(&self, logs: &[Trajectory], windows: &[Window]) -> Result<Vec<WindowTensor>> {
        let one = |window: &Window| {
            let log = logs.get(window.trajectory).ok_or_else(|| outside(window))?;
            let tensor = self.representation.represent_window(window, logs);
            tensor.map_err(|e| {
                Error::from(e).of_log(&format!("{} at pose {}", log.name, window.start))
            })
        };
        windows.iter().map(one).collect()
    }

    /// Per window; none where the joint network does not run, or before a scale is learnt.
    fn joint_errors(
        &mut self,
        logs: &[Trajectory],
        windows: &[Window],
    ) -> Result<Vec<JointErrors>> {
        let (Some(joint), Some(scale)) = (&mut self.joint, self.learnt.scale) else {
            return Ok(Vec::new());
        };
        let mut of_windows = Vec::with_capacity(windows.len());
        for window in windows {
            let poses = window.poses(logs).ok_or_else(|| outside(window))?;
            let log = &logs[window.trajectory];
            of_windows.push((increments(poses, log.frame), log));
        }
        joint.errors(&of_windows, scale)
    }

    /// Per window one summary a draw; none where no network runs.
    fn summaries(
        &mut self,
        tensors: &[WindowTensor],
        steps: usize,
    ) -> Result<Vec<Vec<TraceSummary>>> {
        let mut summaries = vec![Vec::new(); tensors.len()];
        let (process, plan) = (self.process, &self.plan);
        let Some((models, branches)) = &mut self.networks else {
            return Ok(summaries);
        };
        let views: Vec<dose3_diffusion::Window<'_>> = tensors
            .iter()
            .map(|t| dose3_diffusion::Window {
                translation: &t.translation,
                rotation: &t.rotation,
            })
            .collect();
        let at_once = (BATCH / steps).max(1);
        let all = plan.distinct_draws();
        for first in (0..all).step_by(at_once) {
            let draws: Range<usize> = first..(first + at_once).min(all);
            let traces = trace(models, process, plan, &views, draws, *branches)?;
            let summary = |w, d| {
                TraceSummary::of(&Trace {
                    steps: traces.steps.len(),
                    length: traces.length,
                    eps_hat: traces.eps_hat(w, d),
                    eps: traces.eps(w, d),
                })
            };
            let of_windows = summaries.par_iter_mut().enumerate();
            of_windows.try_for_each(|(w, summaries)| {
                for d in 0..traces.draws {
                    summaries.push(summary(w, d)?);
                }
                Ok::<(), Error>(())
            })?;
        }
        Ok(summaries)
    }
}

fn outside(window: &Window) -> Error {
    Error::OutsideWindow {
        log: window.trajectory,
        start: window.start,
    }
}
