//! Train, fit, score, eval, inspect, sample: the program as a user runs it, on synthetic logs.

mod common;

use common::{dose3, expect_code, stderr, stdout, tiny_model, write_logs};
use dose3_datasets::synthetic::Platform;
use std::path::Path;

fn text(path: &Path) -> String {
    path.display().to_string()
}

/// A detector fitted on vehicle logs with the built-in model; answers (detector, unseen vehicle
/// logs, hand-held logs).
fn vehicle_detector(folder: &Path) -> (String, Vec<String>, Vec<String>) {
    let trusted = folder.join("trusted");
    let logs = write_logs(&trusted, Platform::Vehicle, 8, 700);
    // The last two are not trusted: they move out of the folder.
    let unseen = folder.join("unseen");
    std::fs::create_dir_all(&unseen).expect("a folder");
    let unseen = logs[6..]
        .iter()
        .map(|path| {
            let to = unseen.join(path.file_name().expect("a name"));
            std::fs::rename(path, &to).expect("moved");
            text(&to)
        })
        .collect();
    let other = write_logs(&folder.join("other"), Platform::Handheld, 2, 700);
    let detector = text(&folder.join("detector.dose3"));
    let fit = dose3([
        "fit",
        "--trusted",
        &text(&trusted),
        "--out",
        &detector,
        "--steps",
        "10",
        "--density",
        "mixture:2",
        "--statistics",
        "paper24+kinematic",
    ]);
    expect_code(&fit, 0);
    assert!(stderr(&fit).contains("wrote"), "{}", stderr(&fit));
    (detector, unseen, other.iter().map(|p| text(p)).collect())
}

#[test]
fn fit_and_score_accept_the_like_and_reject_the_unlike() {
    let folder = tempfile::tempdir().expect("a folder");
    let (detector, unseen, other) = vehicle_detector(folder.path());

    let accepted = dose3(["score", "--detector", &detector, &unseen[0]]);
    expect_code(&accepted, 0);
    assert!(
        stdout(&accepted).contains("in distribution"),
        "{}",
        stdout(&accepted)
    );

    let rejected = dose3(["score", "--detector", &detector, &other[0], "--windows"]);
    expect_code(&rejected, 1);
    let said = stdout(&rejected);
    for part in [
        "OUT OF DISTRIBUTION",
        "where",
        "lines 2 to",
        "why",
        "  window ",
    ] {
        assert!(said.contains(part), "{part:?} is missing in\n{said}");
    }

    // JSON for programs: the same verdicts, and everything a program needs to act on them.
    let json = dose3([
        "score",
        "--detector",
        &detector,
        "--json",
        &unseen[0],
        &other[0],
    ]);
    expect_code(&json, 1);
    let value: serde_json::Value = serde_json::from_str(&stdout(&json)).expect("JSON");
    let logs = value["logs"].as_array().expect("logs");
    assert_eq!(logs[0]["verdict"], "in-distribution");
    assert_eq!(logs[1]["verdict"], "out-of-distribution");
    assert_eq!(logs[1]["segments"][0]["first_pose"], 0);
    assert!(logs[1]["contributions"][0]["group"].is_string());
    let p = logs[1]["evidence"]["p_value"].as_f64().expect("a chance");
    assert!(p <= 0.05, "{p}");
    // The audit may leave one of the six trusted logs out.
    let basis = &logs[1]["evidence"]["basis"];
    let groups = basis["groups"].as_f64().expect("a number");
    assert!((5.0..=6.0).contains(&groups), "{basis}");
    let ranks = basis["smallest_rank_p"].as_f64().expect("a chance");
    assert!((ranks - 1.0 / (groups + 1.0)).abs() < 1e-12, "{basis}");

    // A log that cannot be read does not stop the others, and the exit code says so.
    let missing = text(&folder.path().join("nowhere.txt"));
    let mixed = dose3(["score", "--detector", &detector, &missing, &other[0]]);
    expect_code(&mixed, 2);
    assert!(stdout(&mixed).contains("OUT OF DISTRIBUTION"));
    assert!(stderr(&mixed).contains("nowhere.txt"), "{}", stderr(&mixed));

    let eval = dose3([
        "eval",
        "--detector",
        &detector,
        "--id",
        &unseen[0],
        &unseen[1],
        "--ood",
        &other[0],
        &other[1],
        "--json",
    ]);
    expect_code(&eval, 0);
    let value: serde_json::Value = serde_json::from_str(&stdout(&eval)).expect("JSON");
    let auroc = value["windows"][0]["estimate"]["value"]
        .as_f64()
        .expect("a number");
    assert!(auroc > 0.95, "vehicle against hand-held object: {auroc}");
    assert_eq!(value["leaked"].as_array().map(Vec::len), Some(0));
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    let folder = tempfile::tempdir().expect("a folder");
    let one = tiny_model(folder.path(), &["--threads", "1"]);
    let two = tiny_model(folder.path(), &["--threads", "3"]);
    assert_eq!(
        std::fs::read(&one).expect("bytes"),
        std::fs::read(&two).expect("bytes")
    );

    let data = text(&folder.path().join("train"));
    let fit = |threads: &str| {
        let out = text(&folder.path().join(format!("detector{threads}.dose3")));
        let run = dose3([
            "fit",
            "--model",
            &text(&one),
            "--trusted",
            &data,
            "--out",
            &out,
            "--threads",
            threads,
            "--density",
            "mixture:2",
        ]);
        expect_code(&run, 0);
        std::fs::read(out).expect("bytes")
    };
    assert_eq!(fit("1"), fit("2"));
    let score = |threads: &str| {
        let detector = text(&folder.path().join("detector1.dose3"));
        dose3([
            "score",
            "--detector",
            &detector,
            &data,
            "--json",
            "--threads",
            threads,
        ])
        .stdout
    };
    assert!(!score("1").is_empty());
    assert_eq!(score("1"), score("2"));
}

