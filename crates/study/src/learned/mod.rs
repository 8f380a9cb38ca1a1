//! The learned baselines of the paper's main table, Glow with likelihood ratio and JEM: trained on
//! KITTI once, then used for every column as they are.
//!
//! They run on burn, which only the feature `baselines` builds in. [`request`] works without it: it
//! has cargo run an xtask that has it.

mod answer;
#[cfg(feature = "baselines")]
mod input;
#[cfg(feature = "baselines")]
mod network;
mod request;
#[cfg(feature = "baselines")]
mod scoring;
mod task;
#[cfg(feature = "baselines")]
mod training;
#[cfg(feature = "baselines")]
mod weights;

pub use answer::{Answer, LearnedScores, SetWindows, WindowName};
pub use request::{Request, request};
#[cfg(feature = "baselines")]
pub use scoring::{score, scores};
pub use task::{ScoresArgs, TrainArgs, train, write_scores};
#[cfg(feature = "baselines")]
pub use training::{Options, train_on};
#[cfg(feature = "baselines")]
pub use weights::{Learned, Record};

use clap::ValueEnum;
use dose3_datasets::Kind;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A learned baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Baseline {
    /// Glow with likelihood ratio (Ren et al. 2019).
    Glow,
    /// The energy of a joint energy model (Grathwohl et al. 2020).
    Jem,
}

impl Baseline {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Glow, Self::Jem];

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Glow => "glow",
            Self::Jem => "jem",
        }
    }

    /// The shipped weights, trained on KITTI with `seed`.
    pub fn weights(self, representation: Kind, seed: u64) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("weights/baselines")
            .join(format!(
                "{}-{representation}-seed{seed}.safetensors",
                self.name()
            ))
    }
}
