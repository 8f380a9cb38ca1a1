//! What the program says of bad input: exit code 2, what was found, what was expected, a hint.

mod common;

use common::{dose3, expect_code, stderr, stdout, tiny_model, write_logs};
use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::write;
use std::path::Path;

fn text(path: &Path) -> String {
    path.display().to_string()
}

/// A detector of the tiny model in `folder`, and one of its trusted logs.
fn detector(folder: &Path) -> (String, String) {
    let model = tiny_model(folder, &[]);
    let out = text(&folder.join("d.dose3"));
    let data = folder.join("train");
    let run = dose3([
        "fit",
        "--model",
        &text(&model),
        "--trusted",
        &text(&data),
        "--out",
        &out,
        "--density",
        "mixture:2",
    ]);
    expect_code(&run, 0);
    (out, text(&data.join("vehicle_0.txt")))
}

fn refused<const N: usize>(args: [&str; N], parts: &[&str]) {
    let run = dose3(args);
    expect_code(&run, 2);
    assert!(
        stdout(&run).is_empty(),
        "nothing on standard output: {}",
        stdout(&run)
    );
    for part in parts {
        assert!(
            stderr(&run).contains(part),
            "{part:?} is missing in\n{}",
            stderr(&run)
        );
    }
}

#[test]
fn logs_that_cannot_be_judged_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let (detector, _) = detector(folder.path());
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        text(&path)
    };
    let noise: Vec<u8> = (0..4096_u32)
        .map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8)
        .collect();
    let random = file("random.bin", &noise);
    refused(["score", "--detector", &detector, &random], &["random.bin"]);
    let empty = file("empty.txt", b"");
    refused(["score", "--detector", &detector, &empty], &["empty.txt"]);
    let short = write_logs(&folder.path().join("short"), Platform::Vehicle, 1, 40).remove(0);
    refused(
        ["score", "--detector", &detector, &text(&short)],
        &["40 poses", "64"],
    );
    let nan = file(
        "nan.txt",
        "1 0 0 0 0 1 0 0 0 0 1 NaN\n".repeat(200).as_bytes(),
    );
    refused(
        ["score", "--detector", &detector, &nan],
        &["nan.txt", "200 rows without a pose"],
    );
    refused(
        ["score", "--detector", &detector, "--alpha", "2", &nan],
        &["--alpha 2"],
    );
    refused(["inspect", &random], &["random.bin"]);
}

#[test]
fn damaged_detectors_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, log) = detector(folder.path());
    let bytes = std::fs::read(&path).expect("bytes");
    let bad = text(&folder.path().join("bad.dose3"));
    let check = |bytes: &[u8], part: &str| {
        std::fs::write(&bad, bytes).expect("written");
        refused(["score", "--detector", &bad, &log], &["bad.dose3", part]);
    };
    check(&bytes[..bytes.len() / 2], "not a usable detector");
    check(b"", "not a usable detector");
    check(&bytes[8..], "not a usable detector");
    // A weight that is no number any more.
    let mut broken = bytes.clone();
    let n = broken.len();
    broken[n - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
    check(&broken, "not finite");
    // A version from the future.
    let find = |needle: &[u8]| bytes.windows(needle.len()).position(|w| w == needle);
    let needle = br#"dose3.detector":"{\"format_version\":4"#;
    let at = find(needle).expect("the version stands in the header") + needle.len() - 1;
    let mut future = bytes.clone();
    future[at] = b'9';
    check(&future, "this build reads 1 to 4");
    // A model is no detector.
    let model = text(&folder.path().join("model.dose3"));
    refused(["score", "--detector", &model, &log], &["dose3 fit"]);
    refused(
        ["score", "--detector", "nowhere.dose3", &log],
        &["nowhere.dose3"],
    );
}

