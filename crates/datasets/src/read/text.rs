//! Text files as lines with their numbers, whatever the line ends and the byte order mark.

use std::fs;
use std::path::Path;

use crate::error::Place;
use crate::{Error, LoadReport};

/// A whole text file, without its byte order mark.
pub(crate) struct Text {
    content: String,
}

/// One line that holds something.
pub(crate) struct Line<'a> {
    /// Counted from 1.
    pub number: usize,
    /// Without line end and outer white space; never empty.
    pub text: &'a str,
    /// The last line of a file that does not end in a line end: perhaps cut off.
    pub unterminated: bool,
}

impl Text {
    /// Reads the file and counts byte order mark, Windows line ends and blank lines into the report.
    pub fn read(path: &Path, report: &mut LoadReport) -> Result<Self, Error> {
        let bytes = fs::read(path).map_err(|source| Error::io(path, source))?;
        if let Some(found) = signature(&bytes) {
            return Err(Error::input(
                path,
                Place::File,
                "a text file of poses",
                found.name,
                found.hint,
            ));
        }
        let mut content = String::from_utf8(bytes).map_err(|fault| {
            let good = fault.utf8_error().valid_up_to();
            let line = 1 + fault.as_bytes()[..good]
                .iter()
                .filter(|byte| **byte == b'\n')
                .count();
            Error::input(
                path,
                Place::Line(line),
                "text in UTF-8",
                "bytes that are no text",
                "this looks like a binary file; give the file that holds the poses",
            )
        })?;
        if content.starts_with('\u{feff}') {
            content.drain(..'\u{feff}'.len_utf8());
            report.byte_order_mark = true;
        }
        if content.trim().is_empty() {
            return Err(Error::input(
                path,
                Place::File,
                "poses",
                "an empty file",
                "the recording may have failed",
            ));
        }
        let data = content.trim_end();
        report.crlf_lines += content.matches("\r\n").count();
        report.blank_lines += data.lines().filter(|line| line.trim().is_empty()).count();
        Ok(Self { content })
    }

    /// The whole content.
    pub fn as_str(&self) -> &str {
        &self.content
    }

    /// The lines that are not blank.
    pub fn lines(&self) -> impl Iterator<Item = Line<'_>> {
        let lines = self.content.split_inclusive('\n').enumerate();
        lines.filter_map(|(index, line)| {
            let text = line.trim();
            let unterminated = !line.ends_with('\n');
            (!text.is_empty()).then_some(Line {
                number: index + 1,
                text,
                unterminated,
            })
        })
    }
}

/// Splits a line at commas where it has any, else at white space; fields come without outer white space.
pub(crate) fn split_fields(text: &str) -> Vec<&str> {
    if text.contains(',') {
        text.split(',').map(str::trim).collect()
    } else {
        text.split_whitespace().collect()
    }
}

/// A kind of file known by its first bytes, and what to do with it.
pub(crate) struct Signature {
    pub name: &'static str,
    pub hint: &'static str,
}

/// Recognises files that are surely no text, to name them instead of complaining about bytes.
pub(crate) fn signature(bytes: &[u8]) -> Option<Signature> {
    let known: [(&[u8], &str, &str); 8] = [
        (
            b"\x93NUMPY",
            "a numpy array",
            "read it with the format iros20",
        ),
        (
            b"\x89MCAP",
            "an MCAP recording",
            "export the pose topic to a TUM file first, for example with evo_traj",
        ),
        (
            b"#ROSBAG",
            "a ROS 1 bag",
            "export the pose topic to a TUM file first, for example with evo_traj",
        ),
        (
            b"SQLite format 3",
            "an SQLite file, perhaps a ROS 2 bag",
            "export the pose topic to a TUM file first",
        ),
        (b"PK\x03\x04", "a zip archive", "unpack it first"),
        (b"\x1f\x8b", "a gzip archive", "unpack it first"),
        (b"\xff\xfe", "text in UTF-16", "save it as UTF-8"),
        (b"\xfe\xff", "text in UTF-16", "save it as UTF-8"),
    ];
    known
        .into_iter()
        .find(|(magic, _, _)| bytes.starts_with(magic))
        .map(|(_, name, hint)| Signature { name, hint })
}
