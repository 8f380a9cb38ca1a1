//! `fetch-data robotcar|iros20`: what a folder holds, and what the command line says of it.

// A test that did not run says so.
#![allow(clippy::print_stderr)]

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use dose3_datasets::synthetic::{self, Platform};
use dose3_datasets::write;
use xtask::fetch::check::{self, TRAJECTORIES, TRAVERSALS, VIDEOS};

const POSES: usize = 60;

/// Writes a RobotCar log of 60 poses at 20 Hz and returns its file.
fn put_traversal(root: &Path, folder: &str, seed: u64) -> PathBuf {
    let gps = root.join(folder).join("gps");
    fs::create_dir_all(&gps).unwrap();
    let file = gps.join("ins.csv");
    let drive = synthetic::trajectory(Platform::Vehicle, seed, POSES, 20.0);
    write::robotcar_ins(&mut File::create(&file).unwrap(), &drive).unwrap();
    file
}

fn put_stream(root: &Path, number: u32) -> PathBuf {
    let file = root.join(format!("traj_{number}.npy"));
    let motion = synthetic::trajectory(Platform::Handheld, number.into(), POSES, 30.0);
    let mut sink = File::create(&file).unwrap();
    write::iros20(&mut sink, &motion, write::Precision::Single).unwrap();
    file
}

fn put_video(root: &Path, name: &str) {
    let folder = root.join(name).join("annotated_poses");
    fs::create_dir_all(&folder).unwrap();
    let motion = synthetic::trajectory(Platform::Handheld, 1, 8, 30.0);
    write::iros20_poses(&folder, &motion).unwrap();
}

#[test]
fn four_traversals_are_complete() {
    let root = tempfile::tempdir().unwrap();
    for (seed, name) in (1..).zip(TRAVERSALS) {
        let long = format!("{name}-radar-oxford-10k");
        put_traversal(root.path(), if seed == 1 { &long } else { name }, seed);
    }
    let report = check::robotcar(root.path()).unwrap();
    assert!(report.is_complete(), "{report}");
    assert!(
        report
            .logs
            .iter()
            .all(|log| log.poses == POSES && log.rate == "20.00 Hz"),
        "{report}"
    );
    assert!(
        report.to_string().ends_with("4 log(s) load, 240 poses\n"),
        "{report}"
    );
}

#[test]
fn missing_and_broken_traversals_are_named() {
    let root = tempfile::tempdir().unwrap();
    put_traversal(root.path(), TRAVERSALS[0], 1);
    let broken = put_traversal(root.path(), TRAVERSALS[2], 2);
    fs::write(&broken, "this is no csv of poses\n").unwrap();
    let cut = put_traversal(root.path(), TRAVERSALS[3], 3);
    let text = fs::read_to_string(&cut).unwrap();
    fs::write(&cut, text.replacen(",0.", ",nan", 1)).unwrap();
    // Another file of the same data set is no INS log.
    fs::write(
        root.path().join(TRAVERSALS[0]).join("gps/gps.csv"),
        "timestamp\n1\n",
    )
    .unwrap();

    let report = check::robotcar(root.path()).unwrap();
    assert_eq!(report.missing, [TRAVERSALS[1]]);
    assert_eq!(report.logs.len(), 1);
    let failed: Vec<&PathBuf> = report.failed.iter().map(|(path, _)| path).collect();
    assert_eq!(failed, [&broken, &cut]);
    assert!(!report.is_complete());
}

#[test]
fn the_folder_of_one_traversal_counts_for_it() {
    let root = tempfile::tempdir().unwrap();
    put_traversal(root.path(), TRAVERSALS[0], 1);
    let report = check::robotcar(&root.path().join(TRAVERSALS[0]).join("gps")).unwrap();
    assert_eq!(report.logs.len(), 1);
    assert_eq!(report.missing, TRAVERSALS[1..]);
}

#[test]
fn streams_are_counted_against_the_42() {
    let root = tempfile::tempdir().unwrap();
    put_stream(root.path(), 3);
    put_stream(root.path(), 54);
    let broken = root.path().join("traj_4.npy");
    fs::write(&broken, "version https://git-lfs.github.com/spec/v1\n").unwrap();
    let report = check::iros20(root.path()).unwrap();
    assert_eq!(report.logs.len(), 2);
    assert_eq!(report.failed.len(), 1);
    assert_eq!(report.failed[0].0, broken);
    assert_eq!(report.missing.len(), 39);
    assert!(!report.missing.iter().any(|name| name == "traj_4.npy"));

    TRAJECTORIES
        .iter()
        .for_each(|number| drop(put_stream(root.path(), *number)));
    let report = check::iros20(root.path()).unwrap();
    assert!(report.is_complete(), "{report}");
    assert_eq!(report.logs.len(), 42);
}

