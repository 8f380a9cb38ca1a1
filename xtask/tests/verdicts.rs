//! Verdicts on injected faults and on real failures run from start to end on synthetic data with an untrained tiny
//! model.

mod model;

use dose3_datasets::faults::Fault;
use dose3_datasets::synthetic::{Platform, suite};
use dose3_datasets::{Kind, Trajectory, write};
use model::write_model;
use std::fs::{File, create_dir_all};
use std::path::Path;
use std::process::Command;

fn benchmark(folder: &Path, more: &[&str]) -> serde_json::Value {
    write_model(&folder.join("m.dose3"), Kind::Motion);
    let run = Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(["benchmark", "--quick", "--model", "m.dose3", "--out", "."])
        .args([
            "--steps",
            "6",
            "--density",
            "mixture:1",
            "--resamples",
            "10",
        ])
        .args(more)
        .current_dir(folder)
        .env_remove("DOSE3_DATA")
        .output()
        .expect("xtask starts");
    let said = String::from_utf8_lossy(&run.stdout);
    let error = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{said}\n{error}");
    let name = if more.contains(&"--real") {
        "real.json"
    } else {
        "verdicts-synthetic.json"
    };
    let bytes = std::fs::read(folder.join(name)).expect("written");
    serde_json::from_slice(&bytes).expect("JSON")
}

fn list(report: &serde_json::Value, name: &str) -> Vec<serde_json::Value> {
    report[name].as_array().expect("a list").clone()
}

#[test]
fn every_section_on_faults_measures_its_cells() {
    let folder = tempfile::tempdir().expect("a folder");
    let sections = "couplings,timing,short,lengths,few";
    let rows = "kinematic,lin,isolation forest,nearest neighbour";
    let more = [
        "--faults",
        "--synthetic",
        "--only",
        sections,
        "--pieces",
        "2",
        "--rows",
        rows,
    ];
    let report = benchmark(folder.path(), &more);
    // Three sets, four rows; every sixth of the faults.
    let faults = Fault::suite().len().div_ceil(6) + Fault::couplings().len().div_ceil(6);
    assert_eq!(list(&report, "windows").len(), 3 * 4 * faults);
    let stamps = 3 * (1 + Fault::timing().len().div_ceil(6));
    assert_eq!(list(&report, "timing").len(), stamps);
    for alarms in list(&report, "timing_alarms") {
        assert_eq!(
            alarms["called"].as_array().map(Vec::len),
            Some(0),
            "{alarms}"
        );
    }
    let called = list(&report, "called");
    let whole = called.iter().filter(|cell| cell["trusted"].is_null());
    // Logs are too short for pieces of 5000 poses, so they are pieces as they are.
    assert_eq!(whole.count(), 3 * 4 * 5 * (faults + 1));
    assert!(called.iter().any(|cell| cell["trusted"] == 3));
    for cell in &called {
        assert!(cell["called"].as_u64() <= cell["pieces"].as_u64(), "{cell}");
    }
    let text =
        std::fs::read_to_string(folder.path().join("verdicts-synthetic.md")).expect("written");
    for head in [
        "SYNTHETIC",
        "### Windows",
        "10 faulty poses of 1000",
        "1 trusted",
        "### Stamps",
    ] {
        assert!(text.contains(head), "{head}");
    }
}

fn tum(path: &Path, log: &Trajectory) {
    let mut log = log.clone();
    log.stamps
        .iter_mut()
        .for_each(|stamp| *stamp += 1_500_000_000_000_000_000);
    write::tum(&mut File::create(path).expect("a file"), &log).expect("written");
}

#[test]
fn real_failures_are_judged_log_by_log() {
    let folder = tempfile::tempdir().expect("a folder");
    let data = folder.path().join("logs");
    let of = |name: &str| {
        let path = data.join(name);
        create_dir_all(&path).expect("a folder");
        path
    };
    let drives = suite(Platform::Vehicle, 4, 2);
    for (log, name) in drives.iter().zip(["00", "01", "09", "10"]) {
        let path = of("kitti/poses").join(format!("{name}.txt"));
        write::kitti(&mut File::create(path).expect("a file"), log).expect("written");
    }
    let broken = Fault::JitterPosition { metres: 2.0 };
    let broken = |log: &Trajectory| broken.apply(log, 300..600, 1).expect("a fault");
    let estimate = of("kitti-estimates").join("scsfm_0_09.txt");
    let mut estimate = File::create(estimate).expect("a file");
    write::kitti(&mut estimate, &broken(&drives[2])).expect("written");
    let flights = suite(Platform::Drone, 6, 3);
    for (index, log) in flights.iter().enumerate() {
        tum(&of("vio/trusted").join(format!("flight_{index}.txt")), log);
    }
    for kind in ["diverged", "agrees"] {
        of(&format!("vio/{kind}"));
    }
    tum(&of("vio/wrong").join("flight_1.txt"), &broken(&flights[1]));

    let more = [
        "--real",
        "--data",
        "logs",
        "--rows",
        "kinematic,differences",
    ];
    let report = benchmark(folder.path(), &more);
    let judgements = list(&report, "judgements");
    let of = |set: &str, kind: &str| -> Vec<serde_json::Value> {
        let found = judgements
            .iter()
            .filter(|j| j["set"] == set && j["kind"] == kind);
        found.cloned().collect()
    };
    for wrong in [of("vio", "wrong"), of("kitti-estimates", "SC-SfM-Learner")] {
        assert_eq!(wrong.len(), 2);
        assert!(wrong.iter().all(|j| j["called"] == true), "{wrong:?}");
    }
    // Every other flight is trusted.
    assert_eq!(of("vio", "sound").len(), 2 * 3);
    let text = std::fs::read_to_string(folder.path().join("real.md")).expect("written");
    assert!(text.contains("### vio, trusted: every other"), "{text}");
}