#[test]
fn training_writes_model_log_and_plot_and_resumes_when_finished() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = tiny_model(folder.path(), &[]);
    let log = std::fs::read_to_string(model.with_extension("log.csv")).expect("a log");
    let rows: Vec<&str> = log.lines().collect();
    assert!(
        rows[0].starts_with("step,learning_rate,translation_eps"),
        "{}",
        rows[0]
    );
    assert_eq!(rows.len(), 3, "20 steps, a row every 10:\n{log}");
    assert!(
        rows[2].split(',').all(|cell| !cell.is_empty()),
        "validated at the end: {}",
        rows[2]
    );
    let plot = std::fs::read_to_string(model.with_extension("loss.svg")).expect("a plot");
    assert!(plot.starts_with("<svg") && plot.contains("held-out logs"));

    // The run's checkpoint is whole: the same command has nothing left to do and changes nothing.
    let before = std::fs::read(&model).expect("bytes");
    assert_eq!(
        before,
        std::fs::read(tiny_model(folder.path(), &[])).expect("bytes")
    );

    // Another run does not go on from it, it says what differs.
    let data = text(&folder.path().join("train"));
    let other = dose3([
        "train",
        "--data",
        &data,
        "--out",
        &text(&model),
        "--width",
        "8",
        "--multipliers",
        "1,2",
        "--window",
        "64",
        "--steps",
        "30",
        "--batch",
        "8",
        "--diffusion-steps",
        "12",
    ]);
    expect_code(&other, 2);
    assert!(
        stderr(&other).contains("training configuration differs"),
        "{}",
        stderr(&other)
    );
}

