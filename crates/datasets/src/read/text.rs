//! Text files as lines with their numbers, whatever the encoding, the line ends and the byte order mark.

use std::borrow::Cow;
use std::path::Path;

use super::layout::is_comment;
use super::table::Separator;
use crate::error::Place;
use crate::{Error, LoadReport, Remark, RemarkKind};

/// A whole text file, without its byte order mark.
pub(crate) struct Text<'a> {
    content: Cow<'a, str>,
}

/// One line that holds something.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line<'a> {
    /// Counted from 1.
    pub number: usize,
    /// Without line end and outer white space; never empty.
    pub text: &'a str,
    /// The last line of a file that does not end in a line end: perhaps cut off.
    pub unterminated: bool,
}

impl<'a> Text<'a> {
    /// Takes the bytes of a file and counts byte order mark, Windows line ends and blank lines into the report.
    pub fn new(path: &Path, bytes: &'a [u8], report: &mut LoadReport) -> Result<Self, Error> {
        if let Some(found) = signature(bytes) {
            let wanted = "a text file of poses";
            return Err(Error::input(
                path,
                Place::File,
                wanted,
                found.name,
                found.hint,
            ));
        }
        let mut content = decode(path, bytes, report)?;
        if content.starts_with('\u{feff}') {
            content = match content {
                Cow::Borrowed(text) => Cow::Borrowed(&text[3..]),
                Cow::Owned(text) => Cow::Owned(text[3..].to_owned()),
            };
            report.byte_order_mark = true;
        }
        if content.trim().is_empty() {
            let hint = "the recording may have failed";
            return Err(Error::input(
                path,
                Place::File,
                "poses",
                "an empty file",
                hint,
            ));
        }
        if content.contains('\r') {
            if content.contains('\n') {
                report.crlf_lines += content.matches("\r\n").count();
            } else {
                content = Cow::Owned(content.replace('\r', "\n"));
                let text =
                    "lines end in a carriage return alone, as on old Macs; read as line ends";
                report.remarks.push(Remark::new(RemarkKind::Encoding, text));
            }
        }
        if let Some(rewritten) = rewrite_numbers(&content, report) {
            content = Cow::Owned(rewritten);
        }
        if let Some(separator) = trailing_separator(&content) {
            let lines = content.split_inclusive('\n');
            content = Cow::Owned(lines.map(|line| without_last(line, separator)).collect());
        }
        if lacks_first(&content) {
            let lines = content.split_inclusive('\n');
            content = Cow::Owned(lines.map(with_first).collect());
        }
        let text = Self { content };
        if may_hold_blank_lines(text.content.as_bytes()) {
            let mut blank = 0;
            for line in text.content.lines() {
                if line.trim().is_empty() {
                    blank += 1;
                } else {
                    report.blank_lines += std::mem::take(&mut blank);
                }
            }
        }
        Ok(text)
    }

