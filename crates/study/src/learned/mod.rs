//! The learned baselines of the paper's main table, Glow with likelihood ratio and JEM: trained on
//! KITTI once, then used for every column as they are.
//!
//! They run on burn, which only the feature `baselines` builds in.

#[cfg(feature = "baselines")]
mod input;
#[cfg(feature = "baselines")]
mod network;
#[cfg(feature = "baselines")]
mod scoring;
#[cfg(feature = "baselines")]
mod training;
#[cfg(feature = "baselines")]
mod weights;

#[cfg(feature = "baselines")]
pub use scoring::{of_file, scores};
#[cfg(feature = "baselines")]
pub use training::{Options, train_on, training_logs};
#[cfg(feature = "baselines")]
pub use weights::{Learned, Record};

use anyhow::{Context, Result};
use dose3_datasets::Kind;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::str::FromStr;

/// A learned baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
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

    /// The weights of the study, trained on KITTI with `seed`.
    pub fn weights(self, representation: Kind, seed: u64) -> PathBuf {
        let file = format!("{}-{representation}-seed{seed}.safetensors", self.name());
        crate::networks::folder().join("baselines").join(file)
    }
}

impl FromStr for Baseline {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let found = Self::ALL.into_iter().find(|b| b.name() == text);
        found.with_context(|| format!("no baseline is named {text:?}, expected glow or jem"))
    }
}

/// What one baseline says of all windows.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedScores {
    /// Scores `[set][window]`, windows as in the sets; higher = more out of distribution.
    pub scores: Vec<Vec<f64>>,
    /// Numbers that were trained.
    pub parameters: usize,
    /// Seconds that training took, on the machine that trained, where they are known.
    pub train_seconds: Option<f64>,
    /// Seconds that scoring took.
    pub score_seconds: f64,
    /// How training ended, and on what.
    pub outcome: String,
}

/// Which weights score.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// Those of the study, trained on KITTI.
    Study,
    /// Trained now, on the synthetic vehicle, for so many steps.
    Vehicle {
        /// Optimiser steps.
        steps: usize,
    },
}

/// Whether this build holds the baselines.
pub const BUILT: bool = cfg!(feature = "baselines");

/// Fails: this build has no learned baselines.
///
/// # Errors
/// Always.
#[cfg(not(feature = "baselines"))]
pub fn scores(
    _: Baseline,
    _: Kind,
    _: u64,
    _: &[crate::sets::DataSet],
    _: Weights,
) -> Result<LearnedScores> {
    anyhow::bail!("this build is without the learned baselines (feature `baselines`)")
}
