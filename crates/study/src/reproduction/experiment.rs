//! What `benchmark --all` measures: experiments as data.

use crate::networks::{
    IROS20_1500, KITTI, KITTI_1500, KITTI_MOTION, KITTI_SEED1, KITTI_SEED2, LENGTH64, LENGTH256,
    LENGTH512, LINEAR, Network, ONE_SCALE, ROBOTCAR_1500, STEPS5, STEPS10, STEPS15,
};
use crate::passes::passes;
use crate::rows::{BOTH_NOISES, LEARNED, MAIN, NETWORK, READINGS, Row, Statistics, TRAINING_SETS};
use crate::split::Split;
use dose3_datasets::Kind;
use serde::Serialize;

/// Most windows a set in the main table.
pub const MAIN_WINDOWS: usize = 700;
/// Most windows a set in the other tables.
const SIDE_WINDOWS: usize = 400;

/// What ranks windows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Subject {
    /// A network of the study.
    Trained(Network),
    /// Weights as they are before training, in a network's shape.
    Untrained(Network),
    /// The learned baselines on windows of a representation.
    Learned(Kind),
}

/// How the data is changed before it is scored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Change {
    /// Not at all.
    None,
    /// RobotCar's roll, pitch and yaw are converted from degrees to radians although they are radians, as
    /// in the authors' code: every angle shrinks 57 times.
    DegreesTwice,
    /// Every set is divided by its own largest displacement, the tested set too, as in the authors' code.
    OwnScale,
}

/// What is seen of the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct View {
    /// Most windows a set.
    pub most: usize,
    /// What is done to it.
    pub change: Change,
}

/// What is measured at once. Results are found by what stands here, never by a name.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Experiment {
    /// What ranks windows.
    pub subject: Subject,
    /// Seed of noise, density, bootstrap and untrained weights; of training, for learned baselines.
    pub seed: u64,
    /// What is seen of the data.
    pub view: View,
    /// The rows.
    pub rows: &'static [Row],
    /// How ID test windows are chosen, one way after the other.
    pub splits: &'static [Split],
    /// Whether there are intervals of all resamples, and ROC curves.
    pub detailed: bool,
}

/// Networks of the main table, one a training seed.
const SEEDS: [Network; 3] = [KITTI, KITTI_SEED1, KITTI_SEED2];
/// The network that the tables of lengths, steps and readings compare with.
const REFERENCE: Network = KITTI_1500;
/// The table of training sets.
pub const TRAINED_ON: [(char, Network); 3] =
    [('O', ROBOTCAR_1500), ('K', REFERENCE), ('I', IROS20_1500)];
/// The table of sequence lengths.
pub const LENGTHS: [(usize, Network); 4] = [
    (64, LENGTH64),
    (128, REFERENCE),
    (256, LENGTH256),
    (512, LENGTH512),
];
/// The table of diffusion steps.
pub const STEPS: [(usize, Network); 4] =
    [(5, STEPS5), (10, STEPS10), (15, STEPS15), (30, REFERENCE)];

impl Experiment {
    const fn new(subject: Subject, rows: &'static [Row]) -> Self {
        Self {
            subject,
            seed: 0,
            view: View {
                most: SIDE_WINDOWS,
                change: Change::None,
            },
            rows,
            splits: &Split::ALL,
            detailed: false,
        }
    }

    const fn detailed(self) -> Self {
        Self {
            view: View {
                most: MAIN_WINDOWS,
                ..self.view
            },
            detailed: true,
            ..self
        }
    }

    const fn changed(self, change: Change) -> Self {
        Self {
            view: View {
                change,
                ..self.view
            },
            ..self
        }
    }

    /// The main table, one experiment a training seed.
    pub fn main() -> Vec<Self> {
        let of_seed = |(seed, network): (usize, &Network)| Self {
            seed: seed as u64,
            ..Self::new(Subject::Trained(*network), &MAIN).detailed()
        };
        SEEDS.iter().enumerate().map(of_seed).collect()
    }

    /// The first training seed of the main table.
    pub const fn first() -> Self {
        Self::new(Subject::Trained(KITTI), &MAIN).detailed()
    }

    /// The main table's networks before training.
    pub const fn untrained() -> Self {
        Self::new(Subject::Untrained(KITTI), NETWORK)
    }

    /// The main table on body-frame motion.
    pub const fn motion() -> Self {
        Self::new(Subject::Trained(KITTI_MOTION), &MAIN).detailed()
    }

    /// Its networks before training.
    pub const fn motion_untrained() -> Self {
        Self::new(Subject::Untrained(KITTI_MOTION), NETWORK)
    }

    /// A network of the tables of training sets, lengths and steps.
    pub fn of(network: Network) -> Self {
        let of_set = TRAINED_ON.iter().any(|(_, n)| *n == network);
        let rows: &[Row] = if of_set { &TRAINING_SETS } else { &BOTH_NOISES };
        Self::new(Subject::Trained(network), rows)
    }

    /// The network that the others of 1,500 steps are compared with.
    pub fn reference() -> Self {
        Self::of(REFERENCE)
    }

    /// What choices of the evaluation do to one network.
    pub const fn readings() -> Self {
        Self::new(Subject::Trained(KITTI), &READINGS)
    }

    /// The same network where RobotCar's angles are converted twice.
    pub const fn degrees_twice() -> Self {
        Self::new(Subject::Trained(KITTI), &BOTH_NOISES).changed(Change::DegreesTwice)
    }

