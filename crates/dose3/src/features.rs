//! The pass over windows with parts that the caller owns; a [`crate::probe::Probe`] owns them itself.

use crate::probe::{Measured, Pass, ProbePlan, networks};
use anyhow::Result;
use dose3_datasets::{Representation, Trajectory, Window};
use dose3_diffusion::{Branches, ModelPair, Process};
use dose3_ood::StatisticsSet;

pub use dose3_datasets::increments;

/// What turns windows into statistics.
pub struct Extractor<'a> {
    /// The networks; not touched where no statistic needs them.
    pub models: &'a mut ModelPair,
    /// Their diffusion process.
    pub process: &'a Process,
    /// Steps, draws, seed.
    pub probe: ProbePlan,
    /// How poses become numbers.
    pub representation: Representation,
}

/// Everything known of one window.
pub type WindowData<'a> = Measured<'a>;

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
        visit: &mut dyn FnMut(usize, WindowData<'_>) -> Result<()>,
    ) -> Result<()> {
        let mut pass = Pass {
            networks: networks.map(|branches| (&mut *self.models, branches)),
            process: self.process,
            plan: self.probe,
            representation: self.representation,
        };
        pass.run(trajectories, windows, |window| visit(window.index, window))
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
            rows.push(data.row(set)?);
            progress(index + 1);
            Ok(())
        })?;
        Ok(rows)
    }
}
