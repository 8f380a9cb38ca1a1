//! Detector and model files.

use crate::seeds::detectors::{judged, with_header};
use dose3::{Detector, Model};

/// A file as others send it.
pub fn file(bytes: &[u8]) {
    let _ = Model::from_bytes(bytes);
    if let Ok(detector) = Detector::from_bytes(bytes) {
        judges(&detector);
    }
}

/// What a detector says of itself, in a file that is sound otherwise.
pub fn header(bytes: &[u8]) {
    let Ok(json) = std::str::from_utf8(bytes) else {
        return;
    };
    if let Ok(detector) = Detector::from_bytes(&with_header(json)) {
        judges(&detector);
    }
}

/// A detector that is accepted judges or refuses, and what it says is a number.
fn judges(detector: &Detector) {
    if let Ok(report) = detector.judge(judged()) {
        let text = serde_json::to_string(&report).unwrap_or_else(|error| panic!("{error}"));
        assert!(!text.is_empty());
    }
}
