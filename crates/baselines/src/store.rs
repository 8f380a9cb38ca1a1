//! Networks as safetensors bytes, with a JSON header in the metadata.

use std::collections::BTreeMap;

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::Tensor;
use dose3_model::{NamedTensor, Precision, TensorFile, write_tensors};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::Error;
use crate::layers::download;
use crate::source::Stored;

/// The one metadata key.
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
    let named: Vec<NamedTensor<'_>> = tensors
        .iter()
        .map(|(name, (shape, values))| NamedTensor {
            name: name.clone(),
            shape,
            values,
        })
        .collect();
    let metadata = BTreeMap::from([(HEADER.to_owned(), json)]);
    Ok(write_tensors(&named, precision, &metadata)?)
}

/// The header and all tensors, finite and in f32.
pub(crate) fn read<H: DeserializeOwned>(bytes: &[u8]) -> Result<(H, Stored), Error> {
    let file = TensorFile::new(bytes)?;
    let json = file
        .metadata
        .get(HEADER)
        .ok_or_else(|| Error::Header("missing: these are no weights of a baseline".to_owned()))?;
    let header = serde_json::from_str(json).map_err(|error| Error::Header(error.to_string()))?;
    let mut tensors = Stored::new();
    for name in file.names() {
        tensors.insert(name.to_owned(), (file.shape(name)?, file.values(name)?));
    }
    Ok((header, tensors))
}
