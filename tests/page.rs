//! What people look at: `dose3 demo`, `score --html`, `score --mcap`.
//!
//! Pages are tried in a real browser where there are node and a Chromium (`DOSE3_CHROMIUM`, else one on the path), and
//! recordings are read back where `DOSE3_PYTHON` (else python3) has the packages mcap and mcap-protobuf-support; else a
//! line says that they were not.

#![allow(clippy::print_stderr)] // says what was not run

mod common;

use common::{dose3, expect_code, stderr, stdout};
use dose3_datasets::faults::Fault;
use dose3_datasets::synthetic::{Platform, trajectory};
use dose3_datasets::write;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Largest page of a log of an hour, bytes.
const LARGEST: usize = 500_000;

/// The folder of one demo for all tests.
fn demo() -> &'static Path {
    static FOLDER: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, folder) = FOLDER.get_or_init(|| {
        let temporary = tempfile::tempdir().expect("a folder");
        let folder = temporary.path().join("demo");
        let run = dose3([OsStr::new("demo"), "--out".as_ref(), folder.as_ref()]);
        expect_code(&run, 0);
        assert!(
            stdout(&run).contains("OUT OF DISTRIBUTION"),
            "{}",
            stdout(&run)
        );
        assert!(
            stderr(&run).contains("$ dose3 fit --trusted"),
            "{}",
            stderr(&run)
        );
        (temporary, folder)
    });
    folder
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

#[test]
fn the_demo_leaves_two_pages_and_replaces_nothing_unasked() {
    let folder = demo();
    for (page, verdict) in [
        ("sound.html", "<title>sound: in distribution"),
        ("faulty.html", "<title>faulty: out of distribution"),
    ] {
        let html = read(&folder.join(page));
        assert!(html.contains(verdict), "{page}");
        assert!(
            html.contains("dose3 score --detector"),
            "{page} says how to repeat it"
        );
        assert!(html.len() < LARGEST, "{page}: {} bytes", html.len());
        // Nothing is fetched: the one address is that of SVG's namespace and the note of where uPlot is from.
        for attribute in ["src=", "@import", "url(http"] {
            assert!(!html.contains(attribute), "{page} has {attribute}");
        }
    }
    let again = dose3([OsStr::new("demo"), "--out".as_ref(), folder.as_ref()]);
    expect_code(&again, 2);
    assert!(stderr(&again).contains("--force"), "{}", stderr(&again));
}

#[test]
fn the_faulty_page_names_the_faults() {
    let html = read(&demo().join("faulty.html"));
    for (words, fault) in [
        ("sideways", "the slip"),
        ("position", "the frozen position"),
    ] {
        assert!(html.contains(words), "{fault} is not named");
    }
    assert!(html.contains("class=\"reasons\""));
}

#[test]
fn many_logs_get_a_list_and_names_are_text() {
    let (demo, folder) = (demo(), tempfile::tempdir().expect("a folder"));
    let at = |name: &str| folder.path().join(name);
    let odd = at("<script>alert('1')<b>.txt");
    fs::copy(demo.join("sound.txt"), &odd).expect("copied");
    fs::write(at("broken.txt"), "no <i>pose</i>\n").expect("written");
    let page = at("all logs.html");
    let run = dose3([
        OsStr::new("score"),
        "--detector".as_ref(),
        demo.join("drives.dose3").as_ref(),
        "--frame".as_ref(),
        "body-flu".as_ref(),
        odd.as_ref(),
        demo.join("faulty.txt").as_ref(),
        at("broken.txt").as_ref(),
        "--html".as_ref(),
        page.as_ref(),
    ]);
    expect_code(&run, 2);
    let list = read(&page);
    assert!(list.contains("1 of 2 logs is not like the trusted ones"));
    assert!(list.contains("href=\"all%20logs/faulty.html\""));
    assert!(list.contains("no &lt;i&gt;") || list.contains("broken.txt"));
    let pages: Vec<PathBuf> = fs::read_dir(at("all logs"))
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    assert_eq!(pages.len(), 2);
    for page in pages.iter().chain([&page]) {
        let html = read(page);
        assert!(
            !html.contains("<script>alert") && !html.contains("<i>"),
            "{}",
            page.display()
        );
    }
    in_a_browser(&[&page]);
    // A page is replaced, a log is not.
    let log = fs::read(&odd).expect("read");
    for (to, code) in [(page.as_os_str(), 1), (at("log.html").as_os_str(), 2)] {
        if code == 2 {
            fs::write(to, &log).expect("written");
        }
        let run = dose3([
            OsStr::new("score"),
            "--detector".as_ref(),
            demo.join("drives.dose3").as_ref(),
            "--frame".as_ref(),
            "body-flu".as_ref(),
            demo.join("faulty.txt").as_ref(),
            "--html".as_ref(),
            to,
        ]);
        expect_code(&run, code);
    }
    assert_eq!(fs::read(at("log.html")).expect("read"), log);
}

