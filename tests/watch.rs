//! `dose3 watch` in a pipe.

mod common;

use common::{dose3, expect_code, stdout, write_logs};
use dose3::{Detector, FitOptions, Trajectory};
use dose3_datasets::faults::Fault;
use dose3_datasets::synthetic::{Platform, suite, trajectory};
use dose3_datasets::{LoadOptions, RemarkKind, load_bytes, write};
use serde_json::Value;
use std::fs::OpenOptions;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

fn detector(folder: &Path) -> PathBuf {
    let options = FitOptions {
        statistics: Some("kinematic,differences".parse().unwrap()),
        density: "mixture:2".parse().unwrap(),
        ..FitOptions::default()
    };
    let trusted = suite(Platform::Vehicle, 5, 1);
    let detector = Detector::builder().options(options).fit(&trusted).unwrap();
    let path = folder.join("detector.dose3");
    detector.save(&path).unwrap();
    path
}

fn start(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_dose3"))
        .arg("watch")
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn tum(log: &Trajectory) -> Vec<u8> {
    let mut text = Vec::new();
    write::tum(&mut text, log).unwrap();
    text
}

/// The lines and the exit code.
fn piped(arguments: &[&str], input: &[u8]) -> (Vec<Value>, Option<i32>) {
    let mut child = start(arguments);
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    let writer = std::thread::spawn(move || {
        let _ = stdin.write_all(&input);
    });
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    (lines(&output.stdout), output.status.code())
}

fn lines(text: &[u8]) -> Vec<Value> {
    let text = String::from_utf8(text.to_vec()).unwrap();
    let line = |line: &str| serde_json::from_str(line).unwrap();
    text.lines().map(line).collect()
}

fn of<'v>(lines: &'v [Value], kind: &str) -> Vec<&'v Value> {
    lines.iter().filter(|line| line["kind"] == kind).collect()
}

fn faulty() -> Trajectory {
    let sound = trajectory(Platform::Vehicle, 28, 1600, 20.0);
    let fault = Fault::JitterPosition { metres: 0.3 };
    fault.apply(&sound, 700..1000, 5).unwrap()
}

#[test]
fn an_alarm_comes_through_a_pipe_and_the_exit_code_is_how_it_ends() {
    let folder = tempfile::tempdir().unwrap();
    let detector = detector(folder.path());
    let detector = detector.to_str().unwrap();
    let log = faulty();
    let common = ["--detector", detector, "--heartbeat", "0"];
    let (lines, code) = piped(&common, &tum(&log));
    let alarms: Vec<&Value> = of(&lines, "alarm");
    assert_eq!(alarms.len(), 2, "{lines:?}");
    assert_eq!(
        (&alarms[0]["alarm"], &alarms[1]["alarm"]),
        (&"raised".into(), &"ended".into())
    );
    assert_eq!(code, Some(0));
    let end = lines.last().unwrap();
    assert_eq!(
        (&end["kind"], &end["state"]),
        (&"end".into(), &"sound".into())
    );
    assert_eq!(end["reason"], "end of input");
    assert_eq!(end["poses"], 1600);

    // The same as JSON lines, with every window, up to the fault only: the alarm stands.
    let mut json = String::new();
    for (stamp, pose) in log.stamps.iter().zip(&log.poses).take(900) {
        let q = dose3::nalgebra::UnitQuaternion::from_rotation_matrix(&pose.rotation);
        let (p, q) = (pose.translation, q.coords);
        let line = serde_json::json!({
            "stamp_ns": stamp, "position": [p.x, p.y, p.z], "orientation": [q.x, q.y, q.z, q.w],
        });
        json.push_str(&line.to_string());
        json.push('\n');
    }
    json.push_str("nonsense\n");
    let arguments = [&common[..], &["--windows"]].concat();
    let (lines, code) = piped(&arguments, json.as_bytes());
    assert_eq!(code, Some(1));
    assert_eq!(of(&lines, "alarm").len(), 1);
    assert_eq!(of(&lines, "bad-line").len(), 1);
    let windows = of(&lines, "window").len() as u64;
    assert_eq!(lines.last().unwrap()["windows"], windows);
    assert!(windows > 30);
    assert_eq!(lines.last().unwrap()["alarm"]["alarm"], "standing");
}