#[test]
fn nine_videos_are_complete() {
    let root = tempfile::tempdir().unwrap();
    VIDEOS[1..]
        .iter()
        .for_each(|name| put_video(root.path(), name));
    assert_eq!(check::iros20(root.path()).unwrap().missing, [VIDEOS[0]]);
    put_video(root.path(), VIDEOS[0]);
    let report = check::iros20(root.path()).unwrap();
    assert!(report.is_complete(), "{report}");
    assert_eq!(report.logs.iter().map(|log| log.poses).sum::<usize>(), 72);
}

#[test]
fn empty_folder_misses_everything_and_a_file_is_none() {
    let root = tempfile::tempdir().unwrap();
    assert_eq!(check::robotcar(root.path()).unwrap().missing, TRAVERSALS);
    assert_eq!(check::iros20(root.path()).unwrap().missing, VIDEOS);
    let file = put_stream(root.path(), 3);
    assert!(
        check::iros20(&file)
            .unwrap_err()
            .to_string()
            .contains("no folder")
    );
}

#[test]
fn real_logs_are_complete() {
    let Some(data) = std::env::var_os("DOSE3_DATA").map(PathBuf::from) else {
        eprintln!("not run: DOSE3_DATA is not set");
        return;
    };
    // The folder of all data sets is accepted as well as that of one.
    let report = check::robotcar(&data).unwrap();
    assert!(report.is_complete(), "{report}");
    assert_eq!(report.logs.len(), 4);
    let report = check::iros20(&data.join("iros20")).unwrap();
    assert!(report.is_complete(), "{report}");
    assert_eq!(
        report.logs.iter().map(|log| log.poses).sum::<usize>(),
        73_756
    );
}

fn fetch_data(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_xtask"))
        .arg("fetch-data")
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn guide_tells_where_under_which_terms_and_how_to_lay_it_out() {
    let words: [(&str, &[&str]); 2] = [
        (
            "robotcar",
            &[
                "robotcar-dataset.robots.ox.ac.uk",
                "CC BY-NC-SA 4.0",
                "Maddern",
                "Barnes",
            ],
        ),
        (
            "iros20",
            &["iros20-6d-pose-tracking", "annotated_poses", "Wen", "traj_"],
        ),
    ];
    for (name, words) in words {
        let output = fetch_data(&[name]);
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(0));
        for word in words {
            assert!(text.contains(word), "no `{word}` in: {text}");
        }
        let layout = format!("data/{name}/");
        assert!(text.contains(&layout), "{text}");
        assert!(
            text.contains(&format!("fetch-data {name} --check data/{name}\n")),
            "{text}"
        );
    }
    let text = String::from_utf8(fetch_data(&["robotcar"]).stdout).unwrap();
    for name in TRAVERSALS {
        assert!(
            text.contains(&format!("data/robotcar/{name}/gps/ins.csv")),
            "{text}"
        );
    }
}

#[test]
fn check_ends_with_one_until_the_folder_is_complete() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().to_str().unwrap();
    for (seed, name) in (1..).zip(TRAVERSALS) {
        let output = fetch_data(&["robotcar", "--check", folder]);
        assert_eq!(output.status.code(), Some(1));
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.contains(&format!("missing   {name}\n")), "{text}");
        put_traversal(root.path(), name, seed);
    }
    let output = fetch_data(&["robotcar", "--check", folder]);
    assert_eq!(output.status.code(), Some(0));
    assert!(
        String::from_utf8(output.stdout)
            .unwrap()
            .contains("240 poses")
    );
    let last = root.path().join(TRAVERSALS[3]).join("gps/ins.csv");
    fs::write(last, "this is no csv of poses\n").unwrap();
    let output = fetch_data(&["robotcar", "--check", folder]);
    assert_eq!(output.status.code(), Some(1));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(
        message.contains("0 log(s) missing, 1 that do not load"),
        "{message}"
    );
    let nowhere = root.path().join("nowhere");
    let output = fetch_data(&["iros20", "--check", nowhere.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        String::from_utf8(output.stderr)
            .unwrap()
            .contains("nowhere")
    );
}
