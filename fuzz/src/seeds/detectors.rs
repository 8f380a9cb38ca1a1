//! A detector of small synthetic logs, and its parts.

use dose3::{Detector, Trajectory};
use dose3_datasets::synthetic::{Platform, trajectory};
use sha2::{Digest, Sha256};
use std::sync::LazyLock;

/// The key of the metadata under which a detector speaks of itself.
const KEY: &str = "dose3.detector";

/// The key of the metadata with the digest of the file.
const DIGEST: &str = "dose3.sha256";

static FILE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let trusted: Vec<Trajectory> = (0..4)
        .map(|seed| trajectory(Platform::Vehicle, seed, 400, 10.0))
        .collect();
    let detector = Detector::fit(&trusted).unwrap_or_else(|error| panic!("{error}"));
    detector
        .to_bytes()
        .unwrap_or_else(|error| panic!("{error}"))
});

/// A safetensors file taken apart: its header, JSON, and the tensors behind it.
pub struct Parts {
    header: serde_json::Value,
    tensors: Vec<u8>,
}

impl Parts {
    /// Takes a file apart.
    pub fn of(file: &[u8]) -> Self {
        let mut length = [0; 8];
        length.copy_from_slice(&file[..8]);
        let end = 8 + u64::from_le_bytes(length) as usize;
        let header = serde_json::from_slice(&file[8..end]);
        Self {
            header: header.unwrap_or_else(|error| panic!("{error}")),
            tensors: file[end..].to_vec(),
        }
    }

    /// An entry of the metadata.
    pub fn entry(&self, key: &str) -> &str {
        self.header["__metadata__"][key]
            .as_str()
            .unwrap_or_default()
    }

    /// The file with another text in an entry; sealed again where it was, so that what it says is what is tried.
    pub fn with_entry(&self, key: &str, text: &str) -> Vec<u8> {
        let mut header = self.header.clone();
        let metadata = &mut header["__metadata__"];
        let sealed = metadata.get(DIGEST).is_some();
        metadata[key] = text.into();
        if sealed {
            metadata[DIGEST] = "0".repeat(64).into();
        }
        let text = header.to_string();
        let length = (text.len() as u64).to_le_bytes();
        let mut file = [&length[..], text.as_bytes(), &self.tensors].concat();
        let before = format!("\"{DIGEST}\":\"");
        if let Some(found) = text.find(&before).filter(|_| sealed) {
            let digest = dose3_datasets::hex(Sha256::digest(&file));
            let place = 8 + found + before.len();
            file[place..place + digest.len()].copy_from_slice(digest.as_bytes());
        }
        file
    }
}

static PARTS: LazyLock<Parts> = LazyLock::new(|| Parts::of(&FILE));

static JUDGED: LazyLock<Trajectory> = LazyLock::new(|| trajectory(Platform::Vehicle, 9, 300, 10.0));

/// A detector file.
pub fn files() -> Vec<Vec<u8>> {
    vec![FILE.clone()]
}

/// What the detector says of itself, JSON.
pub fn headers() -> Vec<Vec<u8>> {
    vec![PARTS.entry(KEY).as_bytes().to_vec()]
}

/// The detector file with other words of itself, sealed.
pub fn with_header(json: &str) -> Vec<u8> {
    PARTS.with_entry(KEY, json)
}

/// A log for detectors that are accepted.
pub fn judged() -> &'static Trajectory {
    &JUDGED
}
