//! From poses to rows of statistics and per-pose numbers, in one place: networks, forward process,
//! representation, noise. Fitting, judging and experiments are functions of what a [`Probe`] measures.
//!
//! ```
//! use dose3::probe::{Probe, ProbePlan};
//! use dose3_datasets::{synthetic, windows};
//! use dose3_diffusion::NoiseSharing;
//!
//! let model = dose3::built_in::motion()?;
//! let plan = ProbePlan { steps: 6, draws: 1, seed: 0, sharing: NoiseSharing::Shared };
//! let logs = [synthetic::trajectory(synthetic::Platform::Vehicle, 1, 200, 10.0)];
//! let set: dose3_ood::StatisticsSet = "kinematic,residual".parse()?;
//!
//! let mut probe = Probe::new(&model, &plan)?;
//! let cut = windows(&logs, probe.poses(), 32);
//! let mut rows = Vec::new();
//! probe.measure(&logs, &cut, |window| {
//!     rows.push(window.row(&set)?);
//!     Ok::<(), dose3::Error>(())
//! })?;
//! assert_eq!((rows.len(), rows[0].len()), (cut.len(), set.dimension()));
//! # Ok::<(), dose3::Error>(())
//! ```

mod joint;
mod measured;
mod pass;
mod plan;
mod reference;

use joint::JointProbe;
pub use measured::Measured;
pub(crate) use pass::Pass;
pub(crate) use plan::MOST_DRAWS;
pub use plan::{ProbePlan, checked};
pub(crate) use reference::Learnt;
pub use reference::ProbeReference;

use crate::backend::Computing;
use crate::error::{Error, Result};
use crate::model_file::Model;
use dose3_datasets::{LogGroups, Representation, Trajectory, Window};
use dose3_diffusion::{Branches, ModelPair, Process};
use dose3_ood::StatisticsSet;
use dose3_ood::statistics::LinearPredictor;
use std::sync::Arc;

/// What turns windows of poses into statistics. Knows no file: logs may come from anywhere.
pub struct Probe {
    /// The networks with what of them runs; none where no statistic needs them.
    networks: Option<(ModelPair, Branches)>,
    /// The joint network; none where no statistic needs it.
    joint: Option<JointProbe>,
    process: Process,
    representation: Representation,
    plan: ProbePlan,
    poses: usize,
    learnt: Learnt,
}

impl Probe {
    /// A probe with both networks of `model` on the built-in engine and all cores: any statistic can be
    /// computed of what it measures.
    ///
    /// # Errors
    /// A diffusion process that cannot be had.
    pub fn new(model: &Model, plan: &ProbePlan) -> Result<Self> {
        let computing = Computing::default();
        let joint = match model.joint {
            Some(_) => Some(JointProbe::new(
                model,
                computing.threads,
                (plan.seed, plan.draws),
            )?),
            None => None,
        };
        Self::load(model, plan, Some(Branches::Both), joint, computing)
    }