#[test]
fn too_few_poses_and_bad_settings_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let detector = detector(folder.path());
    let detector = detector.to_str().unwrap();
    let (lines, code) = piped(&["--detector", detector], b"1 0 0 0 0 0 0 1\n");
    assert_eq!(
        (code, &lines.last().unwrap()["state"]),
        (Some(2), &"waiting".into())
    );
    for (arguments, expected) in [
        (["--alarms-per-hour", "0"], "--alarms-per-hour"),
        (["--every", "5"], "--every"),
        (["--heartbeat", "nan"], "--heartbeat"),
        (["--follow", "/no/such/file"], "/no/such/file"),
    ] {
        let output = dose3([&["watch", "--detector", detector][..], &arguments].concat());
        expect_code(&output, 2);
        assert!(
            common::stderr(&output).contains(expected),
            "{}",
            common::stderr(&output)
        );
    }
}

#[test]
fn a_log_that_is_played_says_what_score_says() {
    let folder = tempfile::tempdir().unwrap();
    let detector = detector(folder.path());
    let log = write_logs(folder.path(), Platform::Vehicle, 1, 600).remove(0);
    let (detector, log) = (detector.to_str().unwrap(), log.to_str().unwrap());
    let arguments = [
        "--detector",
        detector,
        "--realtime",
        log,
        "--speed",
        "1000",
        "--windows",
    ];
    let watched = dose3([&["watch"][..], &arguments].concat());
    expect_code(&watched, 0);
    let live = lines(stdout(&watched).as_bytes());
    let live: Vec<&Value> = live.iter().filter(|l| l["in_verdict"] == true).collect();
    let scored = dose3([
        "score",
        "--detector",
        detector,
        "--json",
        "--frame",
        "body-flu",
        log,
    ]);
    let scored: Value = serde_json::from_str(&stdout(&scored)).unwrap();
    let offline = scored["logs"][0]["windows"].as_array().unwrap();
    assert_eq!(live.len(), offline.len());
    for (live, offline) in live.iter().zip(offline) {
        assert_eq!(live["score"], offline["score"]);
        assert_eq!(live["p_value"], offline["p_value"]);
        assert_eq!(live["last_stamp_ns"], offline["last_stamp_ns"]);
    }
}

/// Sends a signal that a program may answer.
#[cfg(unix)]
fn terminate(child: &Child) {
    let id = child.id().to_string();
    let status = Command::new("kill").args(["-TERM", &id]).status().unwrap();
    assert!(status.success());
}

/// Waits for a line of that kind.
fn wait_for(out: &mut impl BufRead, kind: &str) -> Value {
    let mut line = String::new();
    loop {
        line.clear();
        assert!(
            out.read_line(&mut line).unwrap() > 0,
            "no line of kind {kind}"
        );
        let value: Value = serde_json::from_str(&line).unwrap();
        if value["kind"] == kind {
            return value;
        }
    }
}

#[cfg(unix)]
#[test]
fn a_file_that_grows_is_followed_until_a_signal_and_the_state_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let detector = detector(folder.path());
    let (grows, state) = (
        folder.path().join("grows.txt"),
        folder.path().join("state.json"),
    );
    let log = faulty();
    let text = tum(&log);
    let lines_of: Vec<&[u8]> = text.split_inclusive(|b| *b == b'\n').collect();
    // A comment comes first.
    // A comment comes first.
    let half = lines_of[..820].concat();
    std::fs::write(&grows, &half[..half.len() - 5]).unwrap();
    let arguments = [
        "--detector",
        detector.to_str().unwrap(),
        "--follow",
        grows.to_str().unwrap(),
        "--state",
        state.to_str().unwrap(),
        "--heartbeat",
        "0.2",
    ];
    let mut child = start(&arguments);
    let mut out = BufReader::new(child.stdout.take().unwrap());
    let raised = wait_for(&mut out, "alarm");
    assert_eq!(raised["alarm"], "raised");
    // The rest of a line, then a sign of life that has seen it.
    let mut file = OpenOptions::new().append(true).open(&grows).unwrap();
    file.write_all(&half[half.len() - 5..]).unwrap();
    file.flush().unwrap();
    while wait_for(&mut out, "heartbeat")["poses"] != 819 {}
    terminate(&child);
    let mut rest = Vec::new();
    out.read_to_end(&mut rest).unwrap();
    let end = lines(&rest).pop().unwrap();
    assert_eq!(
        (&end["kind"], &end["reason"]),
        (&"end".into(), &"terminated".into())
    );
    assert_eq!(child.wait().unwrap().code(), Some(1));

    // What is piped in now goes on from there: the alarm ends.
    let rest = lines_of[820..].concat();
    let arguments = [
        "--detector",
        detector.to_str().unwrap(),
        "--state",
        state.to_str().unwrap(),
    ];
    let (lines, code) = piped(&arguments, &rest);
    let alarms = of(&lines, "alarm");
    assert_eq!((alarms.len(), &alarms[0]["alarm"]), (1, &"ended".into()));
    assert_eq!(alarms[0]["raised_ns"], raised["raised_ns"]);
    assert_eq!(
        (code, &lines.last().unwrap()["poses"]),
        (Some(0), &1600.into())
    );
}

