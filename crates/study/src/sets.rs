//! The data sets of the benchmark: the paper's three, or three synthetic ones.

use crate::data::DataRoot;
use crate::roles::KITTI_TESTED;
use anyhow::{Context, Result, bail};
use dose3_datasets::synthetic::{Platform, suite};
use dose3_datasets::{LoadOptions, LogGroups, Trajectory, Window, load_all, windows};
use std::collections::BTreeSet;

/// Poses between the starts of windows, or a multiple of it.
pub const STRIDE: usize = 32;

/// One data set with its windows.
#[derive(Clone)]
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
    /// Whether the network was trained on the test logs, because no other log is there.
    pub test_logs_trained_on: bool,
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
            test_logs_trained_on: false,
        })
    }

    /// Cuts windows, and picks the test logs as [`Self::choose_test_logs`].
    pub fn prepare(
        &mut self,
        poses: usize,
        stride: usize,
        held_out: &[String],
        trained: &[String],
    ) {
        self.windows = windows(&self.trajectories, poses, stride);
        self.choose_test_logs(held_out, trained);
    }

    /// Cuts windows at the smallest multiple of [`STRIDE`] that leaves at most `most` of them, or one a
    /// gap-free stretch where that is more; answers the stride.
    pub fn cut(&mut self, poses: usize, most: usize) -> usize {
        let lengths = self.trajectories.iter().map(|log| log.poses.len());
        let longest = lengths.max().unwrap_or(0);
        let mut chosen = STRIDE;
        loop {
            self.windows = windows(&self.trajectories, poses, chosen);
            if self.windows.len() <= most || chosen > longest {
                return chosen;
            }
            chosen += STRIDE;
        }
    }

    /// Picks the test logs: those of `held_out` (hashes of the network's own
    /// held-out logs) where this set has them, else every second group of the logs that are not
    /// among `trained`; only where there is no such log, of all.
    pub fn choose_test_logs(&mut self, held_out: &[String], trained: &[String]) {
        let all = 0..self.trajectories.len();
        let hashes: Vec<String> = self
            .trajectories
            .iter()
            .map(Trajectory::fingerprint)
            .collect();
        let known: BTreeSet<usize> = all
            .clone()
            .filter(|i| held_out.contains(&hashes[*i]))
            .collect();
        if !known.is_empty() {
            self.test_logs = known;
            return;
        }
        let fresh: Vec<usize> = all
            .clone()
            .filter(|i| !trained.contains(&hashes[*i]))
            .collect();
        self.test_logs_trained_on = fresh.is_empty();
        let candidates = if fresh.is_empty() {
            all.collect()
        } else {
            fresh
        };
        let groups: BTreeSet<&str> = candidates
            .iter()
            .map(|i| self.trajectories[*i].group.as_str())
            .collect();
        let skipped = usize::from(groups.len() > 1);
        let tested: BTreeSet<&str> = groups.into_iter().skip(skipped).step_by(2).collect();
        self.test_logs = candidates
            .into_iter()
            .filter(|i| tested.contains(self.trajectories[*i].group.as_str()))
            .collect();
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
        LogGroups::of(&self.trajectories).of_windows(&self.windows)
    }
}

/// The real sets: letter, name and folder.
const REAL: [(char, &str, &str); 3] = [
    ('O', "Oxford RobotCar", "robotcar"),
    ('K', "KITTI", "kitti/poses"),
    ('I', "IROS20", "iros20"),
];

/// Those of Oxford, KITTI and IROS20 that are under `root`.
///
/// # Errors
/// A data set that is there and cannot be read.
pub fn real(root: &DataRoot) -> Result<Vec<DataSet>> {
    let there = REAL
        .iter()
        .filter(|(_, _, folder)| root.path.join(folder).is_dir());
    there.map(|(letter, ..)| real_set(root, *letter)).collect()
}

/// The real set of that letter; the others are not read.
///
/// # Errors
/// A letter that none has, a folder that is missing or cannot be read.
pub fn real_set(root: &DataRoot, letter: char) -> Result<DataSet> {
    let Some((_, name, folder)) = REAL.iter().find(|(known, ..)| *known == letter) else {
        bail!("no data set has the letter {letter}; they are O, K and I");
    };
    let path = root.path.join(folder);
    if !path.is_dir() {
        bail!(
            "{name} is missing: {folder} is no folder in {}",
            root.source
        );
    }
    let trajectories = load_all(std::slice::from_ref(&path), &LoadOptions::default())
        .with_context(|| format!("{name} cannot be read from {}", path.display()))?;
    DataSet::new(letter, name, trajectories)
}

/// Fingerprints of the KITTI logs that no network of the benchmarks is trained on.
pub fn kitti_held_out(logs: &[Trajectory]) -> Vec<String> {
    logs.iter()
        .filter(|log| KITTI_TESTED.contains(&log.name.as_str()))
        .map(Trajectory::fingerprint)
        .collect()
}

/// Logs in each synthetic set of the benchmark.
pub const fn synthetic_logs(quick: bool) -> usize {
    if quick { 4 } else { 8 }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_set_is_read_without_the_others() {
        let folder = tempfile::tempdir().unwrap();
        let poses = folder.path().join("kitti/poses");
        std::fs::create_dir_all(&poses).unwrap();
        for name in ["00.txt", "01.txt"] {
            let line = |i: i32| format!("1 0 0 0 0 1 0 0 0 0 1 {i}\n");
            std::fs::write(poses.join(name), (0..5).map(line).collect::<String>()).unwrap();
        }
        std::fs::create_dir(folder.path().join("iros20")).unwrap();
        std::fs::write(folder.path().join("iros20/traj.npy"), "broken").unwrap();
        let root = DataRoot::find(Some(folder.path())).unwrap();
        assert_eq!(real_set(&root, 'K').unwrap().trajectories.len(), 2);
        assert!(real(&root).is_err());
        assert!(real_set(&root, 'O').is_err() && real_set(&root, 'X').is_err());
    }

    #[test]
    fn a_cut_takes_the_smallest_stride_that_leaves_few_enough_windows() {
        let mut set = synthetic(0, 3).unwrap().remove(0);
        assert_eq!(set.cut(64, usize::MAX), STRIDE);
        let all = set.windows.len();
        let stride = set.cut(64, all / 3);
        assert!(set.windows.len() <= all / 3);
        set.windows = windows(&set.trajectories, 64, stride - STRIDE);
        assert!(set.windows.len() > all / 3);
        // Fewer than one a log cannot be had.
        set.cut(64, 1);
        assert!(set.windows.len() >= set.trajectories.len());
    }
}