    /// A linear noise schedule of the rotations.
    pub const fn linear() -> Self {
        Self::new(Subject::Trained(LINEAR), &BOTH_NOISES)
    }

    /// One scale for all windows: that of the training logs.
    pub const fn stored_scale() -> Self {
        Self::new(Subject::Trained(ONE_SCALE), &BOTH_NOISES)
    }

    /// One scale a set.
    pub const fn own_scale() -> Self {
        Self::stored_scale().changed(Change::OwnScale)
    }

    /// The learned baselines on the main table's windows, one experiment a training seed.
    pub fn learned() -> Vec<Self> {
        let of_seed = |seed| Self {
            seed,
            ..Self::new(Subject::Learned(Kind::Paper), &LEARNED).detailed()
        };
        (0..SEEDS.len() as u64).map(of_seed).collect()
    }

    /// The same on body-frame motion.
    pub const fn learned_motion() -> Self {
        Self::new(Subject::Learned(Kind::Motion), &LEARNED).detailed()
    }

    /// What it is called where a person reads.
    pub fn name(&self) -> String {
        let subject = match self.subject {
            Subject::Trained(network) => network.name.to_string(),
            Subject::Untrained(network) => format!("{} untrained", network.name),
            Subject::Learned(kind) => format!("learned baselines, {kind}, seed {}", self.seed),
        };
        let change = match self.view.change {
            Change::None => "",
            Change::DegreesTwice => ", angles converted twice",
            Change::OwnScale => ", a scale each set",
        };
        let main = if self.detailed { ", main" } else { "" };
        let rows = if self.rows == READINGS {
            ", readings"
        } else {
            ""
        };
        format!("{subject}{change}{main}{rows}")
    }

    /// The network whose windows it takes.
    pub fn network(&self) -> Network {
        match self.subject {
            Subject::Trained(network) | Subject::Untrained(network) => network,
            Subject::Learned(Kind::Paper) => KITTI,
            Subject::Learned(Kind::Motion) => KITTI_MOTION,
        }
    }

    /// The rows that are statistics.
    pub fn statistics(&self) -> Vec<Statistics> {
        let statistics = self.rows.iter().filter_map(|row| match row {
            Row::Statistics(statistics) => Some(*statistics),
            Row::Learned(_) => None,
        });
        statistics.collect()
    }

    /// About how many elements of windows the networks see, for estimates of time.
    pub fn work(&self, effort: Effort, sets: usize) -> u64 {
        let training = self.network().training;
        let passes = passes(&self.statistics());
        let draws = passes.iter().filter_map(|pass| pass.noise);
        let draws: usize = draws.map(|noise| noise.draws).sum();
        let steps = effort.steps(training.diffusion_steps);
        (effort.windows(self.view.most) * sets * steps * training.window * draws) as u64
    }
}

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Everything.
    Whole,
    /// A fifth of the windows, a third of the diffusion steps, one training seed.
    Quick,
}

impl Effort {
    /// Most windows a set.
    pub fn windows(self, most: usize) -> usize {
        match self {
            Self::Whole => most,
            Self::Quick => most / 5,
        }
    }

    /// Diffusion steps visited.
    pub fn steps(self, of_model: usize) -> usize {
        match self {
            Self::Whole => of_model,
            Self::Quick => of_model.div_ceil(3),
        }
    }

    fn seeds(self) -> usize {
        match self {
            Self::Whole => SEEDS.len(),
            Self::Quick => 1,
        }
    }
}

/// All experiments.
pub fn plan(effort: Effort) -> Vec<Experiment> {
    let seeds = effort.seeds();
    let mut all: Vec<Experiment> = Experiment::main().into_iter().take(seeds).collect();
    all.extend([
        Experiment::untrained(),
        Experiment::motion(),
        Experiment::motion_untrained(),
    ]);
    let networks = TRAINED_ON.map(|(_, n)| n).into_iter();
    let ablations = LENGTHS.iter().chain(&STEPS).map(|(_, network)| *network);
    let networks = networks.chain(ablations.filter(|n| *n != REFERENCE));
    all.extend(networks.map(Experiment::of));
    all.extend([
        Experiment::readings(),
        Experiment::degrees_twice(),
        Experiment::linear(),
        Experiment::stored_scale(),
        Experiment::own_scale(),
    ]);
    all.extend(Experiment::learned().into_iter().take(seeds));
    all.push(Experiment::learned_motion());
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::networks::NETWORKS;
    use std::collections::BTreeSet;

    #[test]
    fn experiments_differ_and_no_network_is_trained_for_nothing() {
        let all = plan(Effort::Whole);
        for (i, one) in all.iter().enumerate() {
            assert!(!all[..i].contains(one), "{one:?}");
        }
        let names: BTreeSet<String> = all.iter().map(Experiment::name).collect();
        assert_eq!(names.len(), all.len());
        for network in NETWORKS {
            assert!(all.iter().any(|e| e.network() == network));
        }
        let quick = plan(Effort::Quick);
        assert!(quick.iter().all(|e| all.contains(e)) && quick.len() == all.len() - 4);
    }

    #[test]
    fn the_first_seed_is_the_first_of_the_main_table() {
        assert_eq!(Experiment::main()[0], Experiment::first());
        assert_eq!(Experiment::learned()[0].seed, 0);
    }
}
