//! Detector files: a model file whose metadata also holds what trusted logs looked like to it.

use crate::atomic;
use crate::error::{Error, Result};
use crate::logs::Needs;
use crate::model_file::{self, LogRecord, Model};
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

impl Detector {
    /// Serialises the detector. Weights are kept as f32: they are the ones it was fitted with.
    ///
    /// # Errors
    /// A header that cannot be serialised.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let json = model_file::json("detector", &self.header)?;
        self.model.to_bytes(Precision::F32, &[(KEY, json)])
    }

    /// Reads a detector and checks all of it.
    ///
    /// # Errors
    /// Bytes that are no detector, a version from the future, parts that contradict each other.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let (model, metadata) = Model::from_bytes(bytes)?;
        let Some(json) = metadata.get(KEY) else {
            return Err(Error::NotADetector);
        };
        model_file::check_version("detector", json, OLDEST..=VERSION)?;
        let header: DetectorHeader = model_file::from_json("detector", json)?;
        let unsound = |reason: String| Err(Error::unsound("detector", reason));
        if header.stride == 0 || header.probe.draws == 0 || header.probe.steps == 0 {
            return unsound("stride, draws or steps are 0".into());
        }
        if header.needs.representation != model.header.representation {
            return unsound("the representations of model and detector differ".into());
        }
        if !(header.needs.rate.is_finite() && header.needs.rate > 0.0) {
            return unsound(format!(
                "rate {} Hz is not a positive number",
                header.needs.rate
            ));
        }
        if let Some(poses) = &header.poses {
            poses.validate()?;
        }
        let config = header.statistics.config();
        if (config.draws, config.seed) != (header.probe.draws, header.probe.seed) {
            return unsound("draws and seed differ between its parts".into());
        }
        Ok(Self { model, header })
    }

    /// Reads a detector file.
    ///
    /// # Errors
    /// As [`Detector::from_bytes`], with the path.
    pub fn read(path: &Path) -> Result<Self> {
        model_file::read("detector", path, Self::from_bytes)
    }

    /// Writes a detector file, atomically.
    ///
    /// # Errors
    /// As [`Detector::to_bytes`], or where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        atomic::write(path, &self.to_bytes()?)
    }
}