    /// What follows so many lines.
    pub fn behind(&self, lines: usize) -> &str {
        let ends = self.content.match_indices('\n').map(|(at, _)| at + 1);
        match lines {
            0 => &self.content,
            _ => ends.take(lines).last().map_or("", |at| &self.content[at..]),
        }
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

/// Whether a line begins with something that may be a blank, or with nothing.
fn may_hold_blank_lines(bytes: &[u8]) -> bool {
    let odd = |byte: u8| byte <= b' ' || byte >= 0x80;
    let pairs = || bytes.iter().zip(bytes.get(1..).unwrap_or_default());
    // Without a branch, so that many bytes are looked at at once.
    let found = pairs().fold(false, |found, (end, next)| {
        found | ((*end == b'\n') & odd(*next))
    });
    found || bytes.first().is_some_and(|first| odd(*first))
}

/// Whether tabs separate fields of which the first has a name and is empty in some of the first lines: without white space at
/// their ends, the others of these lines would stand in the columns before theirs.
fn lacks_first(text: &str) -> bool {
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let Some(header) = lines.next() else {
        return false;
    };
    let tabs = |line: &str| line.trim_end_matches(['\r', '\n']).matches('\t').count();
    let mut data = lines.take(LINES_FOR_ENDS);
    tabs(header) > 0
        && header.starts_with(|c: char| c.is_ascii_alphabetic())
        && data.any(|line| line.starts_with('\t') && tabs(line) == tabs(header))
}

/// A line of such a text, with something in the place of an empty first field.
fn with_first(line: &str) -> String {
    match line.starts_with('\t') && !line.trim().is_empty() {
        true => format!("\"\"{line}"),
        false => line.to_owned(),
    }
}

/// Lines looked at to see whether they end in a separator.
const LINES_FOR_ENDS: usize = 40;

/// The separator that stands behind the last field of every line of data, as VINS writes it; `None` where a header has a name
/// for what stands behind it.
fn trailing_separator(text: &str) -> Option<char> {
    let content = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let is_data =
        |line: &str| line.starts_with(|c: char| c.is_ascii_digit() || "+-.\"".contains(c));
    let first = content.clone().find(|line| is_data(line))?;
    let separator = first.chars().last().filter(|last| ",;".contains(*last))?;
    let data = content.clone().filter(|line| is_data(line));
    let (mut lines, mut all) = (0, true);
    for line in data.take(LINES_FOR_ENDS) {
        lines += 1;
        let rest = line.strip_suffix(separator);
        all &= rest.is_some_and(|rest| !rest.trim_end().ends_with(separator));
    }
    let fields = first.matches(separator).count() + 1;
    let header = content.take_while(|line| !is_data(line)).last();
    let named = header.is_some_and(|header| {
        header.matches(separator).count() + 1 == fields && !header.ends_with(separator)
    });
    (all && lines > 1 && !named).then_some(separator)
}

/// A line, with its end, without a separator as its last character.
fn without_last(line: &str, separator: char) -> String {
    let content = line.trim_end();
    let end = &line[content.len()..];
    let kept = content.strip_suffix(separator).unwrap_or(content);
    format!("{kept}{end}")
}

/// The text with decimal commas or Fortran exponents written as usual; `None` where there are none.
fn rewrite_numbers(text: &str, report: &mut LoadReport) -> Option<String> {
    let data = |line: &&str| !is_comment(line) && line.contains(|c: char| c.is_ascii_digit());
    let first = text.lines().map(str::trim).filter(data).nth(1)?;
    let separator = Separator::of(first);
    let mut fields = Vec::new();
    separator.split(first, &mut fields);
    let commas =
        separator != Separator::Character(',') && !first.contains('.') && first.contains(',');
    let fortran = |field: &&str| {
        field
            .split_once(['D', 'd'])
            .is_some_and(|(mantissa, exponent)| {
                mantissa.parse::<f64>().is_ok() && exponent.parse::<i32>().is_ok()
            })
    };
    let exponents = fields.iter().any(fortran);
    if !commas && !exponents {
        return None;
    }
    let what = if commas {
        "decimal commas"
    } else {
        "Fortran exponents (1.0D+00)"
    };
    let words = format!("the numbers have {what}; read as such");
    report
        .remarks
        .push(Remark::new(RemarkKind::Encoding, words));
    let mut content = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        if is_comment(line.trim_start()) {
            content.push_str(line);
            continue;
        }
        let mut before = ' ';
        content.extend(line.chars().map(|character| {
            let number = before.is_ascii_digit() || before == '.';
            before = character;
            match character {
                ',' if commas && number => '.',
                'D' | 'd' if exponents && number => 'e',
                other => other,
            }
        }));
    }
    Some(content)
}

/// UTF-8, else UTF-16 by its mark or its zeros, else Latin-1 where only words hold other characters.
fn decode<'a>(
    path: &Path,
    bytes: &'a [u8],
    report: &mut LoadReport,
) -> Result<Cow<'a, str>, Error> {
    if let Some(little) = utf16(bytes) {
        let pairs = bytes.chunks_exact(2).map(|pair| match little {
            true => u16::from_le_bytes([pair[0], pair[1]]),
            false => u16::from_be_bytes([pair[0], pair[1]]),
        });
        let text: String = char::decode_utf16(pairs)
            .map(|unit| unit.unwrap_or('\u{fffd}'))
            .collect();
        let words = "the text is in UTF-16; read as such";
        report
            .remarks
            .push(Remark::new(RemarkKind::Encoding, words));
        return Ok(Cow::Owned(text));
    }
    let fault = match std::str::from_utf8(bytes) {
        Ok(text) => return Ok(Cow::Borrowed(text)),
        Err(fault) => fault,
    };
    let mut number = 0;
    let mut first = None;
    for line in bytes.split(|byte| *byte == b'\n') {
        number += 1;
        if std::str::from_utf8(line).is_ok() {
            continue;
        }
        let word = line
            .trim_ascii_start()
            .first()
            .is_some_and(|byte| byte.is_ascii_alphabetic() || b"#%/".contains(byte));
        let printable = line
            .iter()
            .all(|byte| *byte >= 32 || b"\t\r".contains(byte));
        if !(word && printable) {
            let before = bytes[..fault.valid_up_to()].iter();
            let bad = before.filter(|byte| **byte == b'\n').count() + 1;
            let hint = "this looks like a binary file; give the file that holds the poses";
            let found = "bytes that are no text";
            let place = Place::Line(if first.is_none() { bad } else { number });
            return Err(Error::input(path, place, "text in UTF-8", found, hint));
        }
        first.get_or_insert(number);
    }
    let line = first.unwrap_or(1);
    let words =
        format!("line {line} holds characters that are not UTF-8; the text was read as Latin-1");
    report
        .remarks
        .push(Remark::new(RemarkKind::Encoding, words));
    Ok(Cow::Owned(
        bytes.iter().map(|byte| char::from(*byte)).collect(),
    ))
}

