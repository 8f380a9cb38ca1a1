//! Detector and model files.

use crate::seeds::detectors::{judged, with_header};
use dose3::{Detector, Model, StreamOptions};

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

/// A detector that is accepted judges or refuses, at once and pose by pose, and what it says is a number.
fn judges(detector: &Detector) {
    if let Ok(report) = detector.judge(judged()) {
        let text = serde_json::to_string(&report).unwrap_or_else(|error| panic!("{error}"));
        assert!(!text.is_empty());
    }
    let monitor = detector.monitor(&StreamOptions::default());
    let Ok(mut stream) = monitor.and_then(|monitor| monitor.stream(judged().frame)) else {
        return;
    };
    for (stamp, pose) in judged().stamps.iter().zip(&judged().poses) {
        if stream.push(*stamp, *pose).is_err() {
            return;
        }
    }
    let state = serde_json::to_string(&stream.state()).unwrap_or_else(|error| panic!("{error}"));
    assert!(!state.is_empty());
}
