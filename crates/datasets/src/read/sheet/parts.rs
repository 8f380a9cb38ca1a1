//! A text taken apart in pieces on the threads of the current pool; the log does not depend on their number.

use std::path::Path;

use dose3_lie::Pose;
use rayon::prelude::*;

use super::plain::Numbers;
use super::rows::{Time, parse_row, plain_row};
use super::settle::Clock;
use crate::error::Place;
use crate::read::collect::Collector;
use crate::read::layout::{Layout, is_comment};
use crate::read::table::{Row, after_point};
use crate::read::text::Line;
use crate::{Error, LoadReport, LostKind};

/// Bytes that make a piece of their own worth it.
const PIECE: usize = 1 << 20;
/// Beyond this many pieces, the file comes slower than it is taken apart.
const MOST_PIECES: usize = 8;
/// Rows before a last line that is perhaps cut off whose digits are compared with its.
const ROWS_OF_TAIL: usize = 1000;

/// What is to be read.
#[derive(Clone, Copy)]
pub(super) enum Rows<'a> {
    /// Whole lines, behind so many others of the file.
    Text(&'a str, usize),
    /// Lines of data.
    Lines(&'a [Line<'a>]),
}

/// How the rows of a file are read.
#[derive(Clone, Copy)]
pub(super) struct Reader<'r> {
    pub path: &'r Path,
    pub layout: &'r Layout,
    pub clock: Clock,
}

/// Rows of a piece, up to the first that cannot be read.
#[derive(Default)]
struct Part {
    /// The line of each pose, from the first of the piece.
    rows: Vec<u64>,
    times: Vec<Time>,
    poses: Vec<Pose>,
    lost: Vec<Lost>,
    /// Lines of the piece.
    lines: usize,
    repairs: LoadReport,
    fault: Option<Error>,
}

/// A row without a pose.
struct Lost {
    /// Poses of the piece before it.
    before: usize,
    row: u64,
    time: Time,
    kind: LostKind,
}

