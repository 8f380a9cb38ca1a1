//! Weights as safetensors bytes: one file holds both networks and their configuration.

use std::collections::BTreeMap;

use crate::tensors::{NamedTensor, Precision, TensorFile, write_tensors};
use crate::{ModelError, PairConfig, PairParameters, Parameters, check_values};

/// The metadata key that holds the [`PairConfig`] as JSON.
pub const CONFIG_KEY: &str = "dose3.config";

impl PairParameters {
    /// Writes both networks, their configuration and `metadata` of the caller.
    ///
    /// Tensors are named `translation.*` and `rotation.*` after the layout. The same
    /// arguments give the same bytes.
    ///
    /// # Errors
    /// Values that are not finite, that do not fit the layout or the precision, or
    /// metadata under [`CONFIG_KEY`], which is reserved.
    pub fn to_safetensors(
        &self,
        precision: Precision,
        metadata: &BTreeMap<String, String>,
    ) -> Result<Vec<u8>, ModelError> {
        self.to_safetensors_beside(precision, metadata, Vec::new())
    }

    /// As [`Self::to_safetensors`], with tensors of another network in the same file.
    ///
    /// # Errors
    /// As [`Self::to_safetensors`].
    pub fn to_safetensors_beside(
        &self,
        precision: Precision,
        metadata: &BTreeMap<String, String>,
        beside: Vec<NamedTensor<'_>>,
    ) -> Result<Vec<u8>, ModelError> {
        if metadata.contains_key(CONFIG_KEY) {
            return Err(bad_metadata(
                CONFIG_KEY,
                "the key is reserved for the configuration",
            ));
        }
        let config = self.config();
        config.validate()?;
        let json =
            serde_json::to_string(&config).map_err(|error| bad_metadata(CONFIG_KEY, error))?;
        let mut metadata = metadata.clone();
        metadata.insert(CONFIG_KEY.to_owned(), json);

        let branches = [
            ("translation.", &self.translation),
            ("rotation.", &self.rotation),
        ];
        let layouts = branches.map(|(_, parameters)| parameters.layout());
        let mut tensors = Vec::new();
        for ((prefix, parameters), layout) in branches.into_iter().zip(&layouts) {
            check_values(layout, &parameters.values)?;
            tensors.extend(parameters.tensors(prefix, layout));
        }
        tensors.extend(beside);
        write_tensors(&tensors, precision, &metadata)
    }

    /// Reads both networks and the caller's metadata back; f32 and f16 are both read.
    ///
    /// # Errors
    /// Bytes that are no safetensors file, a configuration that is missing or not valid,
    /// and every tensor that is missing, unknown, of another shape or type, or not finite.
    pub fn from_safetensors(bytes: &[u8]) -> Result<(Self, BTreeMap<String, String>), ModelError> {
        Self::from_safetensors_beside(bytes, None)
    }

    /// As [`Self::from_safetensors`]; tensors whose names begin with `beside` are another network's.
    ///
    /// # Errors
    /// As [`Self::from_safetensors`].
    pub fn from_safetensors_beside(
        bytes: &[u8],
        beside: Option<&str>,
    ) -> Result<(Self, BTreeMap<String, String>), ModelError> {
        let mut file = TensorFile::new(bytes)?;
        let json = file
            .metadata
            .remove(CONFIG_KEY)
            .ok_or_else(|| bad_metadata(CONFIG_KEY, "missing: these are not DOSE3 weights"))?;
        let config: PairConfig =
            serde_json::from_str(&json).map_err(|error| bad_metadata(CONFIG_KEY, error))?;
        config.validate()?;

        for name in file.names() {
            let other = beside.is_some_and(|prefix| name.starts_with(prefix));
            if !other && !is_known(&config, name) {
                return Err(ModelError::UnknownTensor(name.to_owned()));
            }
        }
        let pair = Self {
            translation: Parameters::read(config.translation, "translation.", &file)?,
            rotation: Parameters::read(config.rotation, "rotation.", &file)?,
        };
        Ok((pair, file.metadata))
    }
}

fn is_known(config: &PairConfig, name: &str) -> bool {
    let Some((branch, rest)) = name.split_once('.') else {
        return false;
    };
    match branch {
        "translation" => config.translation.layout().find(rest).is_some(),
        "rotation" => config.rotation.layout().find(rest).is_some(),
        _ => false,
    }
}

fn bad_metadata(key: &str, reason: impl ToString) -> ModelError {
    ModelError::Metadata {
        key: key.to_owned(),
        reason: reason.to_string(),
    }
}
