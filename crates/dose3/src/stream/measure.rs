//! One window: from steps of motion to scores.

use super::Monitor;
use super::ring::Ring;
use crate::error::{Error, Result};
use dose3_datasets::{Frame, Window};
use dose3_ood::alarm::{SpanRow, SpanWorkspace, span_row};
use dose3_ood::detector::{SingleScores, SingleWorkspace};
use dose3_ood::{DetectorStatistics, Sample, Workspace};
use std::sync::PoisonError;

/// Buffers of one measurement.
#[derive(Clone, Debug)]
pub(super) struct Work {
    statistics: Workspace,
    row: Vec<f64>,
    /// Scale by scale.
    singles: Vec<SingleWorkspace>,
    span: SpanWorkspace,
    /// Steps between stamps, in order of size.
    pub sorted: Vec<f64>,
}

impl Work {
    pub fn new<'s>(scales: impl Iterator<Item = &'s DetectorStatistics>) -> Result<Self> {
        let singles = scales.map(DetectorStatistics::single_workspace);
        Ok(Self {
            statistics: Workspace::default(),
            row: Vec::new(),
            singles: singles.collect::<Result<_, _>>()?,
            span: SpanWorkspace::default(),
            sorted: Vec::new(),
        })
    }

    /// Scores of the last window of a scale; none where a statistic is not finite.
    pub fn measure(
        &mut self,
        monitor: &Monitor,
        scale: usize,
        ring: &Ring,
        frame: Frame,
    ) -> Result<Option<SingleScores<'_>>> {
        let of = &monitor.scales()[scale];
        let measured = match &monitor.probe {
            None => self.of_steps(monitor, ring.steps(of.poses)),
            Some(_) => self.of_poses(monitor, ring, frame),
        };
        match measured {
            Ok(()) => {}
            Err(Error::Statistics(dose3_ood::Error::NotFinite { .. })) => return Ok(None),
            Err(error) => return Err(error),
        }
        let work = &mut self.singles[scale];
        Ok(Some(of.statistics.score_window(&self.row, work)?))
    }

    /// The numbers of the last `poses`; none where one is not finite.
    pub fn span(&mut self, poses: usize, hertz: f64, ring: &Ring) -> Result<Option<SpanRow>> {
        match span_row(ring.steps(poses), hertz, &mut self.span) {
            Ok(row) => Ok(Some(row)),
            Err(dose3_ood::Error::NotFinite { .. }) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    fn of_steps(&mut self, monitor: &Monitor, steps: &[f64]) -> Result<()> {
        let sample = Sample {
            increments: Some(steps),
            linear: monitor.header.reference.linear.as_ref(),
            ..Sample::default()
        };
        let set = &monitor.header.statistics.config().statistics;
        Ok(set.evaluate_into(&sample, &mut self.statistics, &mut self.row)?)
    }

    fn of_poses(&mut self, monitor: &Monitor, ring: &Ring, frame: Frame) -> Result<()> {
        let Some(probe) = &monitor.probe else {
            return Ok(());
        };
        let log = ring.window(monitor.poses(), frame);
        let window = Window {
            trajectory: 0,
            start: 0,
            length: log.len(),
        };
        let set = &monitor.header.statistics.config().statistics;
        // A probe holds no half-written state.
        let mut probe = probe.lock().unwrap_or_else(PoisonError::into_inner);
        probe.measure(std::slice::from_ref(&log), &[window], |measured| {
            self.row = measured.row(set)?;
            Ok::<(), Error>(())
        })
    }
}
