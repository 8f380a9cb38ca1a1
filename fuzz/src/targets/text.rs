//! Logs from bytes.

use super::sound::{check, reread};
use dose3_datasets::{Columns, Format, LoadOptions, load_several_bytes};

/// Reads a log of this format, or of the one that its content tells.
pub fn read_as(bytes: &[u8], format: Option<Format>) {
    let options = LoadOptions {
        format,
        ..LoadOptions::default()
    };
    read(bytes, &options);
}

/// Follows a chain of transforms through a recording.
pub fn transform_tree(bytes: &[u8]) {
    let options = LoadOptions {
        tf: Some(("map".to_owned(), "base_link".to_owned())),
        ..LoadOptions::default()
    };
    read(bytes, &options);
}

/// The first line says which columns are read, the rest is the table.
pub fn columns(bytes: &[u8]) {
    let end = bytes
        .iter()
        .position(|byte| *byte == b'\n')
        .unwrap_or(bytes.len());
    let Ok(words) = std::str::from_utf8(&bytes[..end]) else {
        return;
    };
    let (words, log_column) = match words.split_once(';') {
        Some((words, column)) => (words, Some(column.to_owned())),
        None => (words, None),
    };
    let Ok(columns) = words.parse::<Columns>() else {
        return;
    };
    let options = LoadOptions {
        columns: Some(columns),
        log_column,
        ..LoadOptions::default()
    };
    read(&bytes[(end + 1).min(bytes.len())..], &options);
}

fn read(bytes: &[u8], options: &LoadOptions) {
    match load_several_bytes("log", bytes, options) {
        Ok(logs) => {
            for log in &logs {
                check(log);
                reread(log);
            }
        }
        Err(error) => assert!(
            !error.to_string().trim().is_empty(),
            "an error without words"
        ),
    }
}
