//! The data sets of the benchmark: the paper's three, or three synthetic ones.

use crate::data::DataRoot;
use anyhow::{Context, Result, bail};
use dose3_datasets::synthetic::{Platform, suite};
use dose3_datasets::{LoadOptions, Trajectory, Window, load_all, windows};
use std::collections::BTreeSet;

/// One data set with its windows.
pub struct DataSet {
    /// The letter it has in tables.
    pub letter: char,
    /// Its full name.
    pub name: &'static str,
    /// The logs.
    pub trajectories: Vec<Trajectory>,
    /// Windows over all logs.
    pub windows: Vec<Window>,
    /// Logs (indices) whose windows are the in-distribution test windows; the density is fitted
    /// on the others.
    pub test_logs: BTreeSet<usize>,
}

impl DataSet {
    fn new(letter: char, name: &'static str, mut trajectories: Vec<Trajectory>) -> Result<Self> {
        trajectories.sort_by(|a, b| a.name.cmp(&b.name));
        if trajectories.len() < 2 {
            bail!(
                "{name} has {} log(s); a log to fit and one to test are needed",
                trajectories.len()
            );
        }
        Ok(Self {
            letter,
            name,
            trajectories,
            windows: Vec::new(),
            test_logs: BTreeSet::new(),
        })
    }

    /// Cuts windows, and picks the test logs: those that `unseen` names (the network's own
    /// held-out logs) where this set has them, else every second group of logs.
    pub fn prepare(&mut self, poses: usize, stride: usize, unseen: &[String]) {
        self.windows = windows(&self.trajectories, poses, stride);
        let hashes: Vec<String> = self
            .trajectories
            .iter()
            .map(Trajectory::fingerprint)
            .collect();
        let known: BTreeSet<usize> = (0..hashes.len())
            .filter(|i| unseen.contains(&hashes[*i]))
            .collect();
        self.test_logs = if known.is_empty() {
            let groups: BTreeSet<&str> =
                self.trajectories.iter().map(|t| t.group.as_str()).collect();
            let tested: BTreeSet<&str> = groups.into_iter().skip(1).step_by(2).collect();
            (0..self.trajectories.len())
                .filter(|i| tested.contains(self.trajectories[*i].group.as_str()))
                .collect()
        } else {
            known
        };
    }

    /// Names of the logs that are tested as in-distribution.
    pub fn test_names(&self) -> Vec<String> {
        self.test_logs
            .iter()
            .map(|i| self.trajectories[*i].name.clone())
            .collect()
    }

    /// Names of the logs that the density is fitted on.
    pub fn fit_names(&self) -> Vec<String> {
        (0..self.trajectories.len())
            .filter(|i| !self.test_logs.contains(i))
            .map(|i| self.trajectories[i].name.clone())
            .collect()
    }

    /// The log that each window was cut from, logs of one group counted as one.
    pub fn groups(&self) -> Vec<usize> {
        let names: Vec<&str> = self
            .trajectories
            .iter()
            .map(|t| t.group.as_str())
            .collect::<BTreeSet<_>>()
            .into_iter()
            .collect();
        self.windows
            .iter()
            .map(|w| {
                let group = self.trajectories[w.trajectory].group.as_str();
                names.iter().position(|n| *n == group).unwrap_or_default()
            })
            .collect()
    }
}

/// Oxford, KITTI and IROS20 under `root`.
///
/// # Errors
/// A data set that is missing or cannot be read.
pub fn real(root: &DataRoot) -> Result<Vec<DataSet>> {
    [
        ('O', "Oxford RobotCar", "robotcar"),
        ('K', "KITTI", "kitti/poses"),
        ('I', "IROS20", "iros20"),
    ]
    .into_iter()
    .map(|(letter, name, folder)| {
        let path = root.path.join(folder);
        let trajectories = load_all(&[path.clone()], &LoadOptions::default())
            .with_context(|| format!("{name} cannot be read from {}", path.display()))?;
        DataSet::new(letter, name, trajectories)
    })
    .collect()
}

/// A vehicle, a hand-held object and a drone, generated from `seed`.
///
/// # Errors
/// Never with the logs that are generated here.
pub fn synthetic(seed: u64, logs: usize) -> Result<Vec<DataSet>> {
    [
        ('V', "synthetic vehicle", Platform::Vehicle),
        ('H', "synthetic hand-held object", Platform::Handheld),
        ('D', "synthetic drone", Platform::Drone),
    ]
    .into_iter()
    .map(|(letter, name, platform)| DataSet::new(letter, name, suite(platform, logs, seed)))
    .collect()
}
