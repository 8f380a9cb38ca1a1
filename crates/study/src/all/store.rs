//! Finished jobs on disk, so that an interrupted run goes on where it was.
//!
//! A job is taken up where program, data, weights and settings are what they were. The program is told by
//! its sources without those that only write tables and draw, so that a better caption costs no new run.

use super::measure::Found;
use anyhow::{Context, Result};
use dose3::atomic;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Folders of sources, from the root of the workspace.
const SOURCES: [&str; 2] = ["crates", "Cargo.lock"];
/// Sources of this folder that no measured number depends on.
const WRITING: [&str; 10] = [
    "clock.rs",
    "cost.rs",
    "figures",
    "findings.rs",
    "page.rs",
    "readings.rs",
    "report.rs",
    "shortfalls.rs",
    "table.rs",
    "tables.rs",
];
/// This folder, from the root of the workspace.
const HERE: &str = "crates/study/src/all";

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
    /// A store for runs that `identity` describes; what another program left is not taken up.
    ///
    /// # Errors
    /// The program's sources cannot be read.
    pub fn new(folder: PathBuf, identity: &[String], resume: bool) -> Result<Self> {
        let mut hash = Sha256::new();
        hash.update(program(Path::new(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../.."
        )))?);
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
        atomic::write(&self.file(key), &serde_json::to_vec_pretty(&kept)?)?;
        Ok(())
    }
}

/// The hash of the sources under the root of the workspace.
fn program(root: &Path) -> Result<Vec<u8>> {
    let mut files = Vec::new();
    for source in SOURCES {
        collect(&root.join(source), &mut files)?;
    }
    files.sort();
    let here = root.join(HERE);
    let mut hash = Sha256::new();
    for file in files {
        if WRITING.iter().any(|name| file.starts_with(here.join(name))) {
            continue;
        }
        let bytes = std::fs::read(&file).with_context(|| unreadable(&file))?;
        hash.update(Sha256::digest(bytes));
    }
    Ok(hash.finalize().to_vec())
}

/// All Rust sources and lock files under `path`.
fn collect(path: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    if path.is_dir() {
        for entry in std::fs::read_dir(path).with_context(|| unreadable(path))? {
            collect(&entry?.path(), files)?;
        }
        return Ok(());
    }
    let kept = path.extension().is_some_and(|e| e == "rs" || e == "lock");
    if kept || !path.exists() {
        files.push(path.into());
    }
    Ok(())
}

fn unreadable(path: &Path) -> String {
    format!(
        "cannot read {}, by which finished jobs are recognised: run this from its workspace",
        path.display()
    )
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::super::findings::Outcome;
    use super::super::findings::tests::job;
    use super::*;
    use crate::cells::Protocol;

    #[test]
    fn numbers_depend_on_measuring_sources_and_not_on_writing_ones() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let write = |name: &str, text: &str| {
            let path = root.join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        assert!(program(root).is_err());
        write("Cargo.lock", "1");
        write("crates/ood/src/lib.rs", "1");
        write(&format!("{HERE}/measure.rs"), "1");
        let before = program(root).unwrap();
        write(&format!("{HERE}/page.rs"), "2");
        write(&format!("{HERE}/figures/roc.rs"), "2");
        assert_eq!(program(root).unwrap(), before);
        write(&format!("{HERE}/measure.rs"), "2");
        let after = program(root).unwrap();
        assert_ne!(after, before);
        write("crates/ood/src/lib.rs", "2");
        assert_ne!(program(root).unwrap(), after);
        let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/all");
        assert!(WRITING.iter().all(|name| here.join(name).exists()));
    }

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
