//! Records on disk, so that an interrupted run goes on where it was.

use super::experiment::Experiment;
use super::record::{MEASUREMENT, Record};
use anyhow::Result;
use dose3::atomic;
use dose3_datasets::hex;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::PathBuf;

/// A folder with a file an experiment.
pub struct Store {
    folder: PathBuf,
    /// Identifies data and settings.
    run: String,
    /// Whether records of earlier runs are taken up.
    resume: bool,
}

/// A record with what it is found by.
#[derive(Serialize, Deserialize)]
struct Kept {
    measurement: u32,
    experiment: serde_json::Value,
    /// Hash of data, settings and weights.
    inputs: String,
    record: Record,
}

impl Store {
    /// A store for runs whose data and settings `inputs` describe; records of others are not taken up.
    pub fn new(folder: PathBuf, inputs: &[String], resume: bool) -> Self {
        let mut hash = Sha256::new();
        for part in inputs {
            hash.update(Sha256::digest(part));
        }
        Self {
            folder,
            run: hex(hash.finalize()),
            resume,
        }
    }

    fn inputs(&self, weights: &[u8]) -> String {
        let mut hash = Sha256::new();
        hash.update(&self.run);
        hash.update(Sha256::digest(weights));
        hex(hash.finalize())
    }

    fn file(&self, experiment: &Experiment) -> Result<PathBuf> {
        let contents = hex(Sha256::digest(serde_json::to_vec(experiment)?));
        let network = experiment.network().name;
        Ok(self
            .folder
            .join(format!("{network}-{}.json", &contents[..12])))
    }

    /// What an earlier run found for this experiment on the same data and weights, with the same settings.
    ///
    /// # Errors
    /// Never with experiments as they are.
    pub fn take_up(&self, experiment: &Experiment, weights: &[u8]) -> Result<Option<Record>> {
        if !self.resume {
            return Ok(None);
        }
        let Ok(bytes) = std::fs::read(self.file(experiment)?) else {
            return Ok(None);
        };
        let Ok(kept) = serde_json::from_slice::<Kept>(&bytes) else {
            return Ok(None);
        };
        let same = kept.measurement == MEASUREMENT
            && kept.experiment == serde_json::to_value(experiment)?
            && kept.inputs == self.inputs(weights);
        Ok(same.then_some(kept.record))
    }

    /// Keeps what an experiment found.
    ///
    /// # Errors
    /// A folder that cannot be written to.
    pub fn keep(&self, experiment: &Experiment, weights: &[u8], record: &Record) -> Result<()> {
        let kept = Kept {
            measurement: MEASUREMENT,
            experiment: serde_json::to_value(experiment)?,
            inputs: self.inputs(weights),
            record: record.clone(),
        };
        let bytes = serde_json::to_vec_pretty(&kept)?;
        Ok(atomic::write(&self.file(experiment)?, &bytes)?)
    }
}

#[cfg(test)]
mod tests {
    use super::super::findings::tests::record;
    use super::*;
    use crate::rows::R3;

    #[test]
    fn only_the_same_experiment_on_the_same_weights_and_data_is_taken_up() {
        let folder = tempfile::tempdir().unwrap();
        let store = |data: &str, resume| Store::new(folder.path().into(), &[data.into()], resume);
        let experiment = Experiment::reference();
        let found = record(&experiment, &[(R3, 0.5)]);
        store("data", true)
            .keep(&experiment, b"weights", &found)
            .unwrap();

        let again = |data: &str, resume, experiment: &Experiment, weights: &[u8]| {
            let found = store(data, resume).take_up(experiment, weights).unwrap();
            found.is_some()
        };
        assert!(again("data", true, &experiment, b"weights"));
        assert!(!again("data", true, &experiment, b"other weights"));
        assert!(!again("other data", true, &experiment, b"weights"));
        assert!(!again("data", false, &experiment, b"weights"));
        let other = Experiment {
            seed: 1,
            ..experiment
        };
        assert!(!again("data", true, &other, b"weights"));

        let file = store("data", true).file(&experiment).unwrap();
        let text = std::fs::read_to_string(&file).unwrap();
        let older = text.replace("\"measurement\": 1,", "\"measurement\": 0,");
        assert_ne!(older, text);
        std::fs::write(&file, older).unwrap();
        assert!(!again("data", true, &experiment, b"weights"));
        std::fs::write(&file, "{").unwrap();
        assert!(!again("data", true, &experiment, b"weights"));
    }
}