#[test]
fn a_slow_reader_loses_nothing_and_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let detector = detector(folder.path());
    // More windows than a pipe holds.
    let log = trajectory(Platform::Vehicle, 30, 12_000, 10.0);
    let arguments = [
        "--detector",
        detector.to_str().unwrap(),
        "--windows",
        "--every",
        "1",
        "--heartbeat",
        "0",
    ];
    let mut child = start(&arguments);
    let mut stdin = child.stdin.take().unwrap();
    let input = tum(&log);
    let writer = std::thread::spawn(move || stdin.write_all(&input).unwrap());
    // Nobody reads for longer than a lag takes.
    std::thread::sleep(std::time::Duration::from_secs(3));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    let lines = lines(&output.stdout);
    assert_eq!(of(&lines, "window").len(), 12_000 - 128);
    let lags = of(&lines, "lag");
    assert!(!lags.is_empty());
    assert!(lags[0]["behind_s"].as_f64().unwrap() >= 1.0);
    assert!(lags[0]["waiting"].as_u64().unwrap() > 0);
}

#[test]
fn a_recording_is_whole_while_it_grows_and_after_a_sudden_end() {
    let folder = tempfile::tempdir().unwrap();
    let detector = detector(folder.path());
    let grows = folder.path().join("live.mcap");
    let log = faulty();
    let text = tum(&log);
    let lines_of: Vec<&[u8]> = text.split_inclusive(|b| *b == b'\n').collect();
    let arguments = [
        "--detector",
        detector.to_str().unwrap(),
        "--mcap",
        grows.to_str().unwrap(),
    ];
    let options = LoadOptions {
        topics: vec!["/dose3/pose".to_owned()],
        ..LoadOptions::default()
    };
    let read = |bytes: &[u8]| load_bytes("live.mcap", bytes, &options).unwrap();
    let is_damaged = |found: &Trajectory| {
        let mut remarks = found.report.remarks.iter();
        remarks.any(|remark| remark.kind == RemarkKind::DamagedRecording)
    };
    let same = |found: &Trajectory| {
        assert_eq!(found.stamps, log.stamps[..found.len()]);
        for (found, pose) in found.poses.iter().zip(&log.poses) {
            assert!((found.translation - pose.translation).norm() < 1e-6);
            assert!((found.rotation.matrix() - pose.rotation.matrix()).norm() < 1e-6);
        }
    };
    let mut child = start(&arguments);
    let mut out = BufReader::new(child.stdout.take().unwrap());
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(&lines_of[..1000].concat()).unwrap();
    // The alarm is in the file before it is told.
    wait_for(&mut out, "alarm");
    let open = read(&std::fs::read(&grows).unwrap());
    assert!(open.len() > 600);
    same(&open);
    child.kill().unwrap();
    child.wait().unwrap();
    let bytes = std::fs::read(&grows).unwrap();
    let whole = read(&bytes);
    assert!(!is_damaged(&whole), "{:?}", whole.report);
    same(&whole);
    // Without its index it is read as far as its chunks go.
    let cut = read(&bytes[..bytes.len() - 100]);
    assert_eq!(cut.stamps, whole.stamps);

    // A recording of an earlier run is replaced, another file is not.
    let (lines, code) = piped(&arguments, &text);
    assert_eq!(code, Some(0), "{lines:?}");
    let whole = read(&std::fs::read(&grows).unwrap());
    assert_eq!(whole.len(), log.len());
    std::fs::write(&grows, "mine").unwrap();
    let (_, code) = piped(&arguments, &text);
    assert_eq!(code, Some(2));
    assert_eq!(std::fs::read(&grows).unwrap(), b"mine");
}
