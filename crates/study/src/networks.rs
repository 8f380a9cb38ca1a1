//! The networks behind the tables of the study, as values. Their weights lie in `crates/study/weights`.

use crate::training::Training;
use anyhow::{Context, Result};
use dose3::{Model, built_in};
use dose3_datasets::Scaling;
use dose3_diffusion::NoiseSchedule;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A network, and how it is trained.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Network {
    /// Name of its file.
    pub name: &'static str,
    /// Its training.
    pub training: Training,
}

/// Networks of 1,500 optimiser steps, which the comparisons of training sets, lengths, steps and readings are
/// between. They all see the same number of poses a step.
const SHORT: Training = Training {
    steps: 1500,
    ..Training::PAPER
};

const fn network(name: &'static str, training: Training) -> Network {
    Network { name, training }
}

const fn of_length(name: &'static str, window: usize) -> Network {
    let batch = SHORT.batch * SHORT.window / window;
    network(
        name,
        Training {
            window,
            batch,
            ..SHORT
        },
    )
}

const fn of_steps(name: &'static str, diffusion_steps: usize) -> Network {
    network(
        name,
        Training {
            diffusion_steps,
            ..SHORT
        },
    )
}

const fn of_set(name: &'static str, letter: char, training: Training) -> Network {
    network(
        name,
        Training {
            set: Some(letter),
            ..training
        },
    )
}

const fn of_seed(name: &'static str, seed: u64) -> Network {
    network(
        name,
        Training {
            seed,
            ..Training::PAPER
        },
    )
}

/// The shipped model of `paper` windows, training seed 0.
pub const KITTI: Network = network("kitti", Training::PAPER);
/// The same with training seed 1.
pub const KITTI_SEED1: Network = of_seed("kitti-seed1", 1);
/// The same with training seed 2.
pub const KITTI_SEED2: Network = of_seed("kitti-seed2", 2);
/// The short network that all others of 1,500 steps are compared with.
pub const KITTI_1500: Network = network("kitti-1500", SHORT);
/// Trained on RobotCar.
pub const ROBOTCAR_1500: Network = of_set("robotcar-1500", 'O', SHORT);
/// Trained on IROS20.
pub const IROS20_1500: Network = of_set("iros20-1500", 'I', SHORT);
/// Windows of 64 poses.
pub const LENGTH64: Network = of_length("kitti-length64", 64);
/// Windows of 256 poses.
pub const LENGTH256: Network = of_length("kitti-length256", 256);
/// Windows of 512 poses.
pub const LENGTH512: Network = of_length("kitti-length512", 512);
/// 5 diffusion steps.
pub const STEPS5: Network = of_steps("kitti-steps5", 5);
/// 10 diffusion steps.
pub const STEPS10: Network = of_steps("kitti-steps10", 10);
/// 15 diffusion steps.
pub const STEPS15: Network = of_steps("kitti-steps15", 15);
/// Rotations with a linear noise schedule.
pub const LINEAR: Network = network(
    "kitti-linear",
    Training {
        rotation: NoiseSchedule::LINEAR,
        ..SHORT
    },
);
/// One scale for all windows.
pub const ONE_SCALE: Network = network(
    "kitti-onescale",
    Training {
        scaling: Scaling::PerDataset,
        ..SHORT
    },
);
/// Body-frame motion, trained on KITTI alone.
pub const KITTI_MOTION: Network = of_set(
    "kitti-motion",
    'K',
    Training {
        steps: 1500,
        ..Training::MOTION
    },
);

/// Networks beside the shipped one.
pub const NETWORKS: [Network; 14] = [
    KITTI_SEED1,
    KITTI_SEED2,
    KITTI_1500,
    ROBOTCAR_1500,
    IROS20_1500,
    LENGTH64,
    LENGTH256,
    LENGTH512,
    STEPS5,
    STEPS10,
    STEPS15,
    LINEAR,
    ONE_SCALE,
    KITTI_MOTION,
];

/// Where weights lie.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("weights")
}

impl Network {
    /// The network of the study that has this name.
    ///
    /// # Errors
    /// A name that none has.
    pub fn named(name: &str) -> Result<Self> {
        let found = NETWORKS.into_iter().find(|n| n.name == name);
        found.with_context(|| {
            let known = NETWORKS.map(|n| n.name).join(", ");
            format!("no network is named {name}; there are {known}")
        })
    }

    /// The file of its weights.
    pub fn file(&self) -> PathBuf {
        folder().join(format!("{}.dose3", self.name))
    }

    /// Its weights.
    ///
    /// # Errors
    /// A file that is missing or cannot be read, with the command that makes it.
    pub fn load(&self) -> Result<Model> {
        if self.name == KITTI.name {
            return Ok(built_in::paper()?);
        }
        Model::read(&self.file()).with_context(|| {
            let name = self.name;
            format!("`cargo xtask train-release-model --study {name}` trains the network {name}")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_are_different_and_weights_were_trained_as_the_values_say() {
        let names: BTreeSet<&str> = NETWORKS.iter().map(|n| n.name).collect();
        assert_eq!(names.len(), NETWORKS.len());
        assert!(Network::named("kitti-length65").is_err());
        for network in NETWORKS.into_iter().chain([KITTI]) {
            let header = network.load().unwrap().header;
            let (found, said) = (&header.training.config, network.training);
            assert_eq!(header.window, said.window, "{}", network.name);
            assert_eq!(header.process, said.process(), "{}", network.name);
            assert_eq!(
                (found.steps, found.batch, found.seed),
                (said.steps, said.batch, said.seed),
                "{}",
                network.name
            );
            assert_eq!(header.representation.kind, said.representation);
        }
    }

    #[test]
    fn the_compared_lengths_see_the_same_number_of_poses_a_step() {
        for network in [KITTI_1500, LENGTH64, LENGTH256, LENGTH512] {
            let training = network.training;
            assert_eq!(training.window * training.batch, 128 * 64);
        }
    }
}
