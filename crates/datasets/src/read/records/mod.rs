//! Poses that are no lines of text: records with named numbers become a table, so that units and orders which a file leaves open
//! are told as in any other.

mod shape;

use std::fmt::Write as _;
use std::path::Path;

use super::{dates, sheet};
use crate::error::Place;
use crate::read::table::shorten;
use crate::{
    Error, Format, LoadOptions, ReadOption, Remark, RemarkKind, RowKind, StampUnit, Trajectory,
};
use shape::{NoShape, Shape};

/// Numbers under one name at most, and names of a record at most: what is longer is no part of a pose.
pub(super) const MOST: usize = 64;

/// One value of a record.
#[derive(Debug, Clone, Copy)]
pub(super) enum Cell<'a> {
    Number(f64),
    Whole(i64),
    Word(&'a str),
    Nothing,
}

/// Values of a record under one name.
pub(super) struct Part<'a> {
    /// Names from the record down, joined by points.
    pub name: String,
    pub cells: Vec<Cell<'a>>,
    /// Whether it is a pose whatever its name.
    pub is_pose: bool,
}

/// Makes the parts of a record by its place.
type Records<'a> = Box<dyn Fn(usize) -> Vec<Part<'a>> + 'a>;

/// A list whose records may be poses.
pub(super) struct List<'a> {
    /// Its place in the document, names joined by points; empty at the top.
    pub name: String,
    pub length: usize,
    pub record: Records<'a>,
    /// Stamps under which the records stand.
    pub stamps: Option<Vec<&'a str>>,
    /// The unit of the stamps among their values, where these are dates.
    pub unit: Option<StampUnit>,
}

impl Cell<'_> {
    fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Whole(number) => Some(*number as f64),
            Self::Word(word) => word.trim().parse().ok(),
            Self::Nothing => None,
        }
    }

    fn whole(&self) -> Option<i64> {
        match self {
            Self::Whole(number) => Some(*number),
            Self::Word(word) => word.trim().parse().ok(),
            Self::Number(_) | Self::Nothing => None,
        }
    }

    /// Adds it as it is written in a table; what is no number is no value.
    fn put(self, text: &mut String) {
        // Writing to a String cannot fail.
        let _ = match self {
            Self::Number(number) => write!(text, "{number:?}"),
            Self::Whole(number) => write!(text, "{number}"),
            Self::Word(word) if word.trim().parse::<f64>().is_ok() => {
                write!(text, "{}", word.trim())
            }
            Self::Word(word) if dates::nanoseconds(word).is_some() => {
                write!(text, "{}", word.replacen(' ', "T", 1))
            }
            Self::Word(_) | Self::Nothing => write!(text, "nan"),
        };
    }
}

/// Reads the one list that holds poses. `lines` are those of the file where each record has its own.
pub(super) fn read(
    path: &Path,
    lists: Vec<List<'_>>,
    lines: Option<&[usize]>,
    format: Format,
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    let (list, shape) = one(path, lists, format, options)?;
    let mut options = options.clone();
    // Of columns that the user says nobody knows whether they are these stamps.
    let unit = list.unit.filter(|_| options.columns.is_none());
    options.stamp_unit = options.stamp_unit.or(unit).or(shape.stamp_unit());
    options.topics.clear();
    let text = shape.table(&list);
    let headers = usize::from(shape.has_header());
    let mut log = read_table(path, &text, headers, lines, format, &options)?;
    // What is said of the columns of the table says nothing of the file.
    let remarks = &mut log.report.remarks;
    remarks.retain(|remark| remark.kind != RemarkKind::Columns);
    if !shape.words.is_empty() {
        remarks.push(Remark::new(RemarkKind::Columns, &*shape.words).option(ReadOption::Columns));
    }
    Ok(log)
}

