//! Results as data.

use super::alarms::Alarms;
use super::cells::SixCell;
use super::controls::ControlCell;
use super::locate::PoseCell;
use super::logs::LogCell;
use super::near::NearCell;
use super::protocol::{LogSet, Part};
use super::summary::{self, Line, Summary};
use super::windows::FaultCell;
use crate::provenance::Provenance;
use dose3_datasets::hex;
use serde::Serialize;
use sha2::{Digest, Sha256};

/// Everything a run found, and what is needed to repeat it.
#[derive(Serialize)]
pub struct Report {
    /// Whether the data sets were generated.
    pub synthetic: bool,
    /// Command, commit, machine, time.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Which logs were tested.
    pub part: Part,
    /// Seed of the first model's run.
    pub seed: u64,
    /// Poses a second.
    pub rate: f64,
    /// Poses a window.
    pub poses: usize,
    /// Poses between the starts of windows that fit densities.
    pub stride: usize,
    /// Diffusion steps visited.
    pub steps: usize,
    /// Noise draws.
    pub draws: usize,
    /// Density over the statistics.
    pub density: String,
    /// Bootstrap resamples.
    pub resamples: usize,
    /// Faults and severities.
    pub faults: usize,
    /// The data sets.
    pub sets: Vec<SetSummary>,
    /// What the faults come down to.
    pub summaries: Vec<Summary>,
    /// One entry a model.
    pub runs: Vec<Run>,
}

/// One data set.
#[derive(Serialize)]
pub struct SetSummary {
    /// Letter in tables.
    pub letter: char,
    /// Full name.
    pub name: &'static str,
    /// Poses at the model's rate.
    pub poses: usize,
    /// Logs that fit densities.
    pub fitted: Vec<String>,
    /// Logs that are tested.
    pub tested: Vec<String>,
}

impl SetSummary {
    /// Summarises a set.
    pub fn new(set: &LogSet, part: Part) -> Self {
        Self {
            letter: set.letter,
            name: set.name,
            poses: set.logs.iter().map(|log| log.len()).sum(),
            fitted: set.names(&set.fitted(part)),
            tested: set.names(&set.tested(part)),
        }
    }
}

/// What was measured with one model.
#[derive(Serialize)]
pub struct Run {
    /// Seed of noise, fits and bootstrap.
    pub seed: u64,
    /// Identifies the weights.
    pub model_sha256: String,
    /// Tested logs that the networks were trained on.
    pub trained_on: Vec<String>,
    /// Places of faults in each set.
    pub sites: Vec<(char, usize)>,
    /// Faulty windows.
    pub windows: Vec<FaultCell>,
    /// Poses of faulty windows.
    pub poses: Vec<PoseCell>,
    /// Faulty logs.
    pub logs: Vec<LogCell>,
    /// What must stay in distribution.
    pub controls: Vec<ControlCell>,
    /// Logs left out.
    pub alarms: Vec<Alarms>,
    /// Platform against platform.
    pub cells: Vec<SixCell>,
    /// Near platforms.
    pub near: Vec<NearCell>,
}

impl Run {
    /// Nothing measured yet.
    pub fn new(seed: u64, model: &[u8], trained_on: Vec<String>) -> Self {
        Self {
            seed,
            model_sha256: hex(Sha256::digest(model)),
            trained_on,
            sites: Vec::new(),
            windows: Vec::new(),
            poses: Vec::new(),
            logs: Vec::new(),
            controls: Vec::new(),
            alarms: Vec::new(),
            cells: Vec::new(),
            near: Vec::new(),
        }
    }
}

/// The faults of all runs, line by line.
pub fn lines(runs: &[Run]) -> Vec<Line> {
    let windows: Vec<Vec<FaultCell>> = runs.iter().map(|run| run.windows.clone()).collect();
    summary::lines(&windows)
}