#[test]
fn half_precision_is_half_the_size_and_scores_alike() {
    let folder = tempfile::tempdir().expect("a folder");
    let full = tiny_model(folder.path(), &[]);
    let half = tiny_model(folder.path(), &["--half"]);
    let size = |p: &Path| std::fs::metadata(p).expect("a file").len() as f64;
    assert!(size(&half) < 0.6 * size(&full));
    let data = text(&folder.path().join("train"));
    let scores = |model: &Path| -> Vec<f64> {
        let out = text(&model.with_extension("detector"));
        let fit = dose3([
            "fit",
            "--model",
            &text(model),
            "--trusted",
            &data,
            "--out",
            &out,
            "--density",
            "mixture:1",
        ]);
        expect_code(&fit, 0);
        let json = stdout(&dose3(["score", "--detector", &out, &data, "--json"]));
        let value: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        let logs = value["logs"].as_array().expect("logs");
        logs.iter()
            .map(|l| l["evidence"]["mean_score"].as_f64().expect("a score"))
            .collect()
    };
    let (full, half) = (scores(&full), scores(&half));
    assert_eq!(full.len(), 4);
    for (a, b) in full.iter().zip(&half) {
        assert!((a - b).abs() < 0.05 * (1.0 + a.abs()), "{a} and {b}");
    }
}

/// Files of older formats stay readable: these detectors (see tests/fixtures/README.md) still give the
/// scores they gave then.
#[test]
fn detectors_of_older_formats_stay_readable() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/fixtures");
    let folder = tempfile::tempdir().expect("a folder");
    let log = text(&write_logs(folder.path(), Platform::Vehicle, 1, 400)[0]);
    for (name, frame) in [
        ("detector-v1", "sensor"),
        ("detector-v2", "body-flu"),
        ("detector-v3", "body-flu"),
        ("detector-v4", "body-flu"),
    ] {
        let detector = text(&fixtures.join(name).with_extension("dose3"));
        let args = ["score", "--detector", &detector, "--frame", frame, "--json"];
        let run = dose3(args.into_iter().chain([log.as_str()]));
        expect_code(&run, 0);
        let value: serde_json::Value = serde_json::from_str(&stdout(&run)).expect("JSON");
        let score = value["logs"][0]["evidence"]["mean_score"].as_f64();
        let score = score.expect("a score");
        let then = std::fs::read_to_string(fixtures.join(name).with_extension("score"));
        let then: f64 = then.expect("then").trim().parse().expect("a number");
        // Other processors round differently.
        assert!(
            (score - then).abs() < 1e-2 * (1.0 + then.abs()),
            "{name}: {score}, then {then}"
        );
    }
}

#[test]
fn every_process_can_be_trained() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = tiny_model(
        folder.path(),
        &[
            "--rotation-process",
            "tangent",
            "--rotation-noise",
            "ig-so3",
            "--rotation-schedule",
            "linear",
            "--translation-schedule",
            "linear",
        ],
    );
    let bytes = std::fs::read(model).expect("bytes");
    let (model, _) = dose3::model_file::Model::from_bytes(&bytes).expect("a model");
    let process = model.header.process;
    assert_eq!(
        process.rotation_process,
        dose3_diffusion::RotationProcess::Tangent
    );
    assert_eq!(
        process.rotation_noise,
        dose3_diffusion::RotationNoise::IgSo3
    );
    assert_eq!(process.rotation, dose3_diffusion::NoiseSchedule::LINEAR);
    assert_eq!(process.translation, dose3_diffusion::NoiseSchedule::LINEAR);
}

#[test]
fn samples_are_logs_that_can_be_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("samples");
    let run = dose3([
        "sample",
        "--model",
        "paper",
        "--out",
        &text(&out),
        "--count",
        "2",
        "--seed",
        "5",
    ]);
    expect_code(&run, 0);
    let inspect = dose3(["inspect", &text(&out), "--format", "kitti", "--json"]);
    expect_code(&inspect, 0);
    let value: serde_json::Value = serde_json::from_str(&stdout(&inspect)).expect("JSON");
    assert_eq!(value.as_array().map(Vec::len), Some(2));
    assert_eq!(value[0]["poses"], 128);
    // Increments of a motion model lead from a first pose to the others.
    let out = folder.path().join("motion");
    expect_code(&dose3(["sample", "--out", &text(&out), "--count", "1"]), 0);
    let inspect = dose3(["inspect", &text(&out), "--format", "kitti", "--json"]);
    let value: serde_json::Value = serde_json::from_str(&stdout(&inspect)).expect("JSON");
    assert_eq!(value[0]["poses"], 129);
}

