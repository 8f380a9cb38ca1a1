//! `benchmark --faults` runs from start to end on synthetic data with an untrained tiny model.

mod model;

use dose3_datasets::Kind;
use model::write_model;
use std::path::Path;
use std::process::{Command, Output};

fn faults(folder: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(["benchmark", "--faults", "--synthetic", "--quick"])
        .args(["--model", "m.dose3", "--steps", "6", "--stride", "96"])
        .args(["--density", "mixture:1", "--resamples", "10"])
        .args(["--sites", "6"])
        .args(more)
        .current_dir(folder)
        .env_remove("DOSE3_DATA")
        .output()
        .expect("xtask starts")
}

#[test]
fn faults_are_measured_and_repeat() {
    let folder = tempfile::tempdir().expect("a folder");
    write_model(&folder.path().join("m.dose3"), Kind::Motion);
    let json = |name: &str, more: &[&str]| -> serde_json::Value {
        let run = faults(folder.path(), &[&["--out", name], more].concat());
        let said = String::from_utf8_lossy(&run.stdout);
        let error = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{said}\n{error}");
        assert!(said.contains("SYNTHETIC"), "{said}");
        let bytes = std::fs::read(folder.path().join(name).join("faults.json")).expect("written");
        serde_json::from_slice(&bytes).expect("JSON")
    };
    let report = json("a", &[]);
    let run = &report["runs"][0];
    let list = |name: &str| run[name].as_array().expect("a list").clone();
    let faults = report["faults"].as_u64().expect("a number");
    // Three sets and eleven rows.
    assert_eq!(list("windows").len() as u64, 3 * 11 * faults);
    assert_eq!(list("logs").len() as u64, 3 * 4 * (faults + 1));
    assert_eq!(list("alarms").len(), 6);
    assert_eq!(list("cells").len(), 6 * 11);
    assert!(!list("poses").is_empty() && !list("controls").is_empty());
    let of = |list: &[serde_json::Value], key: &str, value: &str| -> Vec<serde_json::Value> {
        let found = list.iter().filter(|c| c[key] == value);
        found.cloned().collect()
    };
    // Three metres in one step is plain to the densities without a network, and a world that is
    // turned is no fault.
    for cell in of(
        &of(&list("windows"), "fault", "jump:3m"),
        "method",
        "kinematic",
    ) {
        assert!(cell["auroc"].as_f64() > Some(0.9), "{cell}");
        assert!(cell["interval"]["lower"].is_number(), "{cell}");
    }
    for cell in of(&list("controls"), "control", "reanchor") {
        let auroc = cell["auroc"].as_f64().expect("a number");
        assert!((auroc - 0.5).abs() < 0.02, "{cell}");
    }
    let markdown = std::fs::read_to_string(folder.path().join("a/faults.md")).expect("written");
    for head in [
        "summary",
        "Faults in logs",
        "False alarms",
        "Where the fault is",
    ] {
        assert!(markdown.contains(head), "{head}");
    }

    let again = json("b", &["--only", "windows"]);
    assert_eq!(again["runs"][0]["windows"], run["windows"]);
    assert_eq!(again["summaries"], report["summaries"]);
    assert_eq!(again["runs"][0]["alarms"].as_array().map(Vec::len), Some(0));
    let validation = json("c", &["--part", "validation", "--only", "windows"]);
    assert_ne!(validation["runs"][0]["windows"], run["windows"]);
}

#[test]
fn a_paper_model_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    write_model(&folder.path().join("m.dose3"), Kind::Paper);
    let run = faults(folder.path(), &[]);
    assert!(!run.status.success());
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(said.contains("no motion model"), "{said}");
}
