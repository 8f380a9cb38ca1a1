//! The joint network's weights, and the steps of a log that it sees.

use crate::atomic;
use crate::error::{Error, Result};
use crate::model_file::{self, LogRecord, check_version, from_json, json, read};
use crate::seal;
use dose3_datasets::{Trajectory, increments, stretches};
use dose3_diffusion::joint::JointTrainConfig;
use dose3_model::joint::{JointConfig, JointParameters};
use dose3_model::{NamedTensor, Precision, TensorFile, write_tensors};
use dose3_ood::statistics::{Twist, halfway};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Metadata key of [`JointHeader`].
pub const KEY: &str = "dose3.joint";
/// Version of [`JointHeader`] that this build writes.
pub const VERSION: u32 = 1;
/// What the names of its tensors begin with.
pub(crate) const PREFIX: &str = "joint.";

/// Logs of one kind that a joint network was trained on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct JointSetRecord {
    /// Name of the set.
    pub name: String,
    /// Rate, hertz.
    pub rate: f64,
    /// How often it was drawn, relative to the others.
    pub weight: f64,
    /// Its logs.
    pub logs: Vec<LogRecord>,
}

/// What joint weights say about themselves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointHeader {
    /// Version of this header.
    pub format_version: u32,
    /// The network.
    pub network: JointConfig,
    /// How it was trained.
    pub training: JointTrainConfig,
    /// What it was trained on.
    pub sets: Vec<JointSetRecord>,
    /// Mean pseudo-Huber error on the validation logs.
    pub validation: Option<f64>,
    /// Version of this software.
    pub version: String,
}

/// A trained joint network.
#[derive(Clone, Debug, PartialEq)]
pub struct JointModel {
    /// What it says about itself.
    pub header: JointHeader,
    /// The weights.
    pub parameters: JointParameters,
}

impl JointModel {
    /// Serialises the weights, with a digest of the bytes.
    ///
    /// # Errors
    /// Weights that the precision cannot hold.
    pub fn to_bytes(&self, precision: Precision) -> Result<Vec<u8>> {
        let [digest, mark] = seal::entries();
        let header = (KEY, json("joint model", &self.header)?);
        let entries = [header, digest, mark].map(|(key, value)| (key.to_owned(), value));
        let metadata = BTreeMap::from(entries);
        let layout = self.parameters.layout();
        let tensors: Vec<NamedTensor<'_>> = self.parameters.tensors(PREFIX, &layout).collect();
        seal::close(
            "joint model",
            write_tensors(&tensors, precision, &metadata)?,
        )
    }

    /// Reads weights and checks them.
    ///
    /// # Errors
    /// Bytes that are no joint weights or not those that were written, a version from the future, tensors that do not
    /// fit.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut file = TensorFile::new(bytes)?;
        let model = Self::part_of(&file)?;
        seal::check("joint model", bytes, &mut file.metadata, true)?;
        Ok(model)
    }

    /// Whether the bytes say that they are joint weights and nothing else.
    pub(crate) fn is_alone(bytes: &[u8]) -> bool {
        TensorFile::new(bytes).is_ok_and(|file| {
            file.metadata.contains_key(KEY) && !file.metadata.contains_key(model_file::KEY)
        })
    }

    /// Reads the joint weights of a file that may hold more.
    pub(crate) fn part_of(file: &TensorFile<'_>) -> Result<Self> {
        let text = file
            .metadata
            .get(KEY)
            .ok_or(Error::NotAModel { key: KEY })?;
        check_version("joint model", text, VERSION..=VERSION)?;
        let header: JointHeader = from_json("joint model", text)?;
        let parameters = JointParameters::read(header.network.clone(), PREFIX, file)?;
        Ok(Self { header, parameters })
    }

    /// Reads a file of joint weights.
    ///
    /// # Errors
    /// As [`JointModel::from_bytes`], with the path.
    pub fn read(path: &Path) -> Result<Self> {
        read("joint model", path, Self::from_bytes)
    }

    /// Writes a file of joint weights, whole or not at all.
    ///
    /// # Errors
    /// As [`JointModel::to_bytes`], or where the file cannot be written.
    pub fn write(&self, path: &Path, precision: Precision) -> Result<()> {
        atomic::write(path, &self.to_bytes(precision)?)
    }
}

/// The steps of each gap-free stretch of a log: translation seen half-way through the turn, metres, and rotation
/// tangent, radians ([`halfway`]).
///
/// # Errors
/// Poses that are not finite.
pub fn steps(log: &Trajectory) -> Result<Vec<Vec<Twist>>> {
    let of = |stretch| Ok(halfway(&increments(&log.poses[stretch], log.frame))?);
    stretches(log, log.max_gap).into_iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> JointModel {
        let network = JointConfig::new(4, &[1, 2]);
        JointModel {
            parameters: JointParameters::init(&network, 1).unwrap(),
            header: JointHeader {
                format_version: VERSION,
                network,
                training: JointTrainConfig::default(),
                sets: Vec::new(),
                validation: Some(0.25),
                version: "0".into(),
            },
        }
    }

    #[test]
    fn an_altered_byte_is_found_wherever_it_is() {
        let bytes = model().to_bytes(Precision::F16).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("joint.dose3");
        let weights = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
        let (mut altered, mut tried) = (bytes.clone(), 0);
        for at in (0..bytes.len()).filter(|at| *at < weights || at % 101 == 0) {
            altered[at] ^= 1 << (at % 8);
            assert!(JointModel::from_bytes(&altered).is_err(), "byte {at}");
            (altered[at], tried) = (bytes[at], tried + 1);
        }
        assert!(tried > weights);
        altered[weights] ^= 1;
        std::fs::write(&path, &altered).unwrap();
        // Such a file is the built-in model with these weights.
        let refused = crate::Model::read(&path).unwrap_err().to_string();
        assert!(refused.contains("altered or damaged"), "{refused}");
    }

    #[test]
    fn weights_come_back_from_a_file() {
        let model = model();
        let bytes = model.to_bytes(Precision::F32).unwrap();
        assert_eq!(JointModel::from_bytes(&bytes).unwrap(), model);
        assert!(JointModel::from_bytes(&bytes[1..]).is_err());
        let pair = crate::built_in::motion().unwrap();
        let other = pair.to_bytes(Precision::F16, &[]).unwrap();
        assert!(JointModel::from_bytes(&other).is_err());
    }
}
