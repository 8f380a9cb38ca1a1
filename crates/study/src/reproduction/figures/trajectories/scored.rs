//! A detector with the paper's statistics, and what it says of the poses of a log.

use super::super::FigureInput;
use super::{ALPHA, DRAWS, POSES};
use crate::numbers::evenly;
use crate::sets::DataSet;
use anyhow::{Context, Result, bail};
use dose3::{Probe, ProbePlan};
use dose3_datasets::{Trajectory, Window};
use dose3_diffusion::NoiseSharing;
use dose3_ood::folds::Folds;
use dose3_ood::{DensityModel, Reference, Score, StatisticsSet, Unit, cross_fit};
use std::collections::BTreeSet;
use std::ops::Range;

/// Turns windows into rows of statistics.
pub struct Scorer {
    probe: Probe,
    set: StatisticsSet,
}

impl Scorer {
    /// Loads the networks.
    ///
    /// # Errors
    /// A backend that cannot be had.
    pub fn new(input: &FigureInput<'_>) -> Result<Self> {
        let set: StatisticsSet = "paper24".parse()?;
        let plan = ProbePlan {
            steps: input.kitti.header.process.steps,
            draws: DRAWS,
            seed: input.seed,
            sharing: NoiseSharing::Shared,
        };
        Ok(Self {
            probe: Probe::for_sets(input.kitti, &plan, [&set], input.computing)?,
            set,
        })
    }

    fn rows(&mut self, logs: &[Trajectory], windows: &[Window]) -> Result<Vec<Vec<f64>>> {
        Ok(self.probe.rows(logs, windows, &self.set)?)
    }
}

/// A density with what held-out trusted windows score.
pub struct Detector {
    /// The density over the trusted windows.
    density: DensityModel,
    /// Scores of the trusted windows by densities that have not seen them.
    pub reference: Reference,
    /// Trusted logs.
    pub logs: usize,
    /// Those of them that the network was trained on.
    pub trained_on: usize,
    /// What was left out with a window: its log, or a stretch of it.
    pub left_out: &'static str,
}

impl Detector {
    /// Fits on the logs of `set` that are not tested.
    ///
    /// # Errors
    /// Too few windows.
    pub fn fit(input: &FigureInput<'_>, scorer: &mut Scorer, set: &DataSet) -> Result<Self> {
        let trusted = set.windows.iter().zip(set.groups());
        let trusted: Vec<(Window, usize)> = trusted
            .filter(|(w, _)| !set.test_logs.contains(&w.trajectory))
            .map(|(w, group)| (*w, group))
            .collect();
        let (windows, groups): (Vec<Window>, Vec<usize>) =
            evenly(&trusted, input.max_windows).into_iter().unzip();
        let rows = scorer.rows(&set.trajectories, &windows)?;
        let config = input.density.clone().with_seed(input.seed);
        let context = || {
            format!(
                "no detector can be fitted on {} windows of {}",
                rows.len(),
                set.name
            )
        };
        let density = DensityModel::fit(&rows, &groups, &config).with_context(context)?;
        let held_out = cross_fit(&rows, &groups, &config, Folds::Auto, guard(&windows))
            .with_context(context)?;
        let logs: BTreeSet<usize> = windows.iter().map(|w| w.trajectory).collect();
        let of_logs = logs.iter().map(|log| &set.trajectories[*log]);
        Ok(Self {
            density,
            reference: Reference::new(held_out.scores)?,
            trained_on: of_logs.filter(|log| trained_on(input, log)).count(),
            logs: logs.len(),
            left_out: match held_out.plan.unit() {
                Unit::Log => "log",
                Unit::Block => "stretch of the log",
            },
        })
    }
}

/// Whether the network was trained on a log.
fn trained_on(input: &FigureInput<'_>, log: &Trajectory) -> bool {
    let fingerprint = log.fingerprint();
    let mut training = input.kitti.header.training.logs.iter();
    training.any(|record| record.sha256 == fingerprint)
}

/// The largest number of windows that share poses with a window before them.
fn guard(windows: &[Window]) -> usize {
    let after = |i: usize| {
        let first = windows[i];
        let rest = windows[i + 1..].iter();
        rest.take_while(|w| {
            w.trajectory == first.trajectory && w.start < first.start + first.length
        })
        .count()
    };
    (0..windows.len()).map(after).max().unwrap_or(0)
}