#[test]
fn inspect_says_what_a_log_holds() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = write_logs(folder.path(), Platform::Vehicle, 1, 300).remove(0);
    let run = dose3(["inspect", &text(&log)]);
    expect_code(&run, 0);
    let said = stdout(&run).replace(&text(folder.path()), "FOLDER");
    for part in [
        "tum, body frame sensor",
        "300 at 20.00 Hz",
        "no gap",
        "m long",
    ] {
        assert!(said.contains(part), "{part:?} is missing in\n{said}");
    }
}

/// Names tell logs apart, a log that is named twice is judged once, and older names of flags still work.
#[test]
fn equal_file_names_are_told_apart_and_old_flags_work() {
    let folder = tempfile::tempdir().expect("a folder");
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    let log = text(&write_logs(&a, Platform::Vehicle, 3, 700)[0]);
    write_logs(&b, Platform::Vehicle, 1, 700);
    let fit = |name: &str, flags: &[&str]| {
        let out = text(&folder.path().join(name));
        let args = [
            "fit",
            "--trusted",
            &text(&a),
            "--statistics",
            "residual",
            "--out",
            &out,
        ]
        .map(String::from);
        let settings = ["--steps", "6", "--density", "mixture:1"].map(String::from);
        let flags = flags.iter().map(|flag| (*flag).to_string());
        expect_code(&dose3(args.into_iter().chain(settings).chain(flags)), 0);
        out
    };
    let detector = fit("new.dose3", &["--noise", "own"]);
    let old = fit("old.dose3", &["--own-noise"]);
    let bytes = |path: &str| std::fs::read(path).expect("bytes");
    assert_eq!(bytes(&detector), bytes(&old));
    let run = dose3([
        "score",
        "--detector",
        &detector,
        "--json",
        &text(&b),
        &text(&a),
        &log,
    ]);
    let value: serde_json::Value = serde_json::from_str(&stdout(&run)).expect("JSON");
    let logs = value["logs"].as_array().expect("logs");
    let names: Vec<&str> = logs
        .iter()
        .filter_map(|l| l["log"]["name"].as_str())
        .collect();
    assert_eq!(
        names,
        ["b/vehicle_0", "a/vehicle_0", "vehicle_1", "vehicle_2"]
    );
    tiny_model(folder.path(), &["--protocol", "motion"]);
}

#[test]
fn help_names_every_subcommand_and_the_exit_codes() {
    let run = dose3(["--help"]);
    expect_code(&run, 0);
    insta::assert_snapshot!("help", stdout(&run));
}

/// The default detector end to end: a jump is found, and the pose is named.
#[test]
fn score_names_the_pose_of_a_jump() {
    let folder = tempfile::tempdir().expect("a folder");
    let trusted = folder.path().join("trusted");
    write_logs(&trusted, Platform::Vehicle, 6, 700);
    let detector = text(&folder.path().join("detector.dose3"));
    expect_code(
        &dose3(["fit", "--trusted", &text(&trusted), "--out", &detector]),
        0,
    );
    let sound = dose3_datasets::synthetic::trajectory(Platform::Vehicle, 40, 700, 20.0);
    let jump = dose3_datasets::faults::Fault::Jump { metres: 5.0 };
    let jumped = jump.apply(&sound, 300..302, 1).expect("a jump");
    let path = folder.path().join("jumped.txt");
    let mut file = std::fs::File::create(&path).expect("a file");
    dose3_datasets::write::tum(&mut file, &jumped).expect("written");
    drop(file);
    let run = dose3(["score", "--detector", &detector, "--json", &text(&path)]);
    let value: serde_json::Value = serde_json::from_str(&stdout(&run)).expect("JSON");
    // 20 Hz are judged at 10 Hz: pose 301 of the file is pose 150 or 151.
    let span = &value["logs"][0]["pose_spans"][0];
    let worst = span["worst_pose"].as_u64().expect("a span of poses");
    assert!((148..=153).contains(&worst), "{span}");
}
