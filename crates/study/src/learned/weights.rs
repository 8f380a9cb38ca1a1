//! Trained baselines as files: the weights with a record of how they came about.

use super::Baseline;
use super::input::{CHANNELS, numbers};
use super::network::Network;
use anyhow::{Context, Result, bail, ensure};
use dose3::atomic;
use dose3::model_file::LogRecord;
use dose3_baselines::{Manoeuvres, Precision, Sequences, annotate, annotation};
use dose3_datasets::{Kind, Representation, Trajectory, Window, same_rate};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Windows that are represented at once when scoring.
const CHUNK: usize = 1024;

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
    /// Version of this software.
    pub version: String,
}

/// A trained baseline with its record.
pub struct Learned {
    /// How it came about.
    pub record: Record,
    /// Seconds that training took, where that is known. They lie in a file of their own, beside the weights,
    /// because the same training gives the same weights and never takes the same time.
    pub seconds: Option<f64>,
    pub(super) network: Network,
}

impl Learned {
    /// What training gave, rounded to f16 as it is stored: it scores as its file will.
    ///
    /// # Errors
    /// Weights beyond the range of f16.
    pub(super) fn new(network: &Network, record: &Record, seconds: f64) -> Result<Self> {
        let bytes = annotate(&network.to_bytes()?, record, Precision::F16)?;
        Ok(Self {
            seconds: Some(seconds),
            ..Self::from_bytes(&bytes)?
        })
    }

    /// Reads a file of weights.
    ///
    /// # Errors
    /// No such file, or one that is damaged or of another kind.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes =
            std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        let learned =
            Self::from_bytes(&bytes).with_context(|| format!("baseline {}", path.display()))?;
        let seconds = std::fs::read_to_string(seconds_file(path)).ok();
        Ok(Self {
            seconds: seconds.and_then(|text| text.trim().parse().ok()),
            ..learned
        })
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let record: Record = annotation(bytes)?;
        record.representation.check()?;
        let network = Network::from_bytes(record.baseline, bytes)?;
        Ok(Self {
            record,
            seconds: None,
            network,
        })
    }

    /// Writes weights, in f16, and record into one safetensors file, and the time of training beside it.
    ///
    /// # Errors
    /// What the operating system answers.
    pub fn write(&self, path: &Path) -> Result<()> {
        let weights = self.network.to_bytes()?;
        atomic::write(path, &annotate(&weights, &self.record, Precision::F16)?)?;
        let Some(seconds) = self.seconds else {
            return Ok(());
        };
        let seconds = format!("{seconds:.1}\n");
        Ok(atomic::write(&seconds_file(path), seconds.as_bytes())?)
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
                if !same_rate(t.rate.hertz, rate) {
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

/// Where the time of training lies.
fn seconds_file(weights: &Path) -> PathBuf {
    weights.with_extension("seconds")
}
