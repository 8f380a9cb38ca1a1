//! Poses in JSON: a list of objects or of matrices, lists of numbers side by side, or an object a line.

mod lists;

use std::borrow::Cow;
use std::path::Path;

use serde_json::Value;

use super::records::{self, List};
use super::table::shorten;
use crate::error::Place;
use crate::{Error, Format, LoadOptions, Trajectory};

/// True for a text that begins as JSON does.
pub(crate) fn detect(text: &str) -> bool {
    text.trim_start().starts_with(['{', '['])
}

/// Whether a file among others is a log: what is damaged is one where it speaks of poses.
pub(crate) fn has_poses(bytes: &[u8], options: &LoadOptions) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let text = without_nan(text.trim_start_matches('\u{feff}'));
    if let Ok(document) = serde_json::from_str::<Value>(&text) {
        return records::any_poses(&lists_of(&document, options), options);
    }
    let first = text.lines().find(|line| !line.trim().is_empty());
    if let Some(Ok(record)) = first.map(serde_json::from_str::<Value>) {
        return records::any_poses(&[lists::of_values(vec![&record])], options);
    }
    let words = ["position", "pose", "transform", "translation"];
    words.iter().any(|word| text.contains(&format!("\"{word}")))
}

/// The one list of poses in a text.
pub(crate) fn read(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Trajectory, Error> {
    let text = std::str::from_utf8(bytes).map_err(|fault| {
        let line = bytes[..fault.valid_up_to()].split(|b| *b == b'\n').count();
        let found = "bytes that are no text";
        Error::input(
            path,
            Place::Line(line),
            "JSON in UTF-8",
            found,
            "is the file damaged?",
        )
    })?;
    let text = &*without_nan(text.trim_start_matches('\u{feff}'));
    match serde_json::from_str::<Value>(text) {
        Ok(document) => {
            let lists = lists_of(&document, options);
            records::read(path, lists, None, Format::Json, options)
        }
        Err(fault) => {
            let (values, lines, cut_off) = parse_lines(path, text, &fault)?;
            let list = lists::of_values(values.iter().collect());
            let mut log = records::read(path, vec![list], Some(&lines), Format::Json, options)?;
            log.report.truncated_tail += usize::from(cut_off);
            Ok(log)
        }
    }
}

/// The lists of a document: those of the topics, which otherwise are bodies in the records of one.
fn lists_of<'a>(document: &'a Value, options: &LoadOptions) -> Vec<List<'a>> {
    let mut lists = lists::find(document);
    if lists.iter().any(|list| options.topics.contains(&list.name)) {
        lists.retain(|list| options.topics.contains(&list.name));
    }
    lists
}

/// Python writes NaN and Infinity, which are no JSON: taken as null, which is no value either.
fn without_nan(text: &str) -> Cow<'_, str> {
    const WORDS: [&str; 3] = ["NaN", "-Infinity", "Infinity"];
    if !WORDS.iter().any(|word| text.contains(word)) {
        return Cow::Borrowed(text);
    }
    let (mut out, mut rest) = (String::with_capacity(text.len()), text);
    let (mut quoted, mut escaped) = (false, false);
    while let Some(character) = rest.chars().next() {
        let word = WORDS
            .iter()
            .find(|word| !quoted && rest.starts_with(**word));
        if let Some(word) = word {
            out.push_str("null");
            rest = &rest[word.len()..];
            continue;
        }
        quoted ^= character == '"' && !escaped;
        escaped = quoted && character == '\\' && !escaped;
        out.push(character);
        rest = &rest[character.len_utf8()..];
    }
    Cow::Owned(out)
}

/// One value a line, with the numbers of the lines; a last line that is cut off is left out.
fn parse_lines(
    path: &Path,
    text: &str,
    whole: &serde_json::Error,
) -> Result<(Vec<Value>, Vec<usize>, bool), Error> {
    let (mut values, mut lines) = (Vec::new(), Vec::new());
    let content = text
        .split_inclusive('\n')
        .enumerate()
        .map(|(index, line)| (index + 1, line))
        .filter(|(_, line)| !line.trim().is_empty());
    for (number, line) in content {
        match serde_json::from_str::<Value>(line) {
            Ok(value @ (Value::Object(_) | Value::Array(_))) => {
                values.push(value);
                lines.push(number);
            }
            _ if values.len() > 1 && !line.ends_with('\n') => return Ok((values, lines, true)),
            // With two values before it this is a file of lines, else one document with a fault.
            Err(fault) if values.len() > 1 => return Err(damaged(path, number, &fault)),
            Err(_) => return Err(damaged(path, whole.line(), whole)),
            Ok(_) => {
                let found = format!("`{}`", shorten(line.trim()));
                let wanted = "an object or an array";
                return Err(Error::input(
                    path,
                    Place::Line(number),
                    wanted,
                    found,
                    "is this a pose log?",
                ));
            }
        }
    }
    Ok((values, lines, false))
}

fn damaged(path: &Path, line: usize, fault: &serde_json::Error) -> Error {
    Error::input(
        path,
        Place::Line(line.max(1)),
        "JSON: one document, or an object a line",
        fault.to_string(),
        "is the file cut off?",
    )
}
