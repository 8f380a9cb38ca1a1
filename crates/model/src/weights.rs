//! Weights as safetensors bytes: one file holds both networks and their configuration.

use std::collections::BTreeMap;

use half::f16;
use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};

use crate::{ModelError, PairConfig, PairParameters, Parameters, UNetConfig};

/// The metadata key that holds the [`PairConfig`] as JSON.
pub const CONFIG_KEY: &str = "dose3.config";

/// How weights are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 4 bytes per weight, exact.
    F32,
    /// 2 bytes per weight, rounded to nearest (11 bits of mantissa).
    F16,
}

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

        let mut tensors = Vec::new();
        for (branch, parameters) in [
            ("translation", &self.translation),
            ("rotation", &self.rotation),
        ] {
            encode(branch, parameters, precision, &mut tensors)?;
        }
        let dtype = match precision {
            Precision::F32 => Dtype::F32,
            Precision::F16 => Dtype::F16,
        };
        let views = tensors
            .iter()
            .map(|(name, shape, bytes)| Ok((name, TensorView::new(dtype, shape.clone(), bytes)?)))
            .collect::<Result<Vec<_>, ModelError>>()?;
        insert_metadata(serialize(views, None)?, &metadata)
    }

    /// Reads both networks and the caller's metadata back; f32 and f16 are both read.
    ///
    /// # Errors
    /// Bytes that are no safetensors file, a configuration that is missing or not valid,
    /// and every tensor that is missing, unknown, of another shape or type, or not finite.
    pub fn from_safetensors(bytes: &[u8]) -> Result<(Self, BTreeMap<String, String>), ModelError> {
        let (_, header) = SafeTensors::read_metadata(bytes)?;
        let file = SafeTensors::deserialize(bytes)?;
        let mut metadata: BTreeMap<_, _> = header
            .metadata()
            .iter()
            .flatten()
            .map(|(k, v)| (k.clone(), v.clone()))
            .collect();
        let json = metadata
            .remove(CONFIG_KEY)
            .ok_or_else(|| bad_metadata(CONFIG_KEY, "missing: these are not DOSE3 weights"))?;
        let config: PairConfig =
            serde_json::from_str(&json).map_err(|error| bad_metadata(CONFIG_KEY, error))?;
        config.validate()?;

        let mut names = file.names();
        names.sort_unstable();
        for name in names {
            if !is_known(&config, name) {
                return Err(ModelError::UnknownTensor(name.to_owned()));
            }
        }
        let translation = decode("translation", &config.translation, &file)?;
        let rotation = decode("rotation", &config.rotation, &file)?;
        Ok((
            Self {
                translation,
                rotation,
            },
            metadata,
        ))
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

type Encoded = (String, Vec<usize>, Vec<u8>);

fn encode(
    branch: &str,
    parameters: &Parameters,
    precision: Precision,
    tensors: &mut Vec<Encoded>,
) -> Result<(), ModelError> {
    let layout = parameters.layout();
    crate::check_values(&layout, &parameters.values)?;
    for spec in layout.entries() {
        let name = format!("{branch}.{}", spec.name);
        let values = &parameters.values[spec.range()];
        let bytes = match precision {
            Precision::F32 => values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect(),
            Precision::F16 => {
                if let Some(index) = values.iter().position(|&v| f16::from_f32(v).is_infinite()) {
                    return Err(ModelError::HalfOverflow {
                        name,
                        index,
                        value: values[index],
                    });
                }
                values
                    .iter()
                    .flat_map(|&value| f16::from_f32(value).to_le_bytes())
                    .collect()
            }
        };
        tensors.push((name, spec.shape.clone(), bytes));
    }
    Ok(())
}

fn decode(
    branch: &str,
    config: &UNetConfig,
    file: &SafeTensors<'_>,
) -> Result<Parameters, ModelError> {
    let layout = config.layout();
    let mut values = Vec::with_capacity(layout.len());
    for spec in layout.entries() {
        let name = format!("{branch}.{}", spec.name);
        let Ok(tensor) = file.tensor(&name) else {
            return Err(ModelError::MissingTensor(name));
        };
        if tensor.shape() != spec.shape {
            let (expected, found) = (spec.shape.clone(), tensor.shape().to_vec());
            return Err(ModelError::TensorShape {
                name,
                expected,
                found,
            });
        }
        let (words, halves) = (
            tensor.data().as_chunks::<4>().0,
            tensor.data().as_chunks::<2>().0,
        );
        match tensor.dtype() {
            Dtype::F32 => values.extend(words.iter().map(|&word| f32::from_le_bytes(word))),
            Dtype::F16 => {
                values.extend(halves.iter().map(|&half| f16::from_le_bytes(half).to_f32()))
            }
            other => {
                return Err(ModelError::TensorType {
                    name,
                    found: format!("{other:?}"),
                });
            }
        }
        if let Some(index) = values[spec.offset..]
            .iter()
            .position(|value| !value.is_finite())
        {
            let value = values[spec.offset + index];
            return Err(ModelError::NotFinite {
                what: name,
                index,
                value,
            });
        }
    }
    Parameters::new(config.clone(), values)
}

/// Puts the metadata in front of a header that was written without.
///
/// The safetensors crate keeps metadata in a hash map and writes it in the map's random
/// order; a sorted map written here keeps the bytes the same from run to run.
fn insert_metadata(
    file: Vec<u8>,
    metadata: &BTreeMap<String, String>,
) -> Result<Vec<u8>, ModelError> {
    let (header_len, _) = SafeTensors::read_metadata(&file)?;
    let (header, data) = file[8..].split_at(header_len);
    let json =
        serde_json::to_string(metadata).map_err(|error| bad_metadata("__metadata__", error))?;
    let mut merged = format!("{{\"__metadata__\":{json},").into_bytes();
    merged.extend_from_slice(header[1..].trim_ascii_end());
    // The format aligns the data to 8 bytes by spaces behind the header.
    merged.resize(merged.len().next_multiple_of(8), b' ');
    let mut out = Vec::with_capacity(8 + merged.len() + data.len());
    out.extend((merged.len() as u64).to_le_bytes());
    out.extend(merged);
    out.extend_from_slice(data);
    Ok(out)
}

fn bad_metadata(key: &str, reason: impl ToString) -> ModelError {
    ModelError::Metadata {
        key: key.to_owned(),
        reason: reason.to_string(),
    }
}
