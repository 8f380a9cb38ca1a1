//! Named f32 tensors as safetensors bytes, stored whole or in half precision: what a file of any network
//! is made of.

use std::collections::BTreeMap;

use half::f16;
use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};

use crate::{ModelError, ParameterLayout};

/// How weights are stored. They are computed with in f32 whichever it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 4 bytes per weight, exact.
    F32,
    /// 2 bytes per weight, rounded to nearest (11 bits of mantissa).
    F16,
}

/// A tensor to be stored.
#[derive(Clone, Debug)]
pub struct NamedTensor<'a> {
    /// Its name in the file.
    pub name: String,
    /// Sizes of its axes.
    pub shape: &'a [usize],
    /// Its values, the last axis fastest.
    pub values: &'a [f32],
}

/// Writes tensors and metadata. The same arguments give the same bytes.
///
/// # Errors
/// Values that are not finite or that `precision` cannot hold, and values that do not fill their shape.
pub fn write_tensors(
    tensors: &[NamedTensor<'_>],
    precision: Precision,
    metadata: &BTreeMap<String, String>,
) -> Result<Vec<u8>, ModelError> {
    let dtype = match precision {
        Precision::F32 => Dtype::F32,
        Precision::F16 => Dtype::F16,
    };
    let encoded = tensors
        .iter()
        .map(|tensor| encode(tensor, precision))
        .collect::<Result<Vec<_>, ModelError>>()?;
    let views = tensors
        .iter()
        .zip(&encoded)
        .map(|(t, bytes)| Ok((&t.name, TensorView::new(dtype, t.shape.to_vec(), bytes)?)))
        .collect::<Result<Vec<_>, ModelError>>()?;
    insert_metadata(serialize(views, None)?, metadata)
}

fn encode(tensor: &NamedTensor<'_>, precision: Precision) -> Result<Vec<u8>, ModelError> {
    let NamedTensor { name, values, .. } = tensor;
    check_finite(name, values)?;
    Ok(match precision {
        Precision::F32 => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        Precision::F16 => {
            if let Some(index) = values.iter().position(|&v| f16::from_f32(v).is_infinite()) {
                return Err(ModelError::HalfOverflow {
                    name: name.clone(),
                    index,
                    value: values[index],
                });
            }
            let halves = values.iter().map(|&v| f16::from_f32(v));
            halves.flat_map(f16::to_le_bytes).collect()
        }
    })
}

fn check_finite(name: &str, values: &[f32]) -> Result<(), ModelError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(ModelError::NotFinite {
            what: name.to_owned(),
            index,
            value: values[index],
        }),
        None => Ok(()),
    }
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
    let json = serde_json::to_string(metadata).map_err(|error| ModelError::Metadata {
        key: "__metadata__".to_owned(),
        reason: error.to_string(),
    })?;
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

/// The bytes of a safetensors file, taken apart.
pub struct TensorFile<'a> {
    tensors: SafeTensors<'a>,
    /// Its metadata.
    pub metadata: BTreeMap<String, String>,
}

impl<'a> TensorFile<'a> {
    /// Takes the bytes apart.
    ///
    /// # Errors
    /// Bytes that are no safetensors file.
    pub fn new(bytes: &'a [u8]) -> Result<Self, ModelError> {
        let (_, header) = SafeTensors::read_metadata(bytes)?;
        let metadata = header.metadata().iter().flatten();
        Ok(Self {
            metadata: metadata.map(|(k, v)| (k.clone(), v.clone())).collect(),
            tensors: SafeTensors::deserialize(bytes)?,
        })
    }

    /// Names of its tensors, in order.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        let mut names = self.tensors.names();
        names.sort_unstable();
        names
    }

    /// Sizes of the axes of a tensor.
    ///
    /// # Errors
    /// [`ModelError::MissingTensor`].
    pub fn shape(&self, name: &str) -> Result<Vec<usize>, ModelError> {
        Ok(self.tensor(name)?.shape().to_vec())
    }

    /// Values of a tensor of f32 or f16.
    ///
    /// # Errors
    /// [`ModelError::MissingTensor`], [`ModelError::TensorType`], [`ModelError::NotFinite`].
    pub fn values(&self, name: &str) -> Result<Vec<f32>, ModelError> {
        let tensor = self.tensor(name)?;
        let data = tensor.data();
        let values: Vec<f32> = match tensor.dtype() {
            Dtype::F32 => {
                let words = data.as_chunks::<4>().0.iter();
                words.map(|&word| f32::from_le_bytes(word)).collect()
            }
            Dtype::F16 => {
                let halves = data.as_chunks::<2>().0.iter();
                halves.map(|&h| f16::from_le_bytes(h).to_f32()).collect()
            }
            other => {
                return Err(ModelError::TensorType {
                    name: name.to_owned(),
                    found: format!("{other:?}"),
                });
            }
        };
        check_finite(name, &values)?;
        Ok(values)
    }

    /// The values of all tensors of a layout, whose names follow `prefix` in the file. Shapes are checked before anything
    /// is allocated: a layout may be what the file claims of itself.
    ///
    /// # Errors
    /// [`ModelError::TensorShape`], and as [`Self::values`].
    pub fn flat(&self, prefix: &str, layout: &ParameterLayout) -> Result<Vec<f32>, ModelError> {
        let named = |name: &str| format!("{prefix}{name}");
        for spec in layout.entries() {
            let name = named(&spec.name);
            let found = self.shape(&name)?;
            if found != spec.shape {
                return Err(ModelError::TensorShape {
                    name,
                    expected: spec.shape.clone(),
                    found,
                });
            }
        }
        let mut values = Vec::with_capacity(layout.len());
        for spec in layout.entries() {
            values.extend(self.values(&named(&spec.name))?);
        }
        Ok(values)
    }

    fn tensor(&self, name: &str) -> Result<TensorView<'a>, ModelError> {
        let found = self.tensors.tensor(name);
        found.map_err(|_| ModelError::MissingTensor(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn one_key_of_metadata_is_written_as_by_safetensors() {
        for text in ["", "{\"a\":1}", "quotes \" and \u{e9}"] {
            let tensors = [
                (
                    "b.weight",
                    vec![2, 3],
                    vec![1.0f32, -2.0, 0.5, 3.0, 0.0, 1e-3],
                ),
                ("a", vec![1], vec![4.0]),
            ];
            let named: Vec<NamedTensor<'_>> = tensors
                .iter()
                .map(|(name, shape, values)| NamedTensor {
                    name: (*name).to_owned(),
                    shape,
                    values,
                })
                .collect();
            for (precision, dtype) in [(Precision::F32, Dtype::F32), (Precision::F16, Dtype::F16)] {
                let bytes: Vec<Vec<u8>> = named
                    .iter()
                    .map(|t| encode(t, precision).unwrap())
                    .collect();
                let views = named.iter().zip(&bytes).map(|(t, bytes)| {
                    let view = TensorView::new(dtype, t.shape.to_vec(), bytes).unwrap();
                    (t.name.clone(), view)
                });
                let key = "dose3.baseline".to_owned();
                let one = HashMap::from([(key.clone(), text.to_owned())]);
                let theirs = serialize(views, Some(one)).unwrap();
                let sorted = BTreeMap::from([(key, text.to_owned())]);
                assert_eq!(write_tensors(&named, precision, &sorted).unwrap(), theirs);
            }
        }
    }
}
