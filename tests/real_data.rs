//! The program on real logs: runs where `$DOSE3_DATA` names a folder with `kitti/poses` and
//! `iros20`, and says so where it does not.

// A test that was not run says so.
#![allow(clippy::print_stderr)]

mod common;

use common::{dose3, expect_code, stdout};
use std::path::PathBuf;

fn data() -> Option<PathBuf> {
    let root = std::env::var_os("DOSE3_DATA").map(PathBuf::from)?;
    (root.join("kitti/poses/00.txt").exists() && root.join("iros20").exists()).then_some(root)
}

/// What README shows of a score.
fn in_readme(log: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../README.md");
    let text = std::fs::read_to_string(path).expect("README");
    let command = format!("$ dose3 score --detector kitti.dose3 {log}; echo \"exit $?\"");
    let shown = text.lines().skip_while(|line| *line != command).skip(1);
    let lines = shown.take_while(|line| !line.starts_with("exit "));
    lines.map(|line| format!("{line}\n")).collect()
}

/// Fitted on KITTI 00-06 and 08-10 with the built-in model: the unseen 07 is accepted, an IROS20
/// object is rejected, random bytes are an error.
#[test]
fn kitti_07_is_accepted_iros20_rejected_random_bytes_refused() {
    let Some(root) = data() else {
        eprintln!("not run: real data is needed, $DOSE3_DATA names its folder");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let detector = folder.path().join("kitti.dose3").display().to_string();
    let mut fit: Vec<String> = ["fit", "--out", &detector, "--trusted"]
        .map(String::from)
        .to_vec();
    let logs = ["00", "01", "02", "03", "04", "05", "06", "08", "09", "10"];
    fit.extend(logs.map(|n| {
        root.join(format!("kitti/poses/{n}.txt"))
            .display()
            .to_string()
    }));
    expect_code(&dose3(&fit), 0);

    let score = |path: PathBuf| {
        dose3([
            "score",
            "--detector",
            &detector,
            &path.display().to_string(),
        ])
    };
    // With at most ten trusted logs ranks cannot reach 0.05, and the output says what the chance rests on: what README shows.
    let log = std::fs::read_to_string(root.join("kitti/poses/07.txt")).expect("a log");
    let mut lines: Vec<&str> = log.lines().collect();
    let stuck = lines[500];
    lines[500..520].fill(stuck);
    let frozen = folder.path().join("07_frozen.txt");
    std::fs::write(&frozen, lines.join("\n") + "\n").expect("written");
    for (path, code) in [
        (root.join("kitti/poses/07.txt"), 0),
        (frozen, 1),
        (root.join("iros20/traj_3.npy"), 1),
    ] {
        let name = path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let judged = score(path);
        expect_code(&judged, code);
        assert_eq!(
            stdout(&judged),
            in_readme(&name),
            "README shows another output for {name}"
        );
    }
    let noise = folder.path().join("noise");
    let bytes: Vec<u8> = (0..10_000_u32)
        .map(|i| (i.wrapping_mul(2_654_435_761) >> 11) as u8)
        .collect();
    std::fs::write(&noise, bytes).expect("written");
    expect_code(&score(noise), 2);
}
