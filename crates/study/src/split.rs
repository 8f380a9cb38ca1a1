//! How the in-distribution test windows of a set are chosen.

use crate::sets::DataSet;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// How in-distribution test windows are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Split {
    /// The ID logs are split in two: one part fits the density, the other is tested.
    HeldOut,
    /// As the authors' code evaluates: the density is fitted on all ID windows, and a random tenth
    /// of the same windows is tested.
    ReleasedCode,
}

impl Split {
    /// Both.
    pub const ALL: [Self; 2] = [Self::HeldOut, Self::ReleasedCode];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::HeldOut => "held-out",
            Self::ReleasedCode => "released-code",
        }
    }

    /// What it does, for a reader of tables.
    pub fn describe(self) -> &'static str {
        match self {
            Self::HeldOut => "ID test windows come from logs that the density has not seen",
            Self::ReleasedCode => {
                "ID test windows are a random tenth of those the density was fitted on, as in the authors' code"
            }
        }
    }

    /// The windows that fit a density, and those that are tested as in-distribution.
    pub fn of(self, set: &DataSet, seed: u64) -> (Vec<usize>, Vec<usize>) {
        let windows = 0..set.windows.len();
        match self {
            Self::HeldOut => {
                windows.partition(|w| !set.test_logs.contains(&set.windows[*w].trajectory))
            }
            Self::ReleasedCode => {
                let mut shuffled: Vec<usize> = windows.clone().collect();
                shuffled.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
                shuffled.truncate(set.windows.len().div_ceil(10));
                (windows.collect(), shuffled)
            }
        }
    }
}