#[test]
fn pages_work_in_a_browser() {
    in_a_browser(&[&demo().join("sound.html"), &demo().join("faulty.html")]);
}

#[test]
fn the_page_of_an_hour_is_small_and_the_same_every_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let mut log = trajectory(Platform::Vehicle, 77, 72_000, 20.0);
    for (fault, start) in [
        ("freeze:1.5s", 9000),
        ("slip:1.0m/s", 31_000),
        ("jitter-rotation:1.0deg", 50_000),
    ] {
        let fault: Fault = fault.parse().expect("a fault");
        log = fault
            .inject(&log, start..start + 400, 1)
            .expect("injected")
            .trajectory;
    }
    let mut file = fs::File::create(at("hour.txt")).expect("a file");
    write::tum(&mut file, &log).expect("written");
    let pages = ["1", "2"].map(|threads| {
        let page = at("hour.html");
        let run = dose3([
            OsStr::new("score"),
            "--detector".as_ref(),
            demo().join("drives.dose3").as_ref(),
            "--frame".as_ref(),
            "body-flu".as_ref(),
            at("hour.txt").as_ref(),
            "--html".as_ref(),
            page.as_ref(),
            "--threads".as_ref(),
            threads.as_ref(),
        ]);
        expect_code(&run, 1);
        read(&page).replace(&format!("--threads {threads}"), "")
    });
    eprintln!("the page of an hour has {} bytes", pages[0].len());
    assert!(pages[0].len() < LARGEST, "{} bytes", pages[0].len());
    assert!(pages[0] == pages[1], "pages differ");
    in_a_browser(&[&at("hour.html")]);
}

#[test]
fn recordings_are_read_back() {
    let (demo, folder) = (demo(), tempfile::tempdir().expect("a folder"));
    let recording = folder.path().join("faulty.mcap");
    let log = demo.join("faulty.txt");
    let run = dose3([
        OsStr::new("score"),
        "--detector".as_ref(),
        demo.join("drives.dose3").as_ref(),
        "--frame".as_ref(),
        "body-flu".as_ref(),
        log.as_ref(),
        "--mcap".as_ref(),
        recording.as_ref(),
    ]);
    expect_code(&run, 1);
    let bytes = fs::read(&recording).expect("a recording");
    assert!(bytes.starts_with(b"\x89MCAP0\r\n") && bytes.ends_with(b"\x89MCAP0\r\n"));
    let python = std::env::var_os("DOSE3_PYTHON").unwrap_or_else(|| "python3".into());
    let has = Command::new(&python)
        .args(["-c", "import mcap_protobuf"])
        .output();
    if !has.is_ok_and(|output| output.status.success()) {
        eprintln!(
            "recordings were not read back: no python3 with mcap and mcap-protobuf-support (DOSE3_PYTHON)"
        );
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/recording/check.py");
    let check = Command::new(&python)
        .arg(script)
        .arg(&recording)
        .arg(&log)
        .output()
        .expect("python");
    assert!(
        check.status.success(),
        "{}{}",
        stdout(&check),
        stderr(&check)
    );
}

/// Runs the browser's checks, or says that they were not run.
fn in_a_browser(pages: &[&Path]) {
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let runs = |program: &OsStr| {
        Command::new(program)
            .arg("--version")
            .output()
            .is_ok_and(|output| output.status.success())
    };
    let told = std::env::var_os("DOSE3_CHROMIUM");
    let chromium = told.or_else(|| {
        names
            .iter()
            .map(Into::into)
            .find(|name: &std::ffi::OsString| runs(name))
    });
    let Some(chromium) = chromium.filter(|_| runs("node".as_ref())) else {
        eprintln!("pages were not tried in a browser: no node, or no Chromium (DOSE3_CHROMIUM)");
        return;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/page/check.mjs");
    let check = Command::new("node")
        .arg(script)
        .arg(chromium)
        .args(pages)
        .output()
        .expect("node");
    assert!(
        check.status.success(),
        "{}{}",
        stdout(&check),
        stderr(&check)
    );
}