/// Whether some list looks like poses, of the topics where these are said.
pub(super) fn any_poses(lists: &[List<'_>], options: &LoadOptions) -> bool {
    let mut shapes = lists.iter().map(|list| Shape::of(list, options));
    shapes.any(|shape| match shape {
        Ok(_) => true,
        Err(NoShape::Bodies(..)) => options.topics.is_empty(),
        Err(NoShape::Names(_)) => false,
    })
}

/// Reads a table below so many lines of header, of which each line is a record, that is a pose or a line of the file.
pub(super) fn read_table(
    path: &Path,
    text: &str,
    headers: usize,
    lines: Option<&[usize]>,
    format: Format,
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    let index = |line: usize| line.saturating_sub(1 + headers);
    let row = |line: u64| match lines {
        Some(lines) => lines
            .get(index(line as usize))
            .map_or(line, |row| *row as u64),
        None => index(line as usize) as u64,
    };
    let read = sheet::read(path, text.as_bytes(), Some(format), None, options);
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

/// The one list that holds poses.
fn one<'a>(
    path: &Path,
    lists: Vec<List<'a>>,
    format: Format,
    options: &LoadOptions,
) -> Result<(List<'a>, Shape), Error> {
    let mut others = Vec::new();
    let mut found: Vec<(List<'a>, Shape)> = Vec::new();
    for list in lists {
        match Shape::of(&list, options) {
            Ok(shape) => found.push((list, shape)),
            Err(NoShape::Names(names)) => others.push(names),
            Err(NoShape::Bodies(words, hint)) => {
                let wanted = "records of one pose";
                let fault = Error::input(path, Place::File, wanted, words, hint);
                return Err(fault.option(ReadOption::Topic));
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
        others.retain(|names| !names.is_empty());
        let words = match others.is_empty() {
            false => format!("the names `{}`", shorten(&others.join(", "))),
            true => "no list of records".to_owned(),
        };
        let expected = format!(
            "{format} with positions and rotations (quaternions, matrices, or roll, pitch and yaw) by names or as matrices"
        );
        let hint = "these names were not understood; say which hold the pose";
        Error::input(path, Place::File, expected, words, hint).option(ReadOption::Columns)
    })
}

impl Shape {
    /// The table: lines of fields, between commas below a header, else between blanks.
    fn table(&self, list: &List<'_>) -> String {
        let between = if self.has_header() { ',' } else { ' ' };
        let mut text = String::new();
        let lead = self.pair.is_some() || self.keys;
        if self.has_header() {
            if lead {
                text.push_str("t,");
            }
            let headers = self.columns.iter().map(|column| plain(&column.header));
            text.push_str(&headers.collect::<Vec<_>>().join(","));
            text.push('\n');
        }
        for index in 0..list.length {
            let parts = (list.record)(index);
            let cell = |name: &str, cell: usize| {
                let part = parts.iter().find(|part| part.name == name)?;
                part.cells.get(cell).copied()
            };
            if let Some(([seconds, part], unit)) = &self.pair {
                let whole = |name| cell(name, 0)?.whole();
                let scale = 10_i64.pow(unit.shift().unsigned_abs());
                let nanoseconds = |part: i64| part.checked_mul(scale);
                match (whole(seconds), whole(part).and_then(nanoseconds)) {
                    (Some(seconds), Some(part @ 0..1_000_000_000)) => {
                        // Writing to a String cannot fail.
                        let _ = write!(text, "{seconds}.{part:09}");
                    }
                    _ => Cell::Nothing.put(&mut text),
                }
            } else if self.keys {
                let stamp = list.stamps.as_ref().and_then(|stamps| stamps.get(index));
                stamp
                    .map_or(Cell::Nothing, |stamp| Cell::Word(stamp))
                    .put(&mut text);
            }
            for (at, column) in self.columns.iter().enumerate() {
                if at > 0 || lead {
                    text.push(between);
                }
                let cell = cell(&column.name, column.cell);
                cell.unwrap_or(Cell::Nothing).put(&mut text);
            }
            text.push('\n');
        }
        text
    }
}

/// A name that cannot be taken for something else in the header of a table.
fn plain(name: &str) -> String {
    let odd = |c: char| c.is_control() || ",;\"#%".contains(c);
    let name: String = name.chars().map(|c| if odd(c) { '_' } else { c }).collect();
    match name.trim().is_empty() || name.trim().parse::<f64>().is_ok() {
        true => format!("n{name}"),
        false => name,
    }
}
