//! Networks as safetensors bytes, with a JSON header in the metadata.

use std::collections::HashMap;

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::Tensor;
use half::f16;
use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::Error;
use crate::layers::download;
use crate::source::Stored;

/// The one metadata key. One only: safetensors writes several in a random order.
const HEADER: &str = "dose3.baseline";
/// The field of the header that is the caller's.
const NOTE: &str = "note";

/// All parameters of `network`, named `prefix` + path, added to `tensors`.
pub(crate) fn collect<M: Module>(
    prefix: &str,
    network: &M,
    tensors: &mut Stored,
) -> Result<(), Error> {
    let mut collector = Collector {
        path: Vec::new(),
        prefix,
        tensors,
        error: None,
    };
    network.visit(&mut collector);
    collector.error.map_or(Ok(()), Err)
}

/// Whether every parameter of `network` is a number.
pub(crate) fn is_finite<M: Module>(network: &M) -> Result<bool, Error> {
    let mut tensors = Stored::new();
    collect("", network, &mut tensors)?;
    let mut values = tensors.values().flat_map(|(_, values)| values);
    Ok(values.all(|value| value.is_finite()))
}

struct Collector<'a> {
    path: Vec<String>,
    prefix: &'a str,
    tensors: &'a mut Stored,
    error: Option<Error>,
}

impl ModuleVisitor for Collector<'_> {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let name = format!("{}{}", self.prefix, self.path.join("."));
        let value = param.val();
        let shape = value.dims().to_vec();
        match download(value) {
            Ok(values) => {
                self.tensors.insert(name, (shape, values));
            }
            Err(error) => self.error = Some(error),
        }
    }
}

/// How tensors are stored. They are computed with in f32 whichever it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// As they are.
    F32,
    /// Rounded to 11 binary digits, half the size.
    F16,
}

/// `weights` (the bytes of a baseline) at `precision` and with `note` in their header: what a caller wants
/// to know of them later. They are read as before.
///
/// # Errors
/// Bytes that are no weights of a baseline, a note that is no JSON, or numbers beyond the range of f16.
pub fn annotate(
    weights: &[u8],
    note: &impl Serialize,
    precision: Precision,
) -> Result<Vec<u8>, Error> {
    let (mut header, tensors): (Map<String, Value>, _) = read(weights)?;
    let note = serde_json::to_value(note).map_err(|error| Error::Header(error.to_string()))?;
    header.insert(NOTE.to_owned(), note);
    write(&header, &tensors, precision)
}

/// The note that [`annotate`] put into the header.
///
/// # Errors
/// Bytes that are no weights of a baseline, or have no such note.
pub fn annotation<N: DeserializeOwned>(weights: &[u8]) -> Result<N, Error> {
    let (mut header, _): (Map<String, Value>, _) = read(weights)?;
    let note = header.remove(NOTE).unwrap_or_default();
    serde_json::from_value(note).map_err(|error| Error::Header(format!("{NOTE}: {error}")))
}

/// The same header and tensors give the same bytes.
pub(crate) fn write(
    header: &impl Serialize,
    tensors: &Stored,
    precision: Precision,
) -> Result<Vec<u8>, Error> {
    let json = serde_json::to_string(header).map_err(|error| Error::Header(error.to_string()))?;
    let mut encoded = Vec::with_capacity(tensors.len());
    for (name, (shape, values)) in tensors {
        check_finite(name, values)?;
        encoded.push((name, shape, encode(name, values, precision)?));
    }
    let dtype = match precision {
        Precision::F32 => Dtype::F32,
        Precision::F16 => Dtype::F16,
    };
    let views = encoded
        .iter()
        .map(|(name, shape, bytes)| Ok((name, TensorView::new(dtype, shape.to_vec(), bytes)?)))
        .collect::<Result<Vec<_>, Error>>()?;
    let metadata = HashMap::from([(HEADER.to_owned(), json)]);
    Ok(serialize(views, Some(metadata))?)
}

fn encode(name: &str, values: &[f32], precision: Precision) -> Result<Vec<u8>, Error> {
    if precision == Precision::F32 {
        return Ok(values.iter().flat_map(|v| v.to_le_bytes()).collect());
    }
    let halves: Vec<f16> = values.iter().map(|&v| f16::from_f32(v)).collect();
    let back: Vec<f32> = halves.iter().map(|half| half.to_f32()).collect();
    check_finite(name, &back)?;
    Ok(halves.iter().flat_map(|half| half.to_le_bytes()).collect())
}

/// The header and all tensors, finite and in f32.
pub(crate) fn read<H: DeserializeOwned>(bytes: &[u8]) -> Result<(H, Stored), Error> {
    let (_, metadata) = SafeTensors::read_metadata(bytes)?;
    let json = metadata
        .metadata()
        .as_ref()
        .and_then(|metadata| metadata.get(HEADER))
        .ok_or_else(|| Error::Header("missing: these are no weights of a baseline".to_owned()))?;
    let header = serde_json::from_str(json).map_err(|error| Error::Header(error.to_string()))?;
    let mut tensors = Stored::new();
    for (name, view) in SafeTensors::deserialize(bytes)?.tensors() {
        let values: Vec<f32> = match view.dtype() {
            Dtype::F32 => {
                let words = view.data().as_chunks::<4>().0;
                words.iter().map(|&word| f32::from_le_bytes(word)).collect()
            }
            Dtype::F16 => {
                let halves = view.data().as_chunks::<2>().0;
                let halves = halves.iter().map(|&half| f16::from_le_bytes(half));
                halves.map(f16::to_f32).collect()
            }
            other => {
                let reason = format!("type {other:?}, expected F32 or F16");
                return Err(Error::Tensor { name, reason });
            }
        };
        check_finite(&name, &values)?;
        tensors.insert(name, (view.shape().to_vec(), values));
    }
    Ok((header, tensors))
}

fn check_finite(name: &str, values: &[f32]) -> Result<(), Error> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(Error::NotFinite {
            what: name.to_owned(),
            index,
            value: f64::from(values[index]),
        }),
        None => Ok(()),
    }
}
