//! Finding the format of a log from its content.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::Place;
use crate::read::{self, Layout, Text, frame_files, signature, unknown};
use crate::{Error, Format, LoadOptions, LoadReport};

/// Bytes looked at; the longest comment block before data in any of the formats is a few hundred.
const SAMPLE: u64 = 64 * 1024;

/// The format of a file, or of a folder `annotated_poses`, from its content.
///
/// # Errors
/// [`Error::Io`] where it cannot be read; [`Error::Input`] where it is none of [`Format::ALL`], saying what it
/// looks like instead. A file recognised here may still hold a fault further down.
pub fn detect(path: &Path) -> Result<Format, Error> {
    detect_with(path, &LoadOptions::default())
}

pub(crate) fn detect_with(path: &Path, options: &LoadOptions) -> Result<Format, Error> {
    if path.is_dir() {
        if is_pose_folder(path) {
            return Ok(Format::Iros20Poses);
        }
        #[cfg(feature = "recordings")]
        if crate::recording::is_folder(path) {
            return Ok(Format::Rosbag2);
        }
        let hint = "give one log, or a folder of logs to a command that takes several";
        return Err(Error::input(path, Place::File, "a log", "a folder", hint));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(|source| Error::io(path, source))?;
    file.take(SAMPLE)
        .read_to_end(&mut bytes)
        .map_err(|source| Error::io(path, source))?;
    let whole = (bytes.len() as u64) < SAMPLE;
    if bytes.starts_with(b"\x1f\x8b") || bytes.starts_with(b"\x28\xb5\x2f\xfd") {
        // A compressed file is small, and the first bytes of its content are not to be had without it.
        let packed = std::fs::read(path).map_err(|source| Error::io(path, source))?;
        return detect_bytes(path, &read::unpack(path, &packed)?, true, options);
    }
    detect_bytes(path, &bytes, whole, options)
}

/// The format of unpacked bytes; `whole` where they are all of the file.
pub(crate) fn detect_bytes(
    path: &Path,
    bytes: &[u8],
    whole: bool,
    options: &LoadOptions,
) -> Result<Format, Error> {
    if bytes.is_empty() {
        return Err(Error::input(
            path,
            Place::File,
            "poses",
            "an empty file",
            "the recording may have failed",
        ));
    }
    if bytes.starts_with(b"\x93NUMPY") {
        return Ok(if read::is_stream(bytes) {
            Format::Iros20
        } else {
            Format::Npy
        });
    }
    if let Some(format) = recording(bytes) {
        return Ok(format);
    }
    if read::is_npz(bytes) {
        return Ok(Format::Npz);
    }
    if bytes.starts_with(read::ULOG) {
        return Ok(Format::Ulog);
    }
    if let Some(found) = signature(bytes) {
        return Err(unknown(path, Place::File, found.name, found.hint));
    }
    let short = whole && bytes.len() as u64 <= SAMPLE;
    let sample = if short { bytes } else { whole_lines(bytes) };
    let text = Text::new(path, sample, &mut LoadReport::default()).map_err(as_unknown)?;
    // Who names columns means a table.
    let named = options.columns.is_some() || options.log_column.is_some();
    let of_tools = match read::detect_graph(text.as_str()) {
        Some(format) if !named => Some(format),
        _ if read::detect_json(text.as_str()) => Some(Format::Json),
        _ if read::detect_echo(text.as_str()) => Some(Format::Echo),
        _ if read::detect_motive(text.as_str()) => Some(Format::Csv),
        _ if !named && is_robotcar(text.as_str()) => Some(Format::RobotCar),
        _ => None,
    };
    if let Some(format) = of_tools {
        return Ok(format);
    }
    Ok(Layout::find(path, &text, options)?.format)
}

/// The recording that the first bytes of a file say.
pub(crate) fn recording(bytes: &[u8]) -> Option<Format> {
    if bytes.starts_with(b"\x89MCAP") {
        Some(Format::Mcap)
    } else if bytes.starts_with(b"#ROSBAG V2") {
        Some(Format::Bag)
    } else if bytes.starts_with(b"SQLite format 3\0") {
        Some(Format::Rosbag2)
    } else {
        None
    }
}

/// A sample without its last, probably cut line.
fn whole_lines(bytes: &[u8]) -> &[u8] {
    let bytes = &bytes[..bytes.len().min(SAMPLE as usize)];
    match bytes.iter().rposition(|byte| *byte == b'\n') {
        Some(end) => &bytes[..=end],
        None => bytes,
    }
}

/// Text that is none is nothing that can be read at all.
fn as_unknown(error: Error) -> Error {
    match error {
        Error::Input(fault) if fault.expected == "text in UTF-8" => {
            unknown(&fault.path, fault.place, &fault.found, &fault.hint)
        }
        other => other,
    }
}

/// True for a folder that holds one 4x4 text file per frame, or is named as such.
pub(crate) fn is_pose_folder(path: &Path) -> bool {
    let Ok(files) = frame_files(path) else {
        return false;
    };
    if path
        .file_name()
        .is_some_and(|name| name == "annotated_poses")
    {
        return !files.is_empty();
    }
    // The first files decide; one of them may be the broken one.
    files.iter().take(3).any(|(_, file)| {
        let text = std::fs::metadata(file)
            .ok()
            .filter(|data| data.len() < SAMPLE)
            .and_then(|_| std::fs::read_to_string(file).ok())
            .unwrap_or_default();
        let rows: Vec<usize> = text
            .lines()
            .map(|line| line.split_whitespace().count())
            .filter(|count| *count > 0)
            .collect();
        rows == [4, 4, 4, 4]
    })
}

/// RobotCar's own headers; others with the same words are read by the names of their columns.
fn is_robotcar(text: &str) -> bool {
    let header = text.lines().map(str::trim).find(|line| !line.is_empty());
    let header = header.unwrap_or_default().to_ascii_lowercase();
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let has = |wanted: &[&str]| wanted.iter().all(|name| names.contains(name));
    has(&[
        "timestamp",
        "northing",
        "easting",
        "down",
        "roll",
        "pitch",
        "yaw",
    ]) || has(&[
        "source_timestamp",
        "destination_timestamp",
        "roll",
        "pitch",
        "yaw",
    ])
}
