//! Training of the baselines.

use super::Baseline;
use super::input::{CHANNELS, motions, numbers};
use super::network::Network;
use super::weights::{Learned, Record};
use crate::roles::KITTI_TESTED;
use anyhow::{Context, Result, ensure};
use dose3::model_file::LogRecord;
use dose3::train::{HoldOut, split};
use dose3_baselines::{GlowConfig, GlowRatio, Jem, JemConfig, Manoeuvres, Progress, Sequences};
use dose3_datasets::{Kind, Representation, Scaling, Trajectory, Window, windows};
use std::time::Instant;

/// Elements of a window.
pub const LENGTH: usize = 128;
/// Bins of turning rate and of speed whose combinations are JEM's classes.
const BINS: usize = 3;

/// Settings of [`train_on`].
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Which baseline.
    pub baseline: Baseline,
    /// `paper` or `motion`.
    pub representation: Kind,
    /// Seed.
    pub seed: u64,
    /// Optimiser steps instead of the default ones.
    pub steps: Option<usize>,
}

/// Trains on all windows of `logs` at stride 1; constants and class edges are taken from them, too.
/// A JEM that diverges is no error: its record says so.
///
/// # Errors
/// Logs without a window, settings out of range, a Glow that diverges.
pub fn train_on(
    logs: &[Trajectory],
    options: Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Learned> {
    let start = Instant::now();
    let kind = options.representation;
    let first = logs.first().context("no log to train on")?;
    let cut = windows(logs, kind.poses(LENGTH), 1);
    ensure!(
        !cut.is_empty(),
        "no training log has the {} poses of a window",
        kind.poses(LENGTH)
    );
    let scaling = match kind {
        Kind::Paper => Scaling::PerWindow,
        Kind::Motion => Scaling::PerAxis,
    };
    let representation = Representation::fit(kind, scaling, logs, &cut)?;
    let data = numbers(logs, &cut, representation, LENGTH)?;
    let sequences = Sequences {
        length: LENGTH,
        channels: CHANNELS,
        data: &data,
    };
    let (network, manoeuvres) = match options.baseline {
        Baseline::Glow => (glow(sequences, options, progress)?, None),
        Baseline::Jem => {
            let (network, manoeuvres) = jem(sequences, logs, &cut, options, progress)?;
            (network, Some(manoeuvres))
        }
    };
    let record = Record {
        baseline: options.baseline,
        representation,
        length: LENGTH,
        rate: first.rate.hertz,
        seed: options.seed,
        logs: logs.iter().map(LogRecord::from).collect(),
        windows: cut.len(),
        manoeuvres,
        outcome: network.outcome(),
        version: env!("CARGO_PKG_VERSION").to_string(),
    };
    Learned::new(&network, &record, start.elapsed().as_secs_f64())
}

fn glow(
    data: Sequences<'_>,
    options: Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Network> {
    let mut config = GlowConfig::default();
    config.steps = options.steps.unwrap_or(config.steps);
    let trained = GlowRatio::train(data, &config, options.seed, progress)?;
    Ok(Network::Glow(Box::new(trained)))
}

fn jem(
    data: Sequences<'_>,
    logs: &[Trajectory],
    windows: &[Window],
    options: Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<(Network, Manoeuvres)> {
    let mut config = JemConfig::default();
    config.steps = options.steps.unwrap_or(config.steps);
    let motions = motions(logs, windows)?;
    let manoeuvres = Manoeuvres::fit(&motions, BINS)?;
    let labels = manoeuvres.labels(&motions);
    let classes = manoeuvres.classes();
    let trained = Jem::train(data, &labels, classes, &config, options.seed, progress)?;
    Ok((Network::Jem(Box::new(trained)), manoeuvres))
}

/// The logs of KITTI without those that are tested.
///
/// # Errors
/// No other log.
pub fn training_logs(kitti: &[Trajectory]) -> Result<Vec<Trajectory>> {
    let held_out = HoldOut::Names(KITTI_TESTED.map(String::from).to_vec());
    let (training, _) = split(kitti, &held_out, 0)?;
    Ok(training)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_datasets::synthetic::{Platform, trajectory};

    /// Short logs that differ in speed, named as those of KITTI.
    fn logs() -> Vec<Trajectory> {
        let names = ["00", "01", "07", "09", "10"];
        let log = |(i, name): (usize, &&str)| {
            let mut log = trajectory(Platform::Vehicle, i as u64, 260, 10.0);
            let faster = if KITTI_TESTED.contains(name) {
                3.0
            } else {
                1.0
            };
            log.poses
                .iter_mut()
                .for_each(|pose| pose.translation *= faster);
            (log.name, log.group) = (name.to_string(), name.to_string());
            log
        };
        names.iter().enumerate().map(log).collect()
    }

    fn options(baseline: Baseline) -> Options {
        Options {
            baseline,
            representation: Kind::Motion,
            seed: 3,
            steps: Some(2),
        }
    }

    #[test]
    fn constants_and_class_edges_are_those_of_the_training_logs() {
        let all = logs();
        let training = training_logs(&all).unwrap();
        assert_eq!(
            training.iter().map(|t| &t.name[..]).collect::<Vec<_>>(),
            ["00", "01"]
        );
        let learned = train_on(&training, options(Baseline::Jem), &mut |_| ()).unwrap();
        let record = &learned.record;
        assert_eq!(
            record.logs,
            training.iter().map(LogRecord::from).collect::<Vec<_>>()
        );
        let fitted = |logs: &[Trajectory]| {
            let cut = windows(logs, LENGTH + 1, 1);
            let scaling = Scaling::PerAxis;
            (
                Representation::fit(Kind::Motion, scaling, logs, &cut).unwrap(),
                Some(Manoeuvres::fit(&motions(logs, &cut).unwrap(), BINS).unwrap()),
                cut.len(),
            )
        };
        let recorded = (
            record.representation,
            record.manoeuvres.clone(),
            record.windows,
        );
        assert_eq!(recorded, fitted(&training));
        let others = fitted(&all);
        assert!(recorded.0 != others.0 && recorded.1 != others.1);
    }

    #[test]
    fn a_file_scores_as_what_was_trained() {
        let logs = logs();
        let folder = tempfile::tempdir().unwrap();
        let cut = windows(&logs[3..], LENGTH + 1, 50);
        assert!(cut.len() > 4);
        for baseline in Baseline::ALL {
            let learned = train_on(&logs[..1], options(baseline), &mut |_| ()).unwrap();
            let path = folder.path().join(baseline.name());
            learned.write(&path).unwrap();
            let direct = learned.score(&logs[3..], &cut).unwrap();
            assert!(direct.iter().all(|score| score.is_finite()));
            assert!(direct[0] != direct[1]);
            let read = super::super::of_file(&path, &logs[3..], &cut).unwrap();
            assert_eq!(read, direct);
            assert_eq!(Learned::read(&path).unwrap().record, learned.record);
            assert!(learned.record.outcome.contains("2 steps"));
        }
    }

    #[test]
    fn logs_of_another_rate_or_windows_of_another_length_are_refused() {
        let logs = logs();
        let learned = train_on(&logs[..1], options(Baseline::Glow), &mut |_| ()).unwrap();
        let fast = [trajectory(Platform::Vehicle, 1, 260, 20.0)];
        let refusal = learned.score(&fast, &windows(&fast, LENGTH + 1, 50));
        assert!(refusal.unwrap_err().to_string().contains("20.0 Hz"));
        assert!(learned.score(&logs, &windows(&logs, LENGTH, 50)).is_err());
    }
}
