//! Poses in JSON: a list of objects or of matrices, lists of numbers side by side, or an object a line.
//!
//! What is found becomes a table, so that units and orders which the file leaves open are told as in any other.

mod lists;
mod shape;

use std::borrow::Cow;
use std::path::Path;

use serde_json::Value;

use super::sheet;
use super::table::shorten;
use crate::error::Place;
use crate::{Error, Format, LoadOptions, ReadOption, Remark, RemarkKind, RowKind, Trajectory};
use lists::List;
use shape::Shape;

/// True for a text that begins as JSON does.
pub(crate) fn detect(text: &str) -> bool {
    text.trim_start().starts_with(['{', '['])
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
            let mut lists = lists::find(&document);
            if !options.topics.is_empty() {
                lists.retain(|list| options.topics.contains(&list.name));
            }
            let (list, shape) = one(path, lists, options)?;
            table(path, &list, &shape, None, options)
        }
        Err(fault) => {
            let (values, lines, cut_off) = parse_lines(path, text, &fault)?;
            let list = List {
                name: String::new(),
                records: values.iter().map(|value| vec![("", value)]).collect(),
                stamps: None,
            };
            let (list, shape) = one(path, vec![list], options)?;
            let mut log = table(path, &list, &shape, Some(&lines), options)?;
            log.report.truncated_tail += usize::from(cut_off);
            Ok(log)
        }
    }
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

/// The one list that holds poses.
fn one<'a>(
    path: &Path,
    lists: Vec<List<'a>>,
    options: &LoadOptions,
) -> Result<(List<'a>, Shape), Error> {
    let mut first = None;
    let mut found: Vec<(List<'a>, Shape)> = Vec::new();
    for list in lists {
        match Shape::of(&list, options.columns.is_some()) {
            Ok(shape) => found.push((list, shape)),
            Err(names) => {
                first.get_or_insert(names);
            }
        }
    }
    let names: Vec<&str> = found.iter().map(|(list, _)| list.name.as_str()).collect();
    if names.len() > 1 {
        let words = format!("{} lists of poses: {}", names.len(), names.join(", "));
        let hint = "say which one is meant";
        return Err(
            Error::input(path, Place::File, "one list of poses", words, hint)
                .option(ReadOption::Topic),
        );
    }
    found.pop().ok_or_else(|| {
        let words = match first {
            Some(names) if !names.is_empty() => format!("the names `{}`", shorten(&names)),
            _ => "no list of objects or of matrices".to_owned(),
        };
        let expected = "JSON with positions and rotations (quaternions, matrices, or roll, pitch and yaw) by names or as matrices";
        let hint = "these names were not understood; say which hold the pose";
        Error::input(path, Place::File, expected, words, hint).option(ReadOption::Columns)
    })
}

/// Reads the table that the records make. `lines` are those of the file, where each record has its own.
fn table(
    path: &Path,
    list: &List<'_>,
    shape: &Shape,
    lines: Option<&[usize]>,
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    let text = shape.table(list);
    let headers = usize::from(shape.has_header());
    let mut options = options.clone();
    options.stamp_unit = options.stamp_unit.or(shape.stamp_unit());
    options.topics.clear();
    // A line of the table is a record, which is a line or a pose of the file.
    let index = |line: usize| line.saturating_sub(1 + headers);
    let row = |line: u64| match lines {
        Some(lines) => lines
            .get(index(line as usize))
            .map_or(line, |row| *row as u64),
        None => index(line as usize) as u64,
    };
    let read = sheet::read(path, text.as_bytes(), Some(Format::Json), None, &options);
    let mut log = read.map_err(|error| match error {
        Error::Input(mut fault) => {
            if let Place::Line(line) = fault.place {
                fault.place = match lines {
                    Some(_) => Place::Line(row(line as u64) as usize),
                    None => Place::Pose(index(line)),
                };
            }
            Error::Input(fault)
        }
        other => other,
    })?;
    // What is said of the columns of the table says nothing of the file.
    let remarks = &mut log.report.remarks;
    remarks.retain(|remark| remark.kind != RemarkKind::Columns);
    if !shape.words.is_empty() {
        remarks.push(Remark::new(RemarkKind::Columns, &*shape.words).option(ReadOption::Columns));
    }
    log.row_kind = match lines {
        Some(_) => RowKind::Line,
        None => RowKind::Record,
    };
    for at in &mut log.rows {
        *at = row(*at);
    }
    for span in &mut log.report.lost {
        (span.first_row, span.last_row) = (row(span.first_row), row(span.last_row));
    }
    Ok(log)
}