    /// A probe that loads and runs only what `sets` need, as `computing` says.
    ///
    /// # Errors
    /// As [`Probe::new`], or a backend that this build does not hold.
    pub fn for_sets<'s>(
        model: &Model,
        plan: &ProbePlan,
        sets: impl IntoIterator<Item = &'s StatisticsSet>,
        computing: Computing,
    ) -> Result<Self> {
        let sets: Vec<&StatisticsSet> = sets.into_iter().collect();
        // Both networks where any set needs both.
        let needed = sets.iter().filter_map(|set| networks(set));
        let needed = needed.max_by_key(|branches| *branches == Branches::Both);
        let joint = match sets.iter().any(|set| set.needs_joint()) {
            true => Some(JointProbe::new(
                model,
                computing.threads,
                (plan.seed, plan.draws),
            )?),
            false => None,
        };
        Self::load(model, plan, needed, joint, computing)
    }

    fn load(
        model: &Model,
        plan: &ProbePlan,
        branches: Option<Branches>,
        joint: Option<JointProbe>,
        computing: Computing,
    ) -> Result<Self> {
        let header = &model.header;
        let networks = match branches {
            Some(branches) => Some((computing.load(&model.parameters)?, branches)),
            None => None,
        };
        Ok(Self {
            networks,
            joint,
            process: Process::new(header.process)?,
            representation: header.representation,
            plan: *plan,
            poses: header.representation.kind.poses(header.window),
            learnt: Learnt::default(),
        })
    }

    /// Poses of a window.
    pub fn poses(&self) -> usize {
        self.poses
    }

    /// Measures windows of so many steps from now on. Networks are trained at the model's own length; statistics
    /// without one take any.
    pub fn set_window(&mut self, steps: usize) {
        self.poses = self.representation.kind.poses(steps);
    }

    /// How windows are noised.
    pub fn plan(&self) -> &ProbePlan {
        &self.plan
    }

    /// Noises what comes next in another way, by the same networks.
    pub fn set_plan(&mut self, plan: &ProbePlan) {
        self.plan = *plan;
    }

    /// Learns from trusted logs what statistics of `set` need to know of them before they can be computed (`lin`
    /// predicts each axis from the others; most need nothing). From then on `logs` are measured, and each by what was
    /// learnt without its own group, so that its numbers look like those that a new log will have.
    ///
    /// # Errors
    /// Logs too short to learn from.
    pub fn learn(
        &mut self,
        logs: &[Trajectory],
        groups: &LogGroups,
        set: &StatisticsSet,
    ) -> Result<()> {
        self.learnt = Learnt::from_trusted(logs, groups, set)?;
        Ok(())
    }

    /// What was learnt, for new logs.
    #[must_use]
    pub fn reference(&self) -> ProbeReference {
        self.learnt.reference()
    }

    /// What predicts the axes of trusted log `log`, learnt without its group; none where no statistic needs it.
    pub(crate) fn linear_of(&self, log: usize) -> Option<Arc<LinearPredictor>> {
        self.learnt.of_log(log)
    }

    /// Measures new logs by what was learnt from trusted ones.
    pub fn set_reference(&mut self, reference: &ProbeReference) {
        self.learnt = Learnt::for_new_logs(reference);
    }

    /// Calls `visit` with every one of `windows`, which lie in `logs`, in order; its error ends the pass. The
    /// numbers of a window do not depend on the number of threads or on the windows beside it.
    ///
    /// # Errors
    /// A window that cannot be represented or lies outside of its log, a failing network, `visit`'s own error.
    pub fn measure<'a, E: From<Error>>(
        &mut self,
        logs: &'a [Trajectory],
        windows: &[Window],
        visit: impl FnMut(Measured<'a>) -> Result<(), E>,
    ) -> Result<(), E> {
        let pass = &mut Pass {
            networks: self.networks.as_mut().map(|(models, b)| (models, *b)),
            joint: self.joint.as_mut(),
            process: &self.process,
            plan: self.plan,
            representation: self.representation,
            learnt: &self.learnt,
        };
        pass.run(logs, windows, visit)
    }

    /// The rows of `set` for all windows.
    ///
    /// # Errors
    /// As [`Probe::measure`], or a statistic that cannot be computed.
    pub fn rows(
        &mut self,
        logs: &[Trajectory],
        windows: &[Window],
        set: &StatisticsSet,
    ) -> Result<Vec<Vec<f64>>> {
        let mut rows = Vec::with_capacity(windows.len());
        self.measure(logs, windows, |window| {
            rows.push(window.row(set)?);
            Ok::<(), Error>(())
        })?;
        Ok(rows)
    }
}

/// The networks that a set needs.
pub(crate) fn networks(set: &StatisticsSet) -> Option<Branches> {
    set.needs_trace().then(|| match set.needs_rotation_trace() {
        true => Branches::Both,
        false => Branches::Translation,
    })
}
