//! Model files: one safetensors file with the weights of both networks and, in its metadata,
//! everything that is needed to use them.

pub(crate) mod summary;

pub use summary::{JointSummary, ModelSummary, PairSummary};

use crate::atomic;
use crate::built_in;
use crate::error::{Error, Result};
use crate::joint::{self, JointModel};
use crate::seal;
use dose3_datasets::{Frame, Representation, Trajectory};
use dose3_diffusion::{Process, ProcessConfig, trainer::TrainConfig};
use dose3_model::{PairParameters, Precision, TensorFile};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::Read as _;
use std::ops::RangeInclusive;
use std::path::Path;

/// Metadata key of [`ModelHeader`].
pub const KEY: &str = "dose3.model";
/// Version of [`ModelHeader`] that this build writes.
pub const VERSION: u32 = 1;

/// Poses of a window at most.
const LONGEST_WINDOW: usize = 1 << 16;
/// Poses a second at most, as in resampling.
pub(crate) const FASTEST: f64 = 1e6;

/// One log that a model or detector was made from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LogRecord {
    /// The log's name.
    pub name: String,
    /// Logs of one group were never split apart.
    pub group: String,
    /// Number of poses.
    pub poses: usize,
    /// SHA-256 of its poses and stamps.
    pub sha256: String,
}

impl From<&Trajectory> for LogRecord {
    fn from(t: &Trajectory) -> Self {
        Self {
            name: t.name.clone(),
            group: t.group.clone(),
            poses: t.poses.len(),
            sha256: t.fingerprint(),
        }
    }
}

/// How a model was trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingRecord {
    /// All settings, seed included.
    pub config: TrainConfig,
    /// Logs the network was trained on.
    pub logs: Vec<LogRecord>,
    /// Logs held out for validation.
    pub validation: Vec<LogRecord>,
    /// Version of this software.
    pub version: String,
    /// Last validation loss of the translation branch (mean L1 error of the noise).
    pub translation_validation: Option<f64>,
    /// Last validation loss of the rotation branch (mean squared geodesic error, rad^2).
    pub rotation_validation: Option<f64>,
}

/// What a model file says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelHeader {
    /// Version of this header.
    pub format_version: u32,
    /// How poses become numbers; its scale constants are part of the model.
    pub representation: Representation,
    /// Poses a window.
    pub window: usize,
    /// Pose rate of the training data, hertz.
    pub rate: f64,
    /// Body frame of the training data.
    pub frame: Frame,
    /// The diffusion process.
    pub process: ProcessConfig,
    /// How it was trained.
    pub training: TrainingRecord,
}

/// A trained model.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// What it says about itself.
    pub header: ModelHeader,
    /// The weights.
    pub parameters: PairParameters,
    /// The joint network, where it has one.
    pub joint: Option<JointModel>,
}

impl Model {
    /// Serialises the model; `extra` metadata rides along (a detector, for one).
    ///
    /// # Errors
    /// Weights that the precision cannot hold.
    pub fn to_bytes(&self, precision: Precision, extra: &[(&str, String)]) -> Result<Vec<u8>> {
        let mut metadata = BTreeMap::from([(KEY.to_string(), json("model", &self.header)?)]);
        metadata.extend(extra.iter().map(|(k, v)| ((*k).to_string(), v.clone())));
        let layout;
        let mut beside = Vec::new();
        if let Some(joint) = &self.joint {
            layout = joint.parameters.layout();
            metadata.insert(joint::KEY.to_owned(), json("joint model", &joint.header)?);
            beside.extend(joint.parameters.tensors(joint::PREFIX, &layout));
        }
        let pair = &self.parameters;
        Ok(pair.to_safetensors_beside(precision, &metadata, beside)?)
    }

