//! Detector files: a model file whose metadata also holds what trusted logs looked like to it.

use crate::atomic;
use crate::logs::Needs;
use crate::model_file::{LogRecord, Model};
use anyhow::{Context, Result, bail};
use dose3_diffusion::ProbeConfig;
use dose3_model::Precision;
use dose3_ood::{DetectorStatistics, PoseReference};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Metadata key of [`DetectorHeader`].
pub const KEY: &str = "dose3.detector";
/// Version of [`DetectorHeader`] that this build writes.
pub const VERSION: u32 = 2;
/// The oldest version that this build reads: version 1 knows nothing of single poses.
const OLDEST: u32 = 1;

/// What a detector file says beside its model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectorHeader {
    /// Version of this header.
    pub format_version: u32,
    /// What a log must be like to be judged.
    pub needs: Needs,
    /// Steps, draws and seed of the noise.
    pub probe: ProbeConfig,
    /// Poses between the starts of windows.
    pub stride: usize,
    /// The trusted logs.
    pub trusted: Vec<LogRecord>,
    /// Densities and calibration.
    pub statistics: DetectorStatistics,
    /// What trusted poses look like one by one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<PoseReference>,
    /// Version of the software that fitted it.
    pub version: String,
}

/// A detector: a model, and what trusted logs look like to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Detector {
    /// The model it carries.
    pub model: Model,
    /// The fitted part.
    pub header: DetectorHeader,
}

#[derive(Deserialize)]
struct Version {
    format_version: u32,
}

impl Detector {
    /// Serialises the detector. Weights are kept as f32: they are the ones it was fitted with.
    ///
    /// # Errors
    /// A header that cannot be serialised.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let json = serde_json::to_string(&self.header)?;
        self.model.to_bytes(Precision::F32, &[(KEY, json)])
    }

    /// Reads a detector and checks all of it.
    ///
    /// # Errors
    /// Bytes that are no detector, a version from the future, parts that contradict each other.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let (model, metadata) = Model::from_bytes(bytes)?;
        let Some(json) = metadata.get(KEY) else {
            bail!("a model without a detector: make one with `dose3 fit --model`");
        };
        let unreadable = "the detector header cannot be read";
        let version: Version = serde_json::from_str(json).context(unreadable)?;
        if !(OLDEST..=VERSION).contains(&version.format_version) {
            bail!(
                "detector format {}, this build reads {OLDEST} to {VERSION}; update dose3",
                version.format_version
            );
        }
        let header: DetectorHeader = serde_json::from_str(json).context(unreadable)?;
        if header.stride == 0 || header.probe.draws == 0 || header.probe.steps == 0 {
            bail!("stride, draws or steps of the detector are 0");
        }
        if header.needs.representation != model.header.representation {
            bail!("the representations of model and detector differ");
        }
        if !(header.needs.rate.is_finite() && header.needs.rate > 0.0) {
            bail!("rate {} Hz is not a positive number", header.needs.rate);
        }
        if let Some(poses) = &header.poses {
            poses.validate()?;
        }
        let config = header.statistics.config();
        if (config.draws, config.seed) != (header.probe.draws, header.probe.seed) {
            bail!("draws and seed differ between the parts of the detector");
        }
        Ok(Self { model, header })
    }

    /// Reads a detector file.
    ///
    /// # Errors
    /// As [`Detector::from_bytes`], with the path.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path)
            .with_context(|| format!("cannot read detector {}", path.display()))?;
        Self::from_bytes(&bytes)
            .with_context(|| format!("{} is not a usable detector file", path.display()))
    }

    /// Writes a detector file, atomically.
    ///
    /// # Errors
    /// As [`Detector::to_bytes`], or where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        atomic::write(path, &self.to_bytes()?)
    }
}
