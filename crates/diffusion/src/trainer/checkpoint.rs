//! Checkpoints: everything a run needs to go on bit for bit, in one safetensors file.

use super::{LearnerState, TrainConfig, log::LogRow};
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
pub(super) fn to_bytes(header: &Header, branches: &[LearnerState; 2]) -> Result<Vec<u8>, Error> {
    let refuse = |e: &dyn std::fmt::Display| Error::Checkpoint {
        path: "(in memory)".into(),
        reason: e.to_string(),
    };
    let json = serde_json::to_string(header).map_err(|e| refuse(&e))?;
    let mut tensors = Vec::new();
    for (name, branch) in BRANCHES.iter().zip(branches) {
        let LearnerState { values, m, v, ema } = branch;
        for (part, values) in [("values", values), ("m", m), ("v", v), ("ema", ema)] {
            let view =
                TensorView::new(Dtype::F32, vec![values.len()], bytemuck::cast_slice(values))
                    .map_err(|e| refuse(&e))?;
            tensors.push((format!("{name}.{part}"), view));
        }
    }
    let metadata = HashMap::from([(KEY.to_string(), json)]);
    serialize(tensors, Some(metadata)).map_err(|e| refuse(&e))
}

/// Reads a checkpoint of branches with so many parameters each.
pub(super) fn from_bytes(
    path: &Path,
    bytes: &[u8],
    parameters: [usize; 2],
) -> Result<(Header, [LearnerState; 2]), Error> {
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
    let read = |branch: usize, part: &str| -> Result<Vec<f32>, Error> {
        let key = format!("{}.{part}", BRANCHES[branch]);
        let view = tensors
            .tensor(&key)
            .map_err(|e| refuse(format!("{key}: {e}")))?;
        if view.dtype() != Dtype::F32 || view.shape() != [parameters[branch]] {
            return Err(refuse(format!(
                "{key}: expected {} f32 numbers, found {:?} of {:?}",
                parameters[branch],
                view.shape(),
                view.dtype()
            )));
        }
        let numbers = view.data().chunks_exact(4);
        Ok(numbers
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect())
    };
    let state = |branch| -> Result<LearnerState, Error> {
        Ok(LearnerState {
            values: read(branch, "values")?,
            m: read(branch, "m")?,
            v: read(branch, "v")?,
            ema: read(branch, "ema")?,
        })
    };
    Ok((header, [state(0)?, state(1)?]))
}