    /// Reads a model; answers the rest of the metadata too.
    ///
    /// # Errors
    /// Bytes that are no model file, a version from the future, settings that contradict each
    /// other, tensors that do not fit.
    pub fn from_bytes(bytes: &[u8]) -> Result<(Self, BTreeMap<String, String>)> {
        let (parameters, mut metadata) =
            PairParameters::from_safetensors_beside(bytes, Some(joint::PREFIX))?;
        let joint = match metadata.remove(joint::KEY) {
            Some(_) => Some(JointModel::part_of(&TensorFile::new(bytes)?)?),
            None => None,
        };
        let Some(json) = metadata.remove(KEY) else {
            return Err(Error::NotAModel { key: KEY });
        };
        check_version("model", &json, VERSION..=VERSION)?;
        let header: ModelHeader = from_json("model", &json)?;
        Process::new(header.process)?;
        let multiple = parameters.config().length_multiple();
        if header.window == 0 || !header.window.is_multiple_of(multiple) {
            let found = header.window;
            let reason = format!("window length {found} is not a positive multiple of {multiple}");
            return Err(Error::unsound("model", reason));
        }
        if header.window > LONGEST_WINDOW {
            let found = header.window;
            let reason = format!("window length {found} is beyond {LONGEST_WINDOW}");
            return Err(Error::unsound("model", reason));
        }
        if !(header.rate > 0.0 && header.rate <= FASTEST) {
            let reason = format!("rate {} Hz is not above 0 and at most 1e6", header.rate);
            return Err(Error::unsound("model", reason));
        }
        // Detectors check the file that they are.
        if !metadata.contains_key(crate::detector::KEY) {
            seal::check("model", bytes, &mut metadata, false)?;
        }
        let model = Self {
            header,
            parameters,
            joint,
        };
        Ok((model, metadata))
    }

    /// The same with a joint network.
    #[must_use]
    pub fn with_joint(self, joint: JointModel) -> Self {
        Self {
            joint: Some(joint),
            ..self
        }
    }

    /// Reads a model file. A file of joint weights alone is the built-in model of body-frame motion with them.
    ///
    /// # Errors
    /// As [`Model::from_bytes`], with the path.
    pub fn read(path: &Path) -> Result<Self> {
        read("model", path, |bytes| match JointModel::is_alone(bytes) {
            true => Ok(built_in::motion()?.with_joint(JointModel::from_bytes(bytes)?)),
            false => Ok(Self::from_bytes(bytes)?.0),
        })
    }

    /// Writes a model file, atomically, with a digest of its content.
    ///
    /// # Errors
    /// As [`Model::to_bytes`], or where the file cannot be written.
    pub fn write(&self, path: &Path, precision: Precision) -> Result<()> {
        let bytes = self.to_bytes(precision, &seal::entries())?;
        atomic::write(path, &seal::close("model", bytes)?)
    }
}

#[derive(Deserialize)]
struct Version {
    format_version: u32,
}

/// Checks the version that a header says it has; returns it.
pub(crate) fn check_version(
    what: &'static str,
    json: &str,
    readable: RangeInclusive<u32>,
) -> Result<u32> {
    let found = from_json::<Version>(what, json)?.format_version;
    if readable.contains(&found) {
        return Ok(found);
    }
    let (oldest, newest) = readable.into_inner();
    Err(Error::FormatVersion {
        what,
        found,
        oldest,
        newest,
    })
}

pub(crate) fn from_json<T: DeserializeOwned>(what: &'static str, json: &str) -> Result<T> {
    serde_json::from_str(json).map_err(|reason| Error::Header { what, reason })
}

pub(crate) fn json(what: &'static str, header: &impl Serialize) -> Result<String> {
    serde_json::to_string(header).map_err(|reason| Error::Header { what, reason })
}

/// Metadata of a safetensors file is at most as long as this, bytes.
const LONGEST_METADATA: u64 = 100_000_000;

/// Whether a safetensors file has metadata with this key.
pub(crate) fn has_key(path: &Path, key: &str) -> bool {
    let find = || -> std::io::Result<bool> {
        // Reading a pipe would take what it holds.
        if !std::fs::metadata(path)?.is_file() {
            return Ok(false);
        }
        let mut file = std::fs::File::open(path)?;
        let mut length = [0; 8];
        file.read_exact(&mut length)?;
        let length = u64::from_le_bytes(length);
        if length > LONGEST_METADATA {
            return Ok(false);
        }
        let mut metadata = Vec::new();
        file.take(length).read_to_end(&mut metadata)?;
        let quoted = format!("\"{key}\"");
        let is_there = metadata
            .windows(quoted.len())
            .any(|w| w == quoted.as_bytes());
        Ok(metadata.starts_with(b"{") && is_there)
    };
    find().unwrap_or(false)
}

/// Whether a file says that it holds a model, as a detector does too.
pub(crate) fn is_model(path: &Path) -> bool {
    has_key(path, KEY)
}

/// Reads a file by `parse`; its errors name the path.
pub(crate) fn read<T>(
    what: &'static str,
    path: &Path,
    parse: impl FnOnce(&[u8]) -> Result<T>,
) -> Result<T> {
    let bytes = std::fs::read(path).map_err(Error::io("read", path))?;
    parse(&bytes).map_err(|reason| Error::File {
        what,
        path: path.to_path_buf(),
        reason: Box::new(reason),
    })
}
