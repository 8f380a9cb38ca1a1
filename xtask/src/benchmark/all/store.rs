//! Finished jobs on disk, so that an interrupted run goes on where it was.

use super::measure::Found;
use anyhow::{Context, Result};
use dose3::atomic;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::PathBuf;

/// A folder with a file a job.
pub struct Store {
    folder: PathBuf,
    /// Identifies program, data and settings.
    run: String,
    /// Whether jobs of earlier runs are taken up.
    resume: bool,
}

#[derive(Serialize, Deserialize)]
struct Kept {
    fingerprint: String,
    found: Found,
}

impl Store {
    /// A store for runs that `identity` describes; what other builds of the program left is not taken up.
    ///
    /// # Errors
    /// The program's own file cannot be read.
    pub fn new(folder: PathBuf, identity: &[String], resume: bool) -> Result<Self> {
        let program = std::env::current_exe().context("where is this program?")?;
        let bytes = std::fs::read(&program)
            .with_context(|| format!("cannot read {}", program.display()))?;
        let mut hash = Sha256::new();
        hash.update(Sha256::digest(bytes));
        for part in identity {
            hash.update(Sha256::digest(part));
        }
        Ok(Self {
            folder,
            run: hex(&hash.finalize()),
            resume,
        })
    }

    fn fingerprint(&self, job: &str, model: &[u8]) -> String {
        let mut hash = Sha256::new();
        hash.update(&self.run);
        hash.update(Sha256::digest(job));
        hash.update(Sha256::digest(model));
        hex(&hash.finalize())
    }

    fn file(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.json"))
    }

    /// What an earlier run of the same program found for the same job on the same weights and data.
    pub fn take_up(&self, key: &str, job: &str, model: &[u8]) -> Option<Found> {
        if !self.resume {
            return None;
        }
        let bytes = std::fs::read(self.file(key)).ok()?;
        let kept: Kept = serde_json::from_slice(&bytes).ok()?;
        (kept.fingerprint == self.fingerprint(job, model)).then_some(kept.found)
    }

    /// Keeps what a job found.
    ///
    /// # Errors
    /// A folder that cannot be written to.
    pub fn keep(&self, key: &str, job: &str, model: &[u8], found: &Found) -> Result<()> {
        let kept = Kept {
            fingerprint: self.fingerprint(job, model),
            found: found.clone(),
        };
        atomic::write(&self.file(key), &serde_json::to_vec_pretty(&kept)?)
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::super::findings::Outcome;
    use super::super::findings::tests::job;
    use super::*;
    use crate::benchmark::cells::Protocol;

    #[test]
    fn only_the_same_job_on_the_same_weights_and_data_is_taken_up() {
        let folder = tempfile::tempdir().unwrap();
        let store = |identity: &str, resume| {
            Store::new(folder.path().into(), &[identity.into()], resume).unwrap()
        };
        let (key, outcome) = job("a", &[("r3", Protocol::Paper, 0.5)]);
        let Outcome::Found(found) = outcome else {
            panic!("the job was made as found")
        };
        store("data", true)
            .keep(&key, "settings", b"weights", &found)
            .unwrap();

        let again = |identity, resume, job: &str, model: &[u8]| {
            store(identity, resume).take_up(&key, job, model).is_some()
        };
        assert!(again("data", true, "settings", b"weights"));
        assert!(!again("data", true, "settings", b"other weights"));
        assert!(!again("data", true, "other settings", b"weights"));
        assert!(!again("other data", true, "settings", b"weights"));
        assert!(!again("data", false, "settings", b"weights"));
        std::fs::write(folder.path().join("a.json"), b"{").unwrap();
        assert!(!again("data", true, "settings", b"weights"));
    }
}
