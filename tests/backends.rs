//! The program gives the same scores on burn's CPU backends as on the built-in engine, and with any vector instructions.

mod common;

use common::{dose3, expect_code, stdout, write_logs};
use dose3_datasets::synthetic::Platform;

use std::process::Command;

/// Window scores of `score --json` on one backend.
fn scores(detector: &str, log: &str, backend: &str) -> Vec<f64> {
    scores_with(detector, log, backend, "")
}

/// The same with those vector instructions.
fn scores_with(detector: &str, log: &str, backend: &str, instructions: &str) -> Vec<f64> {
    let run = Command::new(env!("CARGO_BIN_EXE_dose3"))
        .args(["score", "--json", "--backend", backend])
        .args(["--detector", detector, log])
        .env("DOSE3_INSTRUCTIONS", instructions)
        .output()
        .expect("the program starts");
    assert!(
        matches!(run.status.code(), Some(0 | 1)),
        "{backend}: {}",
        common::stderr(&run)
    );
    let report: serde_json::Value = serde_json::from_str(&stdout(&run)).expect("JSON");
    let windows = report["logs"][0]["windows"].as_array().expect("windows");
    windows
        .iter()
        .map(|w| w["score"].as_f64().expect("a score"))
        .collect()
}

#[test]
fn burn_backends_score_as_the_engine_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let trusted = folder.path().join("trusted");
    let logs = write_logs(&trusted, Platform::Vehicle, 4, 800);
    let detector = folder.path().join("detector.dose3").display().to_string();
    let fit = dose3([
        "fit",
        "--trusted",
        &trusted.display().to_string(),
        "--out",
        &detector,
        "--steps",
        "6",
        "--density",
        "mixture:2",
    ]);
    expect_code(&fit, 0);
    let log = logs[0].display().to_string();
    let engine = scores(&detector, &log, "engine");
    assert!(engine.len() >= 5);
    for instructions in ["portable", "avx2", "neon"] {
        let other = scores_with(&detector, &log, "engine", instructions);
        assert_eq!(engine.len(), other.len());
        for (a, b) in engine.iter().zip(&other) {
            assert!(
                (a - b).abs() < 1e-3 * (1.0 + a.abs()),
                "{instructions}: {a} {b}"
            );
        }
    }
    for backend in ["burn-flex", "ndarray"] {
        let other = scores(&detector, &log, backend);
        assert_eq!(engine.len(), other.len());
        for (a, b) in engine.iter().zip(&other) {
            // f32 networks, and a density that divides by small variances.
            assert!((a - b).abs() < 1e-2 * (1.0 + a.abs()), "{backend}: {a} {b}");
        }
    }
}
