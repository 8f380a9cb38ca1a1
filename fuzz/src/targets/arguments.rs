//! The command line, and what the program reads as lines: lists of logs, poses.

use super::sound::LATEST;
use clap::Parser;
use clap::error::ErrorKind;
use dose3_cli::args::Args;
use dose3_cli::{command_line, list, pose_line};
use dose3_datasets::StampUnit;
use std::ffi::{OsStr, OsString};
use std::path::Path;

/// A word a line: understood, or refused in words. Nothing is run.
pub fn arguments(bytes: &[u8]) {
    let words: Vec<OsString> = bytes.split(|byte| *byte == b'\n').map(word).collect();
    let line = command_line::shell(words.iter().map(OsString::as_os_str));
    let shown: Vec<String> = words
        .iter()
        .map(|word| word.to_string_lossy().into_owned())
        .collect();
    assert_eq!(split(&line), shown, "{line}");
    match Args::try_parse_from(std::iter::once(OsString::from("dose3")).chain(words)) {
        Ok(args) => assert!(!format!("{args:?}").is_empty()),
        Err(error) => {
            let help = [ErrorKind::DisplayHelp, ErrorKind::DisplayVersion];
            assert_eq!(
                error.exit_code() == 0,
                help.contains(&error.kind()),
                "{error}"
            );
            assert!(
                !error.to_string().trim().is_empty(),
                "an error without words"
            );
        }
    }
}

#[cfg(unix)]
fn word(bytes: &[u8]) -> OsString {
    use std::os::unix::ffi::OsStrExt;
    OsStr::from_bytes(bytes).to_owned()
}

#[cfg(not(unix))]
fn word(bytes: &[u8]) -> OsString {
    String::from_utf8_lossy(bytes).into_owned().into()
}

/// The words that a shell makes of a line with single quotes and escaped ones.
fn split(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    let mut letters = line.chars();
    while let Some(letter) = letters.next() {
        let last = words.len() - 1;
        match letter {
            '\'' => quoted = !quoted,
            '\\' if !quoted => words[last].extend(letters.next()),
            ' ' if !quoted => words.push(String::new()),
            _ => words[last].push(letter),
        }
    }
    words
}

/// A list of logs.
pub fn logs(bytes: &[u8]) {
    let folder = Path::new("folder");
    match list::parse(Path::new("list"), bytes, folder, |_| true) {
        Ok(rows) => {
            assert!(!rows.is_empty());
            assert!(rows.iter().all(|row| row.line > 0));
        }
        Err(error) => assert!(!error.to_string().is_empty(), "an error without words"),
    }
}

/// Poses a line, as `dose3 watch` reads them: what is accepted reads back from what it says.
pub fn poses(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    for line in text.lines() {
        for unit in [StampUnit::Seconds, StampUnit::Nanoseconds] {
            match pose_line::parse(line, unit) {
                Ok(Some(pose)) => reads_back(&pose),
                Ok(None) => {}
                Err(error) => assert!(!error.is_empty(), "an error without words"),
            }
        }
    }
}

fn reads_back(pose: &pose_line::Line) {
    let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
    if !finite(&pose.position) || !finite(&pose.orientation) {
        return;
    }
    let json = serde_json::json!({
        "stamp_ns": pose.stamp_ns, "position": pose.position, "orientation": pose.orientation,
    });
    let ([x, y, z], [a, b, c, d]) = (pose.position, pose.orientation);
    let text = format!("{} {x} {y} {z} {a} {b} {c} {d}", pose.stamp_ns);
    // Text holds stamps before the year 2096, `stamp_ns` any.
    let early = pose.stamp_ns.unsigned_abs() < LATEST;
    for line in [Some(json.to_string()), early.then_some(text)]
        .into_iter()
        .flatten()
    {
        let back = pose_line::parse(&line, StampUnit::Nanoseconds);
        assert_eq!(back.as_ref(), Ok(&Some(*pose)), "{line}");
    }
}
