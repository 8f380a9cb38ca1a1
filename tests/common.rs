//! Shared by the end-to-end tests: the program, and logs for it.

#![allow(dead_code)]

use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Runs `dose3` with `args`.
pub fn dose3<S: AsRef<std::ffi::OsStr>>(args: impl IntoIterator<Item = S>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dose3"))
        .args(args)
        .output()
        .expect("the program starts")
}

/// Standard output as text.
pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

/// Standard error as text.
pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

/// The exit code, with everything that was printed where it is not `expected`.
pub fn expect_code(output: &Output, expected: i32) {
    assert_eq!(
        output.status.code(),
        Some(expected),
        "stdout:\n{}\nstderr:\n{}",
        stdout(output),
        stderr(output)
    );
}

/// Writes `logs` synthetic logs of `platform` as TUM files into `folder`.
pub fn write_logs(folder: &Path, platform: Platform, logs: u64, poses: usize) -> Vec<PathBuf> {
    std::fs::create_dir_all(folder).expect("a folder");
    (0..logs)
        .map(|seed| {
            let t = trajectory(platform, seed, poses, 20.0);
            let path = folder.join(format!("{}_{seed}.txt", platform.name()));
            let mut file = std::fs::File::create(&path).expect("a file");
            write::tum(&mut file, &t).expect("written");
            path
        })
        .collect()
}

/// Trains a tiny model on vehicle logs in `folder`; answers its path.
pub fn tiny_model(folder: &Path, extra: &[&str]) -> PathBuf {
    let data = folder.join("train");
    if !data.exists() {
        write_logs(&data, Platform::Vehicle, 4, 400);
    }
    let out = folder.join(format!(
        "model{}.dose3",
        extra.join("_").replace(['-', '/', '.'], "")
    ));
    let mut args = vec![
        "train".to_string(),
        "--data".into(),
        data.display().to_string(),
        "--out".into(),
        out.display().to_string(),
    ];
    let settings =
        "--width 8 --multipliers 1,2 --window 64 --steps 20 --batch 8 --diffusion-steps 12";
    args.extend(settings.split(' ').map(String::from));
    args.extend(extra.iter().map(|s| (*s).to_string()));
    expect_code(&dose3(&args), 0);
    out
}
