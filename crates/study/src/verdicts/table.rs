//! Statistics of windows, one pass for all rows.

use anyhow::{Context, Result};
use dose3::backend::Computing;
use dose3::model_file::Model;
use dose3::probe::ProbeReference;
use dose3::{Probe, ProbePlan};
use dose3_datasets::{Trajectory, Window, increments, stretches};
use dose3_diffusion::NoiseSharing;
use dose3_ood::StatisticsSet;
use dose3_ood::statistics::{LinearPredictor, LinearReference, Sample, Statistic, axis_scale};

/// What is measured, and how.
pub struct Measurer {
    probe: Probe,
    /// Statistics that need no trusted logs.
    members: Vec<Statistic>,
    /// Poses of a window.
    pub poses: usize,
    /// Poses between the starts of windows.
    pub stride: usize,
}

/// Windows with everything that rows are made of.
#[derive(Clone, Default)]
pub struct Table {
    /// The windows.
    pub windows: Vec<Window>,
    /// Number of the gap-free stretch within its log that each lies in.
    pub stretches: Vec<usize>,
    /// `[window][member]`.
    values: Vec<Vec<Vec<f64>>>,
    /// Body-frame increments of each window.
    increments: Vec<Vec<f64>>,
}

impl Measurer {
    /// Measures what `sets` need; `steps` diffusion steps and one draw where that is a network.
    ///
    /// # Errors
    /// A backend that is not there.
    pub fn new(
        model: &Model,
        sets: &[StatisticsSet],
        (steps, draws, seed): (usize, usize, u64),
        stride: usize,
        computing: Computing,
    ) -> Result<Self> {
        let mut members = Vec::new();
        for member in sets.iter().flat_map(StatisticsSet::members) {
            if !members.contains(member) && *member != Statistic::Lin {
                members.push(*member);
            }
        }
        let plan = ProbePlan {
            steps: steps.min(model.header.process.steps),
            draws,
            seed,
            sharing: NoiseSharing::Shared,
        };
        let probe = Probe::for_sets(model, &plan, sets, computing)?;
        Ok(Self {
            poses: probe.poses(),
            probe,
            members,
            stride,
        })
    }

    /// Measures windows of so many steps from now on, as much nearer to each other as they are shorter.
    pub fn set_window(&mut self, steps: usize) {
        let usual = self.poses - 1;
        self.probe.set_window(steps);
        self.poses = self.probe.poses();
        self.stride = (self.stride * steps / usual).max(1);
    }

    /// Lets the joint network see windows in units of how far each axis moves in `logs`: six robust numbers.
    ///
    /// # Errors
    /// Poses that are not finite.
    pub fn scale_by(&mut self, logs: &[Trajectory]) -> Result<()> {
        let mut all = Vec::new();
        for log in logs {
            all.extend(dose3::joint::steps(log)?);
        }
        self.probe.set_reference(&ProbeReference {
            linear: None,
            scale: Some(axis_scale(&all)),
        });
        Ok(())
    }

    /// The windows of all logs.
    pub fn windows(&self, logs: &[Trajectory]) -> Vec<Window> {
        dose3_datasets::windows(logs, self.poses, self.stride)
    }

    /// Measures `windows` of `logs`.
    ///
    /// # Errors
    /// A window that cannot be represented, a failing network.
    pub fn measure(&mut self, logs: &[Trajectory], windows: &[Window]) -> Result<Table> {
        let sets: Vec<StatisticsSet> = self.members.iter().map(|m| (*m).into()).collect();
        let of_log: Vec<Vec<std::ops::Range<usize>>> =
            logs.iter().map(|log| stretches(log, log.max_gap)).collect();
        let mut table = Table::default();
        self.probe.measure(logs, windows, |measured| {
            let window = measured.window;
            let values = sets.iter().map(|set| measured.row(set));
            table.values.push(values.collect::<dose3::Result<_>>()?);
            table.increments.push(measured.increments.clone());
            let within = |stretch: &std::ops::Range<usize>| stretch.contains(&window.start);
            let stretch = of_log[window.trajectory].iter().position(within);
            table.stretches.push(stretch.unwrap_or(0));
            table.windows.push(window);
            Ok::<(), anyhow::Error>(())
        })?;
        Ok(table)
    }

    /// The rows of `set` for some windows of a table; `linear` predicts for the windows of a log.
    ///
    /// # Errors
    /// A statistic that was not measured.
    pub fn rows<'a>(
        &self,
        table: &Table,
        windows: &[usize],
        set: &StatisticsSet,
        linear: impl Fn(usize) -> &'a LinearPredictor,
    ) -> Result<Vec<Vec<f64>>> {
        let lin: StatisticsSet = Statistic::Lin.into();
        let row = |&window: &usize| {
            let mut row = Vec::with_capacity(set.dimension());
            for member in set.members() {
                if *member == Statistic::Lin {
                    row.extend(lin.evaluate(&Sample {
                        increments: Some(&table.increments[window]),
                        linear: Some(linear(table.windows[window].trajectory)),
                        ..Sample::default()
                    })?);
                    continue;
                }
                let at = self.members.iter().position(|known| known == member);
                let at = at.with_context(|| format!("{member} was not measured"))?;
                row.extend(&table.values[window][at]);
            }
            Ok(row)
        };
        windows.iter().map(row).collect()
    }
}

impl Table {
    /// The windows of one log, in order of time.
    pub fn of_log(&self, log: usize) -> Vec<usize> {
        let all = 0..self.windows.len();
        all.filter(|&w| self.windows[w].trajectory == log).collect()
    }

    /// Appends a window of another table.
    pub fn push(&mut self, other: &Table, window: usize) {
        self.windows.push(other.windows[window]);
        self.stretches.push(other.stretches[window]);
        self.values.push(other.values[window].clone());
        self.increments.push(other.increments[window].clone());
    }
}

/// What a linear prediction learns from the logs named, groups held out from their own.
///
/// # Errors
/// Logs that are too short.
pub fn linear(logs: &[Trajectory], fitted: &[usize], groups: &[usize]) -> Result<LinearReference> {
    let (mut all, mut of) = (Vec::new(), Vec::new());
    for &log in fitted {
        for stretch in stretches(&logs[log], logs[log].max_gap) {
            all.push(increments(&logs[log].poses[stretch], logs[log].frame));
            of.push(groups[log]);
        }
    }
    let all: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
    Ok(LinearReference::fit(&all, &of)?)
}
