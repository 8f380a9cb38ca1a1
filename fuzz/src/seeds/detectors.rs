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

static PARTS: LazyLock<(serde_json::Value, &'static [u8])> = LazyLock::new(|| {
    let mut length = [0; 8];
    length.copy_from_slice(&FILE[..8]);
    let end = 8 + u64::from_le_bytes(length) as usize;
    let header = serde_json::from_slice(&FILE[8..end]).unwrap_or_else(|error| panic!("{error}"));
    (header, &FILE[end..])
});

static JUDGED: LazyLock<Trajectory> = LazyLock::new(|| trajectory(Platform::Vehicle, 9, 300, 10.0));

/// A detector file.
pub fn files() -> Vec<Vec<u8>> {
    vec![FILE.clone()]
}

/// What the detector says of itself, JSON.
pub fn headers() -> Vec<Vec<u8>> {
    let text = PARTS.0["__metadata__"][KEY].as_str().unwrap_or_default();
    vec![text.as_bytes().to_vec()]
}

/// The detector file with other words of itself, sealed.
pub fn with_header(json: &str) -> Vec<u8> {
    let mut header = PARTS.0.clone();
    header["__metadata__"][KEY] = json.into();
    header["__metadata__"][DIGEST] = "0".repeat(64).into();
    let text = header.to_string();
    let length = (text.len() as u64).to_le_bytes();
    let mut file = [&length[..], text.as_bytes(), PARTS.1].concat();
    // Sealed again, so that what it says is what is tried.
    let before = format!("\"{DIGEST}\":\"");
    let digest = dose3_datasets::hex(Sha256::digest(&file));
    if let Some(found) = text.find(&before) {
        let place = 8 + found + before.len();
        file[place..place + digest.len()].copy_from_slice(digest.as_bytes());
    }
    file
}

/// A log for detectors that are accepted.
pub fn judged() -> &'static Trajectory {
    &JUDGED
}