/// Whether the bytes are UTF-16, and if so whether the low byte comes first.
fn utf16(bytes: &[u8]) -> Option<bool> {
    match bytes {
        [0xff, 0xfe, ..] => return Some(true),
        [0xfe, 0xff, ..] => return Some(false),
        _ => {}
    }
    let sample = &bytes[..bytes.len().min(256) & !1];
    if sample.len() < 4 {
        return None;
    }
    let zeros = |odd: usize| {
        sample
            .iter()
            .skip(odd)
            .step_by(2)
            .filter(|byte| **byte == 0)
            .count()
    };
    let (even, odd, all) = (zeros(0), zeros(1), sample.len() / 2);
    if odd == all && even == 0 {
        Some(true)
    } else if even == all && odd == 0 {
        Some(false)
    } else {
        None
    }
}

/// A kind of file known by its first bytes, and what to do with it.
pub(crate) struct Signature {
    pub name: &'static str,
    pub hint: &'static str,
}

/// Recognises files that are surely no text, to name them instead of complaining about bytes.
pub(crate) fn signature(bytes: &[u8]) -> Option<Signature> {
    let known: [(&[u8], &str, &str); 12] = [
        (
            b"\x93NUMPY",
            "a numpy array",
            "read it with the format npy or iros20",
        ),
        (
            b"\x89MCAP",
            "an MCAP recording",
            "read it with the format mcap",
        ),
        (b"#ROSBAG", "a ROS 1 bag", "read it with the format bag"),
        (
            b"SQLite format 3",
            "an SQLite file, perhaps a ROS 2 bag",
            "read it with the format rosbag2",
        ),
        (
            b"PK\x03\x04",
            "a zip archive without numpy arrays",
            "unpack it first",
        ),
        (
            b"\x1f\x8b",
            "a gzip archive",
            "it can be read where this build has gzip, else unpack it first",
        ),
        (
            b"\x28\xb5\x2f\xfd",
            "a zstd archive",
            "it can be read where this build has zstd, else unpack it first",
        ),
        (b"PAR1", "a parquet table", "save the table as csv"),
        (b"\x89HDF", "an HDF5 file", "save the poses as csv or npy"),
        (
            b"# kapture format",
            "a table of kapture, whose poses take the world to the sensor",
            "invert them and save them as TUM",
        ),
        (
            b"# .PCD",
            "a point cloud (PCD)",
            "save the poses as text, one a line: LIO-SAM's transformations.pcd holds x, y, z, roll, pitch, yaw and time",
        ),
        (
            b"ply\n",
            "a point cloud (PLY)",
            "give the file that holds the poses",
        ),
    ];
    if bytes.len() > 9 && bytes[8..].starts_with(b"{\"__metadata__\"") {
        return Some(Signature {
            name: "a model or a detector",
            hint: "give a pose log here and the detector where a detector is asked for",
        });
    }
    known
        .into_iter()
        .find(|(magic, _, _)| bytes.starts_with(magic))
        .map(|(_, name, hint)| Signature { name, hint })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: &[u8]) -> (Vec<(usize, String, bool)>, LoadReport) {
        let mut report = LoadReport::default();
        let text = Text::new(Path::new("a"), bytes, &mut report).unwrap();
        let lines = text.lines();
        let lines = lines.map(|line| (line.number, line.text.to_owned(), line.unterminated));
        (lines.collect(), report)
    }

    #[test]
    fn lines_keep_their_number_whatever_is_blank_before_them() {
        let (found, report) = lines("\u{feff}\n\r\na b\r\n\n \t\nc".as_bytes());
        assert_eq!(
            found,
            [(3, "a b".to_owned(), false), (6, "c".to_owned(), true)]
        );
        assert!(report.byte_order_mark);
        assert_eq!((report.crlf_lines, report.blank_lines), (2, 4));
    }

    #[test]
    fn other_encodings_and_line_ends_are_read_and_remarked() {
        let wanted = [
            (1, "# a\u{b0}".to_owned(), false),
            (2, "1 2".to_owned(), true),
        ];
        let utf16: Vec<u8> = "# a\u{b0}\n1 2"
            .encode_utf16()
            .flat_map(u16::to_le_bytes)
            .collect();
        let with_mark = [&[0xff, 0xfe], &utf16[..]].concat();
        let big: Vec<u8> = "# a\u{b0}\n1 2"
            .encode_utf16()
            .flat_map(u16::to_be_bytes)
            .collect();
        for bytes in [
            &b"# a\xb0\n1 2"[..],
            &utf16,
            &with_mark,
            &big,
            b"# a\xb0\r1 2",
        ] {
            let (found, report) = lines(bytes);
            assert_eq!(found, wanted);
            assert!(
                report
                    .remarks
                    .iter()
                    .all(|remark| remark.kind == RemarkKind::Encoding)
            );
            assert!(!report.remarks.is_empty());
        }
        assert!(
            Text::new(
                Path::new("a"),
                b"1 2\n\xff\xfe\xfd",
                &mut LoadReport::default()
            )
            .is_err()
        );
    }
}