/// A stretch of a log with its scores.
pub struct ScoredLog<'a> {
    /// The set it is of.
    pub set: &'a DataSet,
    /// The log.
    pub log: &'a Trajectory,
    /// The poses that are drawn.
    pub poses: Range<usize>,
    /// For each of them the mean of -log10 p over the windows that hold it; none where no window does.
    pub surprise: Vec<Option<f64>>,
    /// Windows scored.
    pub windows: usize,
    /// Those beyond the threshold.
    pub beyond: usize,
    /// Whether the network was trained on the log.
    pub trained_on: bool,
}

impl<'a> ScoredLog<'a> {
    /// Scores the windows among the first [`POSES`] poses of the `log`-th log of `set`.
    ///
    /// # Errors
    /// A log without windows, a failing network.
    pub fn new(
        input: &FigureInput<'_>,
        scorer: &mut Scorer,
        detector: &Detector,
        set: &'a DataSet,
        log: usize,
    ) -> Result<Self> {
        let trajectory = &set.trajectories[log];
        let of_log: Vec<Window> = set
            .windows
            .iter()
            .filter(|w| w.trajectory == log)
            .copied()
            .collect();
        let Some(start) = of_log.first().map(|w| w.start) else {
            bail!("log {} has no window", trajectory.name);
        };
        let end = trajectory.len().min(start + POSES);
        let mut windows = of_log;
        windows.retain(|w| w.start + w.length <= end);
        let cut = windows.len() > input.max_windows;
        windows.truncate(input.max_windows);
        let poses = match windows.last() {
            Some(last) if cut => start..last.start + last.length,
            _ => start..end,
        };
        let rows = scorer.rows(&set.trajectories, &windows)?;
        let scores = detector.density.scores(&rows)?;
        let threshold = detector.reference.threshold(ALPHA);
        Ok(Self {
            set,
            log: trajectory,
            surprise: surprise(&poses, &windows, &scores, &detector.reference),
            poses,
            windows: windows.len(),
            beyond: scores.iter().filter(|s| **s > threshold).count(),
            trained_on: trained_on(input, trajectory),
        })
    }

    /// `KITTI log 07 (poses 0 to 1100): 12 of 31 windows beyond.`
    pub fn describe(&self) -> String {
        let trained = match self.trained_on {
            true => ", a log the network was trained on",
            false => "",
        };
        format!(
            "{} log {} (poses {} to {}{trained}): {} of {} windows beyond.",
            self.set.name,
            self.log.name,
            self.poses.start,
            self.poses.end - 1,
            self.beyond,
            self.windows
        )
    }
}

fn surprise(
    poses: &Range<usize>,
    windows: &[Window],
    scores: &[Score],
    reference: &Reference,
) -> Vec<Option<f64>> {
    let mut sums = vec![(0.0, 0_u32); poses.len()];
    for (window, score) in windows.iter().zip(scores) {
        let surprise = -reference.p_value(*score).log10();
        let first = window.start - poses.start;
        for (sum, count) in &mut sums[first..first + window.length] {
            *sum += surprise;
            *count += 1;
        }
    }
    let mean = |(sum, count): (f64, u32)| (count > 0).then(|| sum / f64::from(count));
    sums.into_iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(trajectory: usize, start: usize) -> Window {
        Window {
            trajectory,
            start,
            length: 4,
        }
    }

    #[test]
    fn a_pose_has_the_mean_of_the_windows_that_hold_it() {
        let reference = Reference::new((0..9).map(|s| Score::new(f64::from(s))).collect()).unwrap();
        // p-values 1 and 0.1: -log10 p is 0 and 1.
        let scores = [Score::new(-1.0), Score::new(99.0)];
        let at = surprise(
            &(10..18),
            &[window(0, 10), window(0, 12)],
            &scores,
            &reference,
        );
        let expected = [0.0, 0.0, 0.5, 0.5, 1.0, 1.0];
        for (found, expected) in at.iter().zip(expected) {
            assert!((found.unwrap() - expected).abs() < 1e-12, "{at:?}");
        }
        assert_eq!(at[6..], [None, None]);
    }

    #[test]
    fn windows_that_share_poses_are_counted() {
        assert_eq!(
            guard(&[window(0, 0), window(0, 2), window(0, 3), window(1, 3)]),
            2
        );
        assert_eq!(guard(&[window(0, 0), window(0, 4)]), 0);
        assert_eq!(guard(&[]), 0);
    }
}
