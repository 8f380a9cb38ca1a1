//! What a model file holds and how it was trained, for people.

use super::{KEY, LogRecord, Model, has_key, read};
use crate::error::Result;
use crate::joint::{self, JointModel, JointSetRecord};
use dose3_datasets::{Frame, hex};
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// A model file in numbers and words; `Display` says it in a terminal.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ModelSummary {
    /// SHA-256 of the file.
    pub sha256: String,
    /// Whether the file says its own digest, which was checked; files of before that was written do not.
    pub sealed: bool,
    /// The networks of the paper, one for translations and one for rotations; joint weights alone have none.
    pub pair: Option<PairSummary>,
    /// The network that sees all six axes at once.
    pub joint: Option<JointSummary>,
}

/// The two networks of the paper.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PairSummary {
    /// Version of the program that trained them.
    pub version: String,
    /// Parameters of both together.
    pub parameters: usize,
    /// How poses become numbers: `paper` or `motion`.
    pub representation: String,
    /// Poses that a window needs.
    pub window_poses: usize,
    /// Rate of the training logs, hertz.
    pub rate_hz: f64,
    /// Body frame of the training logs.
    pub frame: Frame,
    /// Steps of the diffusion process.
    pub diffusion_steps: usize,
    /// Optimiser steps.
    pub steps: usize,
    /// Windows an optimiser step.
    pub batch: usize,
    /// Seed of the training.
    pub seed: u64,
    /// Logs that they were trained on.
    pub logs: Vec<LogRecord>,
    /// Logs held out for validation.
    pub validation: Vec<LogRecord>,
    /// Last validation loss of translations: mean L1 error of the noise.
    pub translation_validation: Option<f64>,
    /// Last validation loss of rotations: mean squared geodesic error, rad^2.
    pub rotation_validation: Option<f64>,
}

/// The joint network.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct JointSummary {
    /// Version of the program that trained it.
    pub version: String,
    /// Parameters.
    pub parameters: usize,
    /// Optimiser steps.
    pub steps: usize,
    /// Sequences an optimiser step.
    pub batch: usize,
    /// Seed of the training.
    pub seed: u64,
    /// What it was trained on.
    pub sets: Vec<JointSetRecord>,
    /// Mean pseudo-Huber error on the validation logs.
    pub validation: Option<f64>,
}

impl ModelSummary {
    /// Whether a file says that it is a model or joint weights; a detector, which holds a model, is none.
    pub fn is_model(path: &Path) -> bool {
        !has_key(path, crate::detector::KEY) && (has_key(path, KEY) || has_key(path, joint::KEY))
    }

    /// Reads a file as [`Model::read`] does, checks it and says what it holds.
    ///
    /// # Errors
    /// As [`Model::read`].
    pub fn read(path: &Path) -> Result<Self> {
        read("model", path, |bytes| {
            let (pair, joint) = match JointModel::is_alone(bytes) {
                true => (None, Some(JointModel::from_bytes(bytes)?)),
                false => {
                    let model = Model::from_bytes(bytes)?.0;
                    (Some(PairSummary::of(&model)), model.joint)
                }
            };
            Ok(Self {
                sha256: hex(Sha256::digest(bytes)),
                sealed: crate::seal::is_sealed(bytes),
                pair,
                joint: joint.as_ref().map(JointSummary::of),
            })
        })
    }
}

impl PairSummary {
    fn of(model: &Model) -> Self {
        let (header, training) = (&model.header, &model.header.training);
        Self {
            version: training.version.clone(),
            parameters: model.parameters.config().parameter_count(),
            representation: header.representation.kind.to_string(),
            window_poses: header.representation.kind.poses(header.window),
            rate_hz: header.rate,
            frame: header.frame,
            diffusion_steps: header.process.steps,
            steps: training.config.steps,
            batch: training.config.batch,
            seed: training.config.seed,
            logs: training.logs.clone(),
            validation: training.validation.clone(),
            translation_validation: training.translation_validation,
            rotation_validation: training.rotation_validation,
        }
    }
}

impl JointSummary {
    fn of(model: &JointModel) -> Self {
        let header = &model.header;
        Self {
            version: header.version.clone(),
            parameters: model.parameters.layout().len(),
            steps: header.training.steps,
            batch: header.training.batch,
            seed: header.training.seed,
            sets: header.sets.clone(),
            validation: header.validation,
        }
    }
}

