//! The snippets of docs/CI.md, taken from the page and run in a git repository: exit codes and JUnit files as it says.

mod common;

use common::{dose3, expect_code, write_logs};
use dose3_datasets::faults::Fault;
use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const PAGE: &str = include_str!("../docs/CI.md");

/// The code blocks of the page in that language.
fn blocks(language: &str) -> Vec<&'static str> {
    let open = format!("```{language}\n");
    let behind = PAGE.split(open.as_str()).skip(1);
    behind
        .map(|rest| rest.split("```").next().expect("closed"))
        .collect()
}

/// The shell lines of a job: what stands behind `run:` at GitHub, the items of `script:` at GitLab. The installation is
/// left out, the program is there.
fn script(block: &str) -> String {
    let indent = |line: &str| line.len() - line.trim_start().len();
    let (mut lines, mut inside) = (Vec::new(), None);
    for line in block.lines() {
        if inside.is_some_and(|outer| indent(line) <= outer) {
            inside = None;
        }
        let text = line.trim();
        match text.strip_prefix("run:") {
            Some(command) if command.trim() == "|" => inside = Some(indent(line)),
            Some(command) => lines.push(command.trim()),
            None if text == "script:" => inside = Some(indent(line)),
            None if inside.is_some() => lines.push(text.trim_start_matches("- ")),
            None => {}
        }
    }
    lines.retain(|line| !line.starts_with("cargo install"));
    lines.join("\n")
}

/// A shell in `folder` that finds the program as `dose3`.
fn shell(folder: &Path, script: &str) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_dose3"));
    let own = program.parent().expect("a folder").to_path_buf();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths([own].into_iter().chain(std::env::split_paths(&path)));
    Command::new("sh")
        .args(["-e", "-c", script])
        .current_dir(folder)
        .env("PATH", path.expect("no separator in a path"))
        .env_remove("COLUMNS")
        .output()
        .expect("a shell")
}

fn write_tum(path: &Path, log: &dose3_datasets::Trajectory) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
    write::tum(&mut std::fs::File::create(path).expect("a file"), log).expect("written");
}

/// A repository with a detector, recordings and a pipeline that "estimates" by copying what the recordings folder holds.
fn repository(folder: &Path) -> PathBuf {
    let repository = folder.join("repository");
    std::fs::create_dir_all(&repository).expect("made");
    write_logs(&folder.join("good"), Platform::Vehicle, 8, 700);
    let detector = repository.join("trusted.dose3").display().to_string();
    let good = folder.join("good").display().to_string();
    expect_code(&dose3(["fit", "--trusted", &good, "--out", &detector]), 0);
    for seed in [40, 41, 42] {
        let log = trajectory(Platform::Vehicle, seed, 700, 20.0);
        write_tum(
            &repository.join(format!("recordings/drive{seed}.txt")),
            &log,
        );
    }
    std::fs::write(
        repository.join("slam.sh"),
        "#!/bin/sh\nmkdir -p \"$2\"\ncp \"$1\"/* \"$2\"\n",
    )
    .expect("written");
    let made = shell(
        &repository,
        "chmod +x slam.sh\ngit init -q\ngit config user.email a@example.org\ngit config user.name a\n\
         git add .\ngit commit -qm good",
    );
    expect_code(&made, 0);
    repository
}

/// A clone with what `change` makes of the recordings, the job run in it: its output, and (tests, failures, errors) with
/// the names of the failures as the JUnit file has them.
fn job(
    repository: &Path,
    script: &str,
    change: impl Fn(&Path),
) -> (Output, [String; 3], Vec<String>) {
    let folder = tempfile::tempdir().expect("a folder");
    let clone = format!("git clone -q {} clone", repository.display());
    expect_code(&shell(folder.path(), &clone), 0);
    let clone = folder.path().join("clone");
    change(&clone.join("recordings"));
    let output = shell(&clone, script);
    let text = std::fs::read_to_string(clone.join("dose3.xml")).expect("a JUnit file");
    let document = roxmltree::Document::parse(&text).expect("XML");
    let suite = document
        .descendants()
        .find(|node| node.has_tag_name("testsuite"))
        .expect("a suite");
    let counts =
        ["tests", "failures", "errors"].map(|name| suite.attribute(name).expect(name).to_owned());
    let failed = document
        .descendants()
        .filter(|node| node.has_tag_name("failure") || node.has_tag_name("error"))
        .map(|node| {
            node.parent_element()
                .and_then(|test| test.attribute("name"))
                .expect("a name")
                .to_owned()
        });
    (output, counts, failed.collect())
}

#[test]
fn the_snippets_of_the_page_stop_a_pipeline_that_broke() {
    let folder = tempfile::tempdir().expect("a folder");
    let repository = repository(folder.path());
    let jobs: Vec<&str> = blocks("yaml")
        .into_iter()
        .filter(|block| block.contains("slam.sh"))
        .collect();
    assert_eq!(jobs.len(), 2, "one of GitHub, one of GitLab");
    let freeze = |recordings: &Path| {
        let sound = trajectory(Platform::Vehicle, 42, 700, 20.0);
        let frozen = Fault::Freeze { seconds: 4.0 }
            .apply(&sound, 300..380, 1)
            .expect("frozen");
        write_tum(&recordings.join("drive42.txt"), &frozen);
    };
    for block in jobs {
        let script = script(block);
        assert!(script.contains("dose3 score"), "{script}");
        let (run, counts, failed) = job(&repository, &script, |_| ());
        expect_code(&run, 0);
        assert_eq!(
            (counts, failed.len()),
            (["3", "0", "0"].map(String::from), 0)
        );

        let (run, counts, failed) = job(&repository, &script, freeze);
        expect_code(&run, 1);
        assert_eq!(
            (counts, failed),
            (
                ["3", "1", "0"].map(String::from),
                vec!["drive42".to_owned()]
            )
        );

        // A log that cannot be read does not hide the one that is out of distribution.
        let (run, counts, failed) = job(&repository, &script, |recordings| {
            freeze(recordings);
            std::fs::write(recordings.join("drive40.txt"), "1.0 2.0\n").expect("written");
        });
        expect_code(&run, 2);
        assert_eq!(counts, ["3", "1", "1"].map(String::from));
        assert_eq!(failed.len(), 2, "{failed:?}");
    }
}

#[test]
fn the_lines_for_other_runners_run_as_they_stand() {
    let folder = tempfile::tempdir().expect("a folder");
    let repository = repository(folder.path());
    let find = blocks("sh")
        .into_iter()
        .find(|block| block.contains("find "))
        .expect("the line with find");
    let prepare = "mkdir estimates\nfor f in recordings/*.txt; do cp $f estimates/$(basename $f .txt).tum; done\n";
    let run = shell(&repository, &format!("{prepare}{find}"));
    expect_code(&run, 0);
    let table = std::fs::read_to_string(repository.join("dose3.csv")).expect("a table");
    let names: Vec<&str> = table
        .lines()
        .map(|line| line.split(',').next().expect("a cell"))
        .collect();
    assert_eq!(names, ["log", "drive40", "drive41", "drive42"]);
}
