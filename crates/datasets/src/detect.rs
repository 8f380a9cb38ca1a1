//! Finding the format of a log from its content.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::Place;
use crate::read::{frame_files, signature, split_fields};
use crate::{Error, Format};

/// Bytes looked at; the longest comment block before data in any of the formats is a few hundred.
const SAMPLE: u64 = 16 * 1024;

/// The format of a file, or of a folder `annotated_poses`, from its content.
///
/// # Errors
/// [`Error::Io`] where it cannot be read; [`Error::Input`] where it is none of [`Format::ALL`], saying what it
/// looks like instead. A file recognised here may still hold a fault further down.
pub fn detect(path: &Path) -> Result<Format, Error> {
    if path.is_dir() {
        if is_pose_folder(path) {
            return Ok(Format::Iros20Poses);
        }
        let hint = "give one log, or a folder of logs to a command that takes several";
        return Err(Error::input(path, Place::File, "a log", "a folder", hint));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(|source| Error::io(path, source))?;
    file.take(SAMPLE)
        .read_to_end(&mut bytes)
        .map_err(|source| Error::io(path, source))?;
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
        return Ok(Format::Iros20);
    }
    if let Some(found) = signature(&bytes) {
        return Err(unknown(path, Place::File, found.name, found.hint));
    }
    let whole = (bytes.len() as u64) < SAMPLE;
    let text = sample_text(path, &bytes, whole)?;
    detect_text(path, text.trim_start_matches('\u{feff}'))
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

/// The sample as text; a character cut at the end of the sample is no fault.
fn sample_text<'a>(path: &Path, bytes: &'a [u8], whole: bool) -> Result<&'a str, Error> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text),
        Err(fault) if !whole && fault.error_len().is_none() => {
            Ok(std::str::from_utf8(&bytes[..fault.valid_up_to()]).unwrap_or_default())
        }
        Err(fault) => {
            let line = 1 + bytes[..fault.valid_up_to()]
                .iter()
                .filter(|byte| **byte == b'\n')
                .count();
            let hint = "this looks like a binary file; give the file that holds the poses";
            Err(unknown(
                path,
                Place::Line(line),
                "bytes that are no text",
                hint,
            ))
        }
    }
}

fn detect_text(path: &Path, text: &str) -> Result<Format, Error> {
    let mut lines = text
        .lines()
        .map(str::trim)
        .enumerate()
        .filter(|(_, line)| !line.is_empty());
    let mut last = (0, "");
    for (index, line) in &mut lines {
        last = (index, line);
        if let Some(comment) = line.strip_prefix('#') {
            if comment.to_ascii_lowercase().contains("q_rs_w") {
                return Ok(Format::Euroc);
            }
            continue;
        }
        return detect_line(path, index + 1, line);
    }
    let found = if last.1.is_empty() {
        "only blank lines"
    } else {
        "only comments"
    };
    Err(unknown(
        path,
        Place::File,
        found,
        "the recording may have failed",
    ))
}

/// Judges the first line that is neither blank nor a comment.
fn detect_line(path: &Path, number: usize, line: &str) -> Result<Format, Error> {
    let place = Place::Line(number);
    let fields = split_fields(line);
    let lower: Vec<String> = fields
        .iter()
        .map(|field| field.to_ascii_lowercase())
        .collect();
    let has = |name: &str| lower.iter().any(|field| field == name);
    if ["roll", "pitch", "yaw"].into_iter().all(has) && (has("northing") || has("source_timestamp"))
    {
        return Ok(Format::RobotCar);
    }
    if has("northing") && has("easting") {
        let hint = "RobotCar poses with orientation are in gps/ins.csv, gps/rtk.csv and vo/vo.csv";
        return Err(unknown(
            path,
            place,
            "positions without roll, pitch and yaw",
            hint,
        ));
    }
    let numbers = fields
        .iter()
        .filter(|field| field.parse::<f64>().is_ok())
        .count();
    if numbers == 0 {
        return Err(unknown(
            path,
            place,
            "text without numbers",
            "give the file that holds the poses",
        ));
    }
    let commas = line.contains(',');
    // A first line with a damaged number is still recognised by its count; the reader names the number.
    let mostly_numbers = 2 * numbers > fields.len();
    match fields.len() {
        12 if !commas && mostly_numbers => Ok(Format::Kitti),
        8 if !commas && mostly_numbers => Ok(Format::Tum),
        8.. if commas
            && mostly_numbers
            && fields[0].len() >= 16
            && fields[0].bytes().all(|b| b.is_ascii_digit()) =>
        {
            Ok(Format::Euroc)
        }
        1 => Err(unknown(
            path,
            place,
            "one number a line",
            "this looks like KITTI times; give the pose file",
        )),
        4 if !commas => Err(unknown(
            path,
            place,
            "a line of 4 numbers",
            "one 4x4 pose of a folder annotated_poses? Give the folder",
        )),
        count => {
            let separator = if commas { "commas" } else { "spaces" };
            let found = format!("{count} fields separated by {separator}");
            Err(unknown(
                path,
                place,
                &found,
                "--format says which format it is meant to be",
            ))
        }
    }
}

fn unknown(path: &Path, place: Place, found: &str, hint: &str) -> Error {
    let expected =
        "poses as KITTI (12 numbers a line), TUM (8 numbers), EuRoC or RobotCar csv, or IROS20 npy";
    Error::input(path, place, expected, found, hint)
}
