//! What `benchmark --all` runs: one job a network and way of evaluating it.

use super::measure;
use super::rows::{BOTH_NOISES, NETWORK, PLAIN, READINGS, Row, TRAINING_SETS};
use crate::networks::{self, KITTI};
use dose3_diffusion::NoiseSharing;
use serde::Serialize;

/// Most windows a set in the main table.
pub const MAIN: usize = 700;
/// Most windows a set in the other tables.
const SIDE: usize = 400;

/// How the data is changed before it is scored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Change {
    /// Not at all.
    None,
    /// RobotCar's roll, pitch and yaw are converted from degrees to radians although they are radians, as
    /// in the authors' code: every angle shrinks 57 times.
    DegreesTwice,
    /// Every set is divided by its own largest displacement, the tested set too, as in the authors' code.
    OwnScale,
}

/// A network and a way of evaluating it.
#[derive(Clone, Debug, Serialize)]
pub struct Job {
    /// Its name in results.
    pub key: String,
    /// The network's name in [`crate::networks`].
    pub network: &'static str,
    /// Weights as they are before training, in the network's shape.
    pub untrained: bool,
    /// Seed of noise, density, bootstrap, and of untrained weights.
    pub seed: u64,
    /// The rows.
    pub rows: Vec<Row>,
    /// Most windows a set.
    pub most: usize,
    /// What is done to the data.
    pub change: Change,
    /// Whether this is a job of the main table, which is given intervals and ROC curves.
    pub main: bool,
}

impl Job {
    fn new(key: impl Into<String>, network: &'static str, rows: &[Row]) -> Self {
        Self {
            key: key.into(),
            network,
            untrained: false,
            seed: 0,
            rows: rows.to_vec(),
            most: SIDE,
            change: Change::None,
            main: false,
        }
    }

    /// About how many elements of windows the networks see, for estimates of time.
    pub fn work(&self, quick: bool, sets: usize) -> u64 {
        let (length, steps) = networks::settings(self.network)
            .map(|s| (s.window, s.diffusion_steps()))
            .unwrap_or((128, 30));
        let networks = self
            .passes()
            .into_iter()
            .filter(|(noise, _)| noise.is_some());
        let draws: usize = networks.map(|(_, draws)| draws).sum();
        let (most, steps) = measure::reduced(quick, self.most, steps);
        (most * sets * steps * length * draws) as u64
    }

    /// The kinds of noise that its rows need, each with the most draws; none for rows without a network.
    pub fn passes(&self) -> Vec<(Option<NoiseSharing>, usize)> {
        let mut passes: Vec<(Option<NoiseSharing>, usize)> = Vec::new();
        for row in &self.rows {
            match passes.iter_mut().find(|(noise, _)| *noise == row.noise) {
                Some((_, draws)) => *draws = row.draws.max(*draws),
                None => passes.push((row.noise, row.draws)),
            }
        }
        passes
    }
}

/// Networks of the main table, one a training seed.
pub const SEEDS: [&str; 3] = [KITTI, "kitti-seed1", "kitti-seed2"];
/// The network that the tables of lengths, steps and readings compare with.
pub const REFERENCE: &str = "kitti-1500";
/// The table of training sets: letter and network.
pub const TRAINED_ON: [(char, &str); 3] = [
    ('O', "robotcar-1500"),
    ('K', REFERENCE),
    ('I', "iros20-1500"),
];
/// The table of sequence lengths.
pub const LENGTHS: [(usize, &str); 4] = [
    (64, "kitti-length64"),
    (128, REFERENCE),
    (256, "kitti-length256"),
    (512, "kitti-length512"),
];
/// The table of diffusion steps.
pub const STEPS: [(usize, &str); 4] = [
    (5, "kitti-steps5"),
    (10, "kitti-steps10"),
    (15, "kitti-steps15"),
    (30, REFERENCE),
];

/// All jobs; `quick` leaves out the training seeds after the first.
pub fn plan(quick: bool) -> Vec<Job> {
    let main: Vec<Row> = NETWORK.into_iter().chain(PLAIN).collect();
    let seeds = if quick { 1 } else { SEEDS.len() };
    let mut jobs = Vec::new();
    for (seed, network) in SEEDS.iter().take(seeds).enumerate() {
        jobs.push(Job {
            seed: seed as u64,
            most: MAIN,
            main: true,
            ..Job::new(format!("main-{network}"), network, &main)
        });
    }
    jobs.push(Job {
        untrained: true,
        ..Job::new("untrained", KITTI, &NETWORK)
    });
    jobs.push(Job {
        most: MAIN,
        main: true,
        ..Job::new("motion", "kitti-motion", &main)
    });
    jobs.push(Job {
        untrained: true,
        ..Job::new("motion-untrained", "kitti-motion", &NETWORK)
    });
    for (_, network) in TRAINED_ON {
        jobs.push(Job::new(network, network, &TRAINING_SETS));
    }
    let others = LENGTHS.iter().chain(&STEPS).map(|(_, network)| *network);
    for network in others.filter(|n| *n != REFERENCE) {
        jobs.push(Job::new(network, network, &BOTH_NOISES));
    }
    jobs.push(Job::new("readings", KITTI, &READINGS));
    jobs.push(Job {
        change: Change::DegreesTwice,
        ..Job::new("degrees-twice", KITTI, &BOTH_NOISES)
    });
    jobs.push(Job::new("kitti-linear", "kitti-linear", &BOTH_NOISES));
    for (key, change) in [
        ("stored-scale", Change::None),
        ("own-scale", Change::OwnScale),
    ] {
        jobs.push(Job {
            change,
            ..Job::new(key, "kitti-onescale", &BOTH_NOISES)
        });
    }
    jobs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::networks;
    use std::collections::BTreeSet;

    #[test]
    fn jobs_have_names_of_their_own_and_networks_that_exist() {
        let jobs = plan(false);
        let keys: BTreeSet<&String> = jobs.iter().map(|j| &j.key).collect();
        assert_eq!(keys.len(), jobs.len());
        for job in &jobs {
            assert!(job.network == KITTI || networks::settings(job.network).is_ok());
        }
        // No network of the study is trained for nothing.
        for network in &networks::NETWORKS {
            assert!(
                jobs.iter().any(|j| j.network == network.name),
                "{}",
                network.name
            );
        }
    }

    #[test]
    fn a_pass_has_the_most_draws_of_its_rows() {
        let jobs = plan(true);
        let readings = jobs.iter().find(|j| j.key == "readings").unwrap();
        let passes = readings.passes();
        assert_eq!(
            passes,
            [
                (Some(NoiseSharing::PerWindow), 4),
                (Some(NoiseSharing::Common), 2)
            ]
        );
    }
}