#[test]
fn a_motion_model_refuses_what_does_not_fit_and_names_the_flag() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = tiny_model(
        folder.path(),
        &["--representation", "motion", "--frame", "body-flu"],
    );
    let data = text(&folder.path().join("train"));
    let out = text(&folder.path().join("motion.dose3"));
    let model = text(&model);
    let fit = |extra: &[&str]| {
        let mut args = vec!["fit", "--model", &model, "--trusted", &data, "--out", &out];
        args.extend(["--density", "mixture:2"]);
        args.extend(extra);
        dose3(args)
    };
    // Unknown axes are taken as they are among themselves, with a note.
    let unknown_axes = fit(&[]);
    expect_code(&unknown_axes, 0);
    assert!(
        stderr(&unknown_axes).contains("--frame"),
        "{}",
        stderr(&unknown_axes)
    );
    expect_code(&fit(&["--frame", "body-flu"]), 0);
    let same = text(&folder.path().join("train/vehicle_0.txt"));
    refused(
        ["score", "--detector", &out, &same],
        &["frame sensor, expected body-flu", "--frame"],
    );

    let log = |name: &str, hertz: f64, poses: usize| {
        let path = folder.path().join(name);
        let t = trajectory(Platform::Vehicle, 9, poses, hertz);
        write::tum(&mut std::fs::File::create(&path).expect("a file"), &t).expect("written");
        text(&path)
    };
    let slow = log("slow.txt", 5.0, 300);
    refused(
        ["score", "--detector", &out, "--frame", "body-flu", &slow],
        &["5.0000 Hz", "that of its stamps", "fit --resample 5"],
    );
    // A faster log is interpolated down, and the output says so.
    let fast = log("fast.txt", 100.0, 2000);
    let run = dose3(["score", "--detector", &out, "--frame", "body-flu", &fast]);
    assert!(matches!(run.status.code(), Some(0 | 1)), "{}", stderr(&run));
    assert!(
        stdout(&run).contains("interpolated from 100"),
        "{}",
        stdout(&run)
    );
    // A claim against the stamps is refused.
    refused(
        [
            "score",
            "--detector",
            &out,
            "--frame",
            "body-flu",
            "--nominal-rate",
            "20",
            &fast,
        ],
        &["has stamps", "--nominal-rate"],
    );
    // Millimetres where metres are expected.
    let run = dose3([
        "score",
        "--detector",
        &out,
        "--frame",
        "body-flu",
        "--unit",
        "1000",
        &fast,
    ]);
    expect_code(&run, 2);
    assert!(stderr(&run).contains("--unit"), "{}", stderr(&run));
}

/// A paper model counts poses, but kinematic statistics are metric: rate and axes must fit.
#[test]
fn metric_statistics_refuse_another_rate_and_other_axes() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = text(&tiny_model(folder.path(), &[]));
    let data = text(&folder.path().join("train"));
    let out = text(&folder.path().join("kinematic.dose3"));
    let fit = dose3([
        "fit",
        "--model",
        &model,
        "--trusted",
        &data,
        "--out",
        &out,
        "--statistics",
        "kinematic",
        "--density",
        "mixture:1",
    ]);
    expect_code(&fit, 0);
    let path = folder.path().join("slow.txt");
    let slow = trajectory(Platform::Vehicle, 9, 300, 5.0);
    write::tum(&mut std::fs::File::create(&path).expect("a file"), &slow).expect("written");
    refused(
        ["score", "--detector", &out, &text(&path)],
        &["5.0000 Hz", "20.0000 Hz are needed"],
    );
    let same = text(&folder.path().join("train/vehicle_0.txt"));
    refused(
        ["score", "--detector", &out, "--frame", "camera-rdf", &same],
        &["frame camera-rdf, expected sensor", "--frame"],
    );
    expect_code(&dose3(["score", "--detector", &out, &same]), 0);
}

#[test]
fn a_backend_that_is_not_built_in_says_how_to_get_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let (detector, log) = detector(folder.path());
    if cfg!(not(feature = "wgpu")) {
        refused(
            ["score", "--detector", &detector, &log, "--backend", "wgpu"],
            &["--features wgpu"],
        );
    }
}

#[test]
fn unwritable_output_is_told_before_the_work() {
    let folder = tempfile::tempdir().expect("a folder");
    let logs = folder.path().join("logs");
    write_logs(&logs, Platform::Vehicle, 1, 300);
    refused(
        [
            "fit",
            "--trusted",
            &text(&logs),
            "--out",
            &text(folder.path()),
        ],
        &["is a folder", "name of a file"],
    );
    // A file where a folder must be.
    let log = text(&logs.join("vehicle_0.txt"));
    let out = format!("{log}/detector.dose3");
    refused(
        ["fit", "--trusted", &log, "--out", &out],
        &["cannot create", "vehicle_0.txt"],
    );
}

#[test]
fn a_thread_count_beyond_reason_is_an_error() {
    refused(
        ["score", "--detector", "d", "l", "--threads", "9999"],
        &["--threads 9999", "at most 256"],
    );
}

#[test]
fn an_output_never_replaces_a_log_and_unsuitable_logs_are_left_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let logs = folder.path().join("logs");
    let paths = write_logs(&logs, Platform::Vehicle, 3, 600);
    let log = text(&paths[0]);
    let before = std::fs::read(&paths[0]).expect("read");
    refused(
        ["fit", "--trusted", &text(&logs), "--out", &log],
        &["no model or detector", "name another file"],
    );
    assert_eq!(std::fs::read(&paths[0]).expect("read"), before);
    // A log of 20 poses has no window.
    let short = logs.join("short.txt");
    let rows: Vec<String> = (0..20)
        .map(|i| format!("{}.5 {i} 0 0 0 0 0 1\n", i))
        .collect();
    std::fs::write(&short, rows.concat()).expect("written");
    let out = text(&folder.path().join("detector.dose3"));
    let logs = text(&logs);
    let run = dose3(["fit", "--trusted", &logs, "--out", &out]);
    expect_code(&run, 0);
    let said = stderr(&run);
    assert!(
        said.contains("short.txt") && said.contains("1 log left out"),
        "{said}"
    );
    refused(
        ["fit", "--trusted", &logs, "--out", &out, "--strict"],
        &["short"],
    );
}
