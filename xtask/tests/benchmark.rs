//! The benchmark runs from start to end on synthetic data, and writes what it found.

use std::process::Command;

#[test]
fn synthetic_benchmark_writes_every_cell() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args([
            "benchmark",
            "--synthetic",
            "--quick",
            "--steps",
            "6",
            "--stride",
            "48",
        ])
        .args([
            "--density",
            "mixture:1",
            "--draws",
            "1",
            "--resamples",
            "20",
            "--seeds",
            "2",
        ])
        .current_dir(folder.path())
        .env_remove("DOSE3_DATA")
        .output()
        .expect("xtask starts");
    let said = String::from_utf8_lossy(&run.stdout);
    assert!(
        run.status.success(),
        "{said}\n{}",
        String::from_utf8_lossy(&run.stderr)
    );
    assert!(said.contains("SYNTHETIC"), "{said}");
    let json = std::fs::read(folder.path().join("results/benchmark.json")).expect("written");
    let report: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
    assert_eq!(report["synthetic"], true);
    let runs = report["runs"].as_array().expect("runs");
    assert_eq!(
        runs.iter().map(|r| r["seed"].as_u64()).collect::<Vec<_>>(),
        [Some(0), Some(1)]
    );
    for table in runs
        .iter()
        .flat_map(|r| r["tables"].as_array().expect("tables"))
    {
        let cells = table["cells"].as_array().expect("cells");
        assert_eq!(cells.len(), 6, "{}", table["label"]);
        for cell in cells {
            let auroc = cell["auroc"]["value"].as_f64().expect("a number");
            assert!((0.0..=1.0).contains(&auroc));
        }
    }
    // The density without a network tells a vehicle from a hand-held object whatever the weights.
    let kinematic = runs[0]["tables"]
        .as_array()
        .and_then(|t| t.iter().find(|t| t["row"]["set"] == "kinematic"))
        .expect("the kinematic row");
    assert!(
        kinematic["cells"][0]["auroc"]["value"]
            .as_f64()
            .expect("a number")
            > 0.95
    );
    let markdown =
        std::fs::read_to_string(folder.path().join("results/benchmark.md")).expect("written");
    assert!(markdown.contains("**Synthetic data**") && markdown.contains("| V/H | H/V |"));
}

#[test]
fn a_named_folder_without_data_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(["benchmark", "--data"])
        .arg(folder.path())
        .current_dir(folder.path())
        .output()
        .expect("xtask starts");
    assert!(!run.status.success());
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(
        said.contains("no data set") && said.contains("kitti/poses"),
        "{said}"
    );
}

#[test]
fn a_reader_that_left_stops_nothing() {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let run = Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(["fetch-data", "robotcar"])
        .stdout(writer)
        .output()
        .expect("xtask starts");
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{said}");
}

/// `/dev/full` answers that no space is left.
#[cfg(target_os = "linux")]
#[test]
fn a_full_output_is_an_error_in_words() {
    let full = std::fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .expect("a device");
    let run = Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(["fetch-data", "robotcar"])
        .stdout(full)
        .output()
        .expect("xtask starts");
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(
        !run.status.success() && said.contains("no storage space"),
        "{said}"
    );
}
