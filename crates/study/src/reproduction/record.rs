//! What an experiment found, as it is stored.

use crate::cells::Cell;
use crate::sets::DataSet;
use crate::split::Split;
use serde::{Deserialize, Serialize};

/// Version of what is measured. Records of another version are measured anew: raise it with every change that moves
/// a number of a record, here or in a crate below.
pub const MEASUREMENT: u32 = 1;

/// What an experiment found.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    /// The diffusion network; none for learned baselines.
    pub network: Option<NetworkRecord>,
    /// The sets as they were seen.
    pub sets: Vec<SetRecord>,
    /// One entry a row of the experiment, in its order.
    pub rows: Vec<RowRecord>,
    /// Wall time.
    pub seconds: f64,
}

/// A network as it was used.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NetworkRecord {
    /// Parameters of both branches.
    pub parameters: usize,
    /// Elements of a window.
    pub window: usize,
    /// Diffusion steps.
    pub steps: usize,
    /// Those that were visited.
    pub visited: usize,
    /// Logs it was trained on.
    pub trained_on: Vec<String>,
}

/// One set as an experiment saw it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SetRecord {
    /// Letter in tables.
    pub letter: char,
    /// Full name.
    pub name: String,
    /// Number of windows.
    pub windows: usize,
    /// Poses between their starts.
    pub stride: usize,
    /// Logs that fit the density in the split `held-out`.
    pub fit_logs: Vec<String>,
    /// Logs that are its in-distribution test.
    pub test_logs: Vec<String>,
}

/// One row.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RowRecord {
    /// What it costs.
    pub cost: Cost,
    /// One entry a split of the experiment, in its order.
    pub splits: Vec<SplitRecord>,
}

/// What a row costs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Cost {
    /// Numbers that were trained.
    pub parameters: usize,
    /// Scoring time of a window.
    pub milliseconds: f64,
    /// How training went, where that was recorded.
    pub training: Option<TrainingCost>,
}

/// How training went.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TrainingCost {
    /// Its seconds, where they are known.
    pub seconds: Option<f64>,
    /// How it ended.
    pub outcome: String,
}

/// A row under a split.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SplitRecord {
    /// The split.
    pub split: Split,
    /// All pairs of sets.
    pub cells: Vec<Cell>,
    /// The ROC curve of each cell, in detailed experiments under the split `held-out`.
    pub curves: Vec<Curve>,
}

/// A ROC curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// ID and OOD set, or what the curve is called in a figure.
    pub label: String,
    /// (false positive rate, true positive rate), ascending.
    pub points: Vec<(f64, f64)>,
}

impl SetRecord {
    /// Summarises a set that was cut at a stride.
    pub fn new(set: &DataSet, stride: usize) -> Self {
        Self {
            letter: set.letter,
            name: set.name.to_string(),
            windows: set.windows.len(),
            stride,
            fit_logs: set.fit_names(),
            test_logs: set.test_names(),
        }
    }
}