impl Reader<'_> {
    /// Reads all rows into the collector.
    pub fn read(&self, rows: Rows<'_>, collector: &mut Collector<'_>) -> Result<(), Error> {
        let tail = self.digits_of_tail(rows);
        let (parts, mut before) = match rows {
            Rows::Lines(lines) => (vec![self.lines(lines, tail, collector.part())], 0),
            Rows::Text(text, before) => {
                let threads = rayon::current_num_threads().min(MOST_PIECES);
                let pieces = pieces(text, (text.len() / PIECE).clamp(1, threads));
                let parse = |(index, piece): (usize, &&str)| {
                    // The first part becomes the log.
                    let expected = if index == 0 { text.len() } else { piece.len() };
                    self.text(piece, expected, tail, collector.part())
                };
                let parts = if pieces.len() == 1 {
                    pieces.iter().enumerate().map(parse).collect()
                } else {
                    pieces.par_iter().enumerate().map(parse).collect()
                };
                (parts, before)
            }
        };
        for part in parts {
            let lines = part.lines;
            self.take(part, before, collector)?;
            before += lines;
        }
        Ok(())
    }

    /// Reads whole lines; `expected` bytes will go into the same columns.
    fn text(
        &self,
        text: &str,
        expected: usize,
        tail: Option<usize>,
        mut collector: Collector<'_>,
    ) -> Part {
        let mut part = Part::default();
        let mut numbers = Numbers::new();
        let mut at = 0;
        while at < text.len() {
            part.lines += 1;
            let rest = &text[at..];
            if let Some(length) = numbers.take(rest, self.layout.separator)
                && rest.as_bytes()[length - 1] == b'\n'
                && let Some((time, pose)) =
                    plain_row(self.path, &numbers, self.layout, self.clock, &mut collector)
            {
                if part.poses.is_empty() {
                    // An eighth more, since numbers differ in length.
                    part.reserve(expected / length + expected / length / 8 + 1);
                }
                part.push(part.lines as u64, time, pose);
                at += length;
                continue;
            }
            let length = rest.find('\n').map_or(rest.len(), |end| end + 1);
            let line = Line {
                number: part.lines,
                text: rest[..length].trim(),
                unterminated: !rest[..length].ends_with('\n'),
            };
            at += length;
            if !line.text.is_empty()
                && !is_comment(line.text)
                && let Err(fault) = self.general(&line, tail, &mut part, &mut collector)
            {
                part.fault = Some(fault);
                break;
            }
        }
        part.repairs = collector.report;
        part
    }

    /// Reads lines of data.
    fn lines(&self, lines: &[Line<'_>], tail: Option<usize>, mut collector: Collector<'_>) -> Part {
        let mut part = Part::default();
        let mut numbers = Numbers::new();
        part.reserve(lines.len());
        for line in lines {
            if !line.unterminated
                && numbers.take(line.text, self.layout.separator) == Some(line.text.len())
                && let Some((time, pose)) =
                    plain_row(self.path, &numbers, self.layout, self.clock, &mut collector)
            {
                part.push(line.number as u64, time, pose);
            } else if let Err(fault) = self.general(line, tail, &mut part, &mut collector) {
                part.fault = Some(fault);
                break;
            }
        }
        part.repairs = collector.report;
        part
    }

    /// Reads a line of any kind.
    fn general(
        &self,
        line: &Line<'_>,
        tail: Option<usize>,
        part: &mut Part,
        collector: &mut Collector<'_>,
    ) -> Result<(), Error> {
        let mut fields = Vec::with_capacity(self.layout.columns);
        self.layout.separator.split(line.text, &mut fields);
        let row = Row::new(self.path, line, &fields);
        if row.is_cut_off(self.layout.columns, tail) {
            collector.report.truncated_tail += 1;
            return Ok(());
        }
        if self.layout.shared && self.layout.has_no_pose(&row) {
            return Ok(());
        }
        let (time, found) = parse_row(self.path, &row, self.layout, self.clock, collector)?;
        let number = line.number as u64;
        match (found, time) {
            (Ok(_), Time::Missing) => part.lose(number, time, LostKind::Nan),
            (Ok(pose), time) => part.push(number, time, pose),
            (Err(kind), time) => part.lose(number, time, kind),
        }
        Ok(())
    }

    /// Adds a part, behind so many lines of the file, to the log.
    fn take(
        &self,
        mut part: Part,
        before: usize,
        collector: &mut Collector<'_>,
    ) -> Result<(), Error> {
        collector.add_repairs(&part.repairs);
        for row in &mut part.rows {
            *row += before as u64;
        }
        let format = self.layout.format;
        if part.lost.is_empty()
            && let Some((stamps, index)) = self.stamps(&part.times, collector)
            && collector.follows(&stamps)
        {
            collector.append(stamps, &mut part.rows, &mut part.poses, index);
        } else {
            let mut lost = part.lost.iter().peekable();
            for index in 0..=part.poses.len() {
                while let Some(lost) = lost.next_if(|lost| lost.before == index) {
                    let row = lost.row + before as u64;
                    let stamp = stamp(lost.time, format, collector);
                    collector.lose(Place::Line(row as usize), row, stamp, lost.kind)?;
                }
                if let Some(pose) = part.poses.get(index)
                    && let Some(stamp) = stamp(part.times[index], format, collector)
                {
                    let row = part.rows[index];
                    collector.push_row(Place::Line(row as usize), row, stamp, *pose)?;
                }
            }
        }
        match part.fault {
            Some(fault) => Err(behind(fault, before)),
            None => Ok(()),
        }
    }

    /// The stamps of rows that all have one, or none has one, and the place of the first among the rows of the file.
    fn stamps(
        &self,
        times: &[Time],
        collector: &Collector<'_>,
    ) -> Option<(Vec<i64>, Option<usize>)> {
        if times.first() == Some(&Time::Row) {
            let first = collector.seen();
            return Some((
                collector.nominal_stamps(self.layout.format, first..first + times.len()),
                Some(first),
            ));
        }
        let stamp = |time: &Time| match time {
            Time::At(stamp) => Some(*stamp),
            _ => None,
        };
        Some((times.iter().map(stamp).collect::<Option<_>>()?, None))
    }

    /// Characters behind the point of the last fields of the rows before a last line without a line end, where they agree.
    fn digits_of_tail(&self, rows: Rows<'_>) -> Option<usize> {
        let texts: Vec<&str> = match rows {
            Rows::Lines(lines) => {
                let (last, before) = lines.split_last()?;
                if !last.unterminated {
                    return None;
                }
                let before = before.iter().rev().take(ROWS_OF_TAIL);
                before.map(|line| line.text).collect()
            }
            Rows::Text(text, _) if !text.ends_with('\n') => {
                let before = text.trim_end().rsplit('\n').skip(1).map(str::trim);
                let data = before.filter(|line| !line.is_empty() && !is_comment(line));
                data.take(ROWS_OF_TAIL).collect()
            }
            Rows::Text(..) => return None,
        };
        let mut fields = Vec::new();
        let mut digits = texts.iter().map(|text| {
            self.layout.separator.split(text, &mut fields);
            fields.last().map_or(0, |last| after_point(last))
        });
        let first = digits.next()?;
        (texts.len() > 2 && digits.all(|other| other == first)).then_some(first)
    }
}

impl Part {
    fn reserve(&mut self, rows: usize) {
        self.rows.reserve(rows);
        self.times.reserve(rows);
        self.poses.reserve(rows);
    }

    fn push(&mut self, row: u64, time: Time, pose: Pose) {
        self.rows.push(row);
        self.times.push(time);
        self.poses.push(pose);
    }

    fn lose(&mut self, row: u64, time: Time, kind: LostKind) {
        self.lost.push(Lost {
            before: self.poses.len(),
            row,
            time,
            kind,
        });
    }
}

/// The stamp of the next row.
fn stamp(time: Time, format: crate::Format, collector: &mut Collector<'_>) -> Option<i64> {
    match time {
        Time::Missing => None,
        Time::At(stamp) => Some(stamp),
        Time::Row => Some(collector.next_nominal(format)),
        Time::Index(index) => Some(collector.nominal(format, index)),
    }
}

/// Whole lines, in about so many pieces of equal size.
fn pieces(text: &str, count: usize) -> Vec<&str> {
    let mut pieces = Vec::with_capacity(count);
    let (mut rest, size) = (text, text.len().div_ceil(count));
    while rest.len() > size {
        let ends = &rest.as_bytes()[size - 1..];
        let Some(end) = ends.iter().position(|byte| *byte == b'\n') else {
            break;
        };
        let (piece, behind) = rest.split_at(size + end);
        pieces.push(piece);
        rest = behind;
    }
    if !rest.is_empty() {
        pieces.push(rest);
    }
    pieces
}

/// A fault that counts its lines from behind so many others.
fn behind(mut fault: Error, lines: usize) -> Error {
    if let Error::Input(input) = &mut fault
        && let Place::Line(line) = &mut input.place
    {
        *line += lines;
    }
    fault
}