impl fmt::Display for ModelSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(pair) = &self.pair {
            write!(f, "{pair}")?;
        }
        if let Some(joint) = &self.joint {
            write!(f, "{joint}")?;
        }
        let sealed = match self.sealed {
            true => "its content is as it was written",
            false => "the file does not say its own",
        };
        writeln!(f, "  sha-256     {}; {sealed}", self.sha256)
    }
}

impl fmt::Display for PairSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "  networks    translation and rotation, {} parameters, trained by dose3 {}",
            self.parameters, self.version
        )?;
        writeln!(
            f,
            "  sees        windows of {} poses at {:.1} Hz, frame {}, representation {}",
            self.window_poses, self.rate_hz, self.frame, self.representation
        )?;
        writeln!(
            f,
            "  diffusion   {} steps of the process",
            self.diffusion_steps
        )?;
        let poses: usize = self.logs.iter().map(|log| log.poses).sum();
        writeln!(
            f,
            "  trained     {} steps of {} windows, seed {}, on {}, {poses} poses: {}",
            self.steps,
            self.batch,
            self.seed,
            count(self.logs.len(), "log"),
            names(&self.logs)
        )?;
        let losses = [
            ("translation", self.translation_validation, ""),
            ("rotation", self.rotation_validation, " rad^2"),
        ];
        let losses: Vec<String> = losses
            .into_iter()
            .filter_map(|(name, loss, unit)| Some(format!("{name} {:.4}{unit}", loss?)))
            .collect();
        match losses.is_empty() {
            true => writeln!(f, "  validation  none"),
            false => writeln!(
                f,
                "  validation  {} on {}",
                losses.join(", "),
                names(&self.validation)
            ),
        }
    }
}

impl fmt::Display for JointSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "  network     joint, {} parameters, trained by dose3 {}",
            self.parameters, self.version
        )?;
        write!(
            f,
            "  trained     {} steps of {} sequences, seed {}",
            self.steps, self.batch, self.seed
        )?;
        // One kind of data may be there at several rates.
        let mut kinds: BTreeMap<&str, (usize, Vec<String>)> = BTreeMap::new();
        for set in &self.sets {
            let (logs, rates) = kinds.entry(&set.name).or_default();
            *logs = (*logs).max(set.logs.len());
            rates.push(set.rate.to_string());
        }
        for (name, (logs, rates)) in kinds {
            write!(
                f,
                "\n              {name}: {} at {} Hz",
                count(logs, "log"),
                rates.join(", ")
            )?;
        }
        match self.validation {
            Some(error) => writeln!(f, "\n  validation  error {error:.4}"),
            None => writeln!(f, "\n  validation  none"),
        }
    }
}

/// Names of logs that are listed.
const NAMES: usize = 8;

/// "00, 01 and 7 more".
pub(crate) fn names(logs: &[LogRecord]) -> String {
    let listed: Vec<&str> = logs
        .iter()
        .map(|log| log.name.as_str())
        .take(NAMES)
        .collect();
    let more = match logs.len().saturating_sub(NAMES) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    listed.join(", ") + &more
}

/// "1 log", "2 logs".
pub(crate) fn count(n: usize, what: &str) -> String {
    match n {
        1 => format!("1 {what}"),
        n => format!("{n} {what}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in;
    use dose3_model::Precision;

    #[test]
    fn a_model_says_what_it_is_and_whether_it_was_checked() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.dose3");
        let shipped = built_in::motion().unwrap();
        shipped.write(&path, Precision::F32).unwrap();
        assert!(ModelSummary::is_model(&path));
        let summary = ModelSummary::read(&path).unwrap();
        assert!(summary.sealed && summary.joint.is_none());
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(summary.sha256, hex(Sha256::digest(&bytes)));
        let pair = summary.pair.as_ref().unwrap();
        assert_eq!(pair.window_poses, 129);
        assert_eq!(pair.logs, shipped.header.training.logs);
        let said = summary.to_string();
        for part in [
            "766150 parameters",
            "windows of 129 poses at 10.0 Hz",
            "on 18 logs",
            "as it was written",
            &summary.sha256,
        ] {
            assert!(said.contains(part), "{part:?} is missing in\n{said}");
        }

        let mut altered = bytes;
        *altered.last_mut().unwrap() ^= 1;
        std::fs::write(&path, altered).unwrap();
        let error = ModelSummary::read(&path).unwrap_err().to_string();
        assert!(error.contains("altered or damaged"), "{error}");
        std::fs::write(&path, "no model").unwrap();
        assert!(!ModelSummary::is_model(&path));
    }
}
