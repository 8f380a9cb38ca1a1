//! The examples run, and say what they are to say.

use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Standard output of the example, which cargo builds beside the tests.
fn run(name: &str, args: &[&Path]) -> String {
    let test = std::env::current_exe().expect("this test is a file");
    let folder = test.ancestors().nth(2).expect("target/PROFILE/deps");
    let example = folder
        .join("examples")
        .join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    let run = Command::new(&example).args(args).output();
    let run = run.unwrap_or_else(|e| panic!("{}: {e}", example.display()));
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(run.status.success(), "{name}: {}", text(&run.stderr));
    text(&run.stdout)
}

/// Synthetic drives at 10 Hz as TUM files.
fn logs(folder: &Path, seeds: std::ops::Range<u64>) -> PathBuf {
    std::fs::create_dir_all(folder).expect("a folder");
    for seed in seeds {
        let path = folder.join(format!("drive_{seed}.txt"));
        let log = trajectory(Platform::Vehicle, seed, 500, 10.0);
        write::tum(&mut std::fs::File::create(path).expect("a file"), &log).expect("written");
    }
    folder.to_path_buf()
}

#[test]
fn poses_in_memory_are_judged() {
    let said = run("judge_poses", &[]);
    let verdicts: Vec<&str> = said
        .lines()
        .filter(|l| l.contains("DISTRIBUTION") || l.contains("in distribution"))
        .collect();
    assert_eq!(verdicts.len(), 2, "{said}");
    assert!(
        verdicts[0].starts_with("sound") && verdicts[0].ends_with("in distribution"),
        "{said}"
    );
    let worst = said
        .lines()
        .find_map(|l| l.strip_prefix("the pose that sticks out most: "));
    let worst: usize = worst.expect("a pose").parse().expect("a number");
    assert!((298..=302).contains(&worst), "{said}");
}

#[test]
fn files_are_judged_detectors_kept_and_models_trained() {
    let folder = tempfile::tempdir().expect("a folder");
    let trusted = logs(&folder.path().join("trusted"), 0..4);
    let other = logs(&folder.path().join("other"), 7..8);
    let said = run("judge_file", &[&trusted, &other.join("drive_7.txt")]);
    assert!(said.contains("drive_7"), "{said}");
    let said = run("fit_folders", &[&folder.path().join("d.dose3"), &trusted]);
    assert!(said.contains("of 4 logs"), "{said}");
    let said = run("train_model", &[&folder.path().join("m.dose3"), &trusted]);
    assert!(
        said.contains("trained 10 steps") && said.contains("drive_0"),
        "{said}"
    );
}
