//! Checkpoints: everything a run needs to go on bit for bit, in one safetensors file.

use super::{Branch, TrainConfig, log::LogRow};
use crate::error::Error;
use crate::process::ProcessConfig;
use dose3_model::PairConfig;
use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::path::Path;

/// What a checkpoint says about its run; a run resumes only from a checkpoint with equal
/// settings and data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Header {
    pub config: TrainConfig,
    pub process: ProcessConfig,
    pub network: PairConfig,
    /// Identifies the training and validation data.
    pub data: String,
    pub step: usize,
    pub log: Vec<LogRow>,
}

const KEY: &str = "dose3.checkpoint";
const BRANCHES: [&str; 2] = ["translation", "rotation"];

/// Serialises a run's state.
pub(super) fn to_bytes(header: &Header, branches: [&Branch; 2]) -> Result<Vec<u8>, Error> {
    let refuse = |e: &dyn std::fmt::Display| Error::Checkpoint {
        path: "(in memory)".into(),
        reason: e.to_string(),
    };
    let json = serde_json::to_string(header).map_err(|e| refuse(&e))?;
    let mut tensors = Vec::new();
    for (name, branch) in BRANCHES.iter().zip(branches) {
        for (part, values) in branch.parts() {
            let view =
                TensorView::new(Dtype::F32, vec![values.len()], bytemuck::cast_slice(values))
                    .map_err(|e| refuse(&e))?;
            tensors.push((format!("{name}.{part}"), view));
        }
    }
    let metadata = HashMap::from([(KEY.to_string(), json)]);
    serialize(tensors, Some(metadata)).map_err(|e| refuse(&e))
}

/// Reads a checkpoint back into `branches`, whose sizes must fit.
pub(super) fn from_bytes(
    path: &Path,
    bytes: &[u8],
    mut branches: [&mut Branch; 2],
) -> Result<Header, Error> {
    let refuse = |reason: String| Error::Checkpoint {
        path: path.display().to_string(),
        reason,
    };
    let (_, metadata) =
        SafeTensors::read_metadata(bytes).map_err(|e| refuse(format!("not a checkpoint ({e})")))?;
    let json = metadata
        .metadata()
        .as_ref()
        .and_then(|m| m.get(KEY))
        .ok_or_else(|| refuse("a safetensors file, but not a training checkpoint".into()))?;
    let header: Header =
        serde_json::from_str(json).map_err(|e| refuse(format!("unreadable header ({e})")))?;
    let tensors = SafeTensors::deserialize(bytes).map_err(|e| refuse(e.to_string()))?;
    for (name, branch) in BRANCHES.iter().zip(&mut branches) {
        branch.adam_mut().set_step(header.step as u64);
        for (part, values) in branch.parts_mut() {
            let key = format!("{name}.{part}");
            let view = tensors
                .tensor(&key)
                .map_err(|e| refuse(format!("{key}: {e}")))?;
            if view.dtype() != Dtype::F32 || view.shape() != [values.len()] {
                return Err(refuse(format!(
                    "{key}: expected {} f32 numbers, found {:?} of {:?}",
                    values.len(),
                    view.shape(),
                    view.dtype()
                )));
            }
            for (v, b) in values.iter_mut().zip(view.data().chunks_exact(4)) {
                *v = f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
            }
        }
    }
    Ok(header)
}
