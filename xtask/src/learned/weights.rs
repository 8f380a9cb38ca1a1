//! Trained baselines as files: the weights with a record of how they came about.

use super::Baseline;
use super::input::{CHANNELS, numbers};
use super::network::Network;
use anyhow::{Context, Result, bail, ensure};
use dose3::atomic;
use dose3::model_file::LogRecord;
use dose3_baselines::{Manoeuvres, Sequences, annotate, annotation};
use dose3_datasets::{Kind, Representation, Trajectory, Window};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Windows that are represented at once when scoring.
const CHUNK: usize = 1024;
/// Logs may be this much faster or slower than those trained on, where windows are increments.
const RATE_TOLERANCE: f64 = 0.05;

/// What a file of weights says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Which baseline.
    pub baseline: Baseline,
    /// How poses become numbers, with the constants of the training logs.
    pub representation: Representation,
    /// Elements of a window.
    pub length: usize,
    /// Poses a second of the training logs.
    pub rate: f64,
    /// Seed of weights, batches and noise.
    pub seed: u64,
    /// The logs trained on.
    pub logs: Vec<LogRecord>,
    /// How many windows they gave.
    pub windows: usize,
    /// Edges of the classes that JEM learned to tell apart.
    pub manoeuvres: Option<Manoeuvres>,
    /// How training ended.
    pub outcome: String,
    /// Seconds that it took.
    pub seconds: f64,
    /// Version of this software.
    pub version: String,
}

/// A trained baseline with its record.
pub struct Learned {
    /// How it came about.
    pub record: Record,
    pub(super) network: Network,
}

impl Learned {
    /// Reads a file of weights.
    ///
    /// # Errors
    /// No such file, or one that is damaged or of another kind.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes =
            std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::from_bytes(&bytes).with_context(|| format!("baseline {}", path.display()))
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let record: Record = annotation(bytes)?;
        record.representation.check()?;
        let network = Network::from_bytes(record.baseline, bytes)?;
        Ok(Self { record, network })
    }

    /// Writes weights and record into one safetensors file.
    ///
    /// # Errors
    /// What the operating system answers.
    pub fn write(&self, path: &Path) -> Result<()> {
        atomic::write(path, &annotate(&self.network.to_bytes()?, &self.record)?)
    }

    /// How many numbers were trained.
    pub fn parameters(&self) -> usize {
        self.network.parameters()
    }

    /// A score for each window, higher = more out of distribution.
    ///
    /// # Errors
    /// Windows of another length, or of logs of another rate where windows are increments.
    pub fn score(&self, trajectories: &[Trajectory], windows: &[Window]) -> Result<Vec<f64>> {
        let Record {
            representation,
            length,
            rate,
            ..
        } = self.record;
        if representation.kind == Kind::Motion {
            for t in trajectories {
                if (t.rate.hertz / rate - 1.0).abs() > RATE_TOLERANCE {
                    bail!(
                        "log {} has {:.1} Hz, the baseline was trained at {rate:.1} Hz",
                        t.name,
                        t.rate.hertz
                    );
                }
            }
        }
        let mut scores = Vec::with_capacity(windows.len());
        for chunk in windows.chunks(CHUNK) {
            let data = numbers(trajectories, chunk, representation, length)?;
            scores.extend(self.network.score(Sequences {
                length,
                channels: CHANNELS,
                data: &data,
            })?);
        }
        ensure!(
            scores.len() == windows.len(),
            "{} scores for {} windows",
            scores.len(),
            windows.len()
        );
        Ok(scores)
    }
}
