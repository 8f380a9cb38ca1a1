//! Comma-separated text as rows with their line numbers.

use std::path::Path;

use csv::{Reader, ReaderBuilder, StringRecord, Terminator};

use super::table::Row;
use super::text::Text;
use crate::Error;
use crate::error::Place;

/// The rows of a comma-separated text that are not blank, one at a time.
pub(crate) struct Records<'a> {
    path: &'a Path,
    reader: Reader<&'a [u8]>,
    record: StringRecord,
    bytes: u64,
    ends_in_line_end: bool,
}

impl<'a> Records<'a> {
    pub fn new(path: &'a Path, text: &'a Text) -> Self {
        let content = text.as_str();
        // A line is a row, whatever it holds: no quotes, so that a stray one in a damaged line cannot swallow
        // the lines after it, and rows of any length, so that the readers say what is wrong with them.
        let reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .quoting(false)
            .terminator(Terminator::Any(b'\n'))
            .from_reader(content.as_bytes());
        Self {
            path,
            reader,
            record: StringRecord::new(),
            bytes: content.len() as u64,
            ends_in_line_end: content.ends_with('\n'),
        }
    }

    /// The next row, its fields without outer white space; `None` after the last one.
    pub fn next_row(&mut self) -> Result<Option<Row<'_>>, Error> {
        while self.read()? {
            if self.record.iter().all(|field| field.trim().is_empty()) && self.record.len() < 2 {
                continue;
            }
            // The reader stands after the row. Before it would not do: blank lines are skipped from there.
            let position = self.reader.position();
            let terminated = position.byte() < self.bytes || self.ends_in_line_end;
            let line = position.line() - u64::from(terminated);
            let fields = self.record.iter().map(str::trim).collect();
            return Ok(Some(Row::new(
                self.path,
                line as usize,
                !terminated,
                fields,
            )));
        }
        Ok(None)
    }

    fn read(&mut self) -> Result<bool, Error> {
        self.reader.read_record(&mut self.record).map_err(|fault| {
            Error::input(
                self.path,
                Place::Line(self.reader.position().line() as usize),
                "comma-separated values",
                fault.to_string(),
                "is this the right file and format? --format chooses another one",
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LoadReport;

    /// Number, end and fields of every row.
    fn rows(content: &str) -> Vec<(usize, bool, Vec<String>)> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, content).unwrap();
        let text = Text::read(&path, &mut LoadReport::default()).unwrap();
        let mut records = Records::new(&path, &text);
        let mut rows = Vec::new();
        while let Some(row) = records.next_row().unwrap() {
            let Place::Line(line) = row.place() else {
                panic!("{:?}", row.place())
            };
            // Cut off: fewer than the asked-for columns on a line without an end.
            let unterminated = row.is_cut_off(usize::MAX);
            let fields = row.fields().iter().map(ToString::to_string).collect();
            rows.push((line, unterminated, fields));
        }
        rows
    }

    #[test]
    fn rows_know_their_line_whatever_is_blank_before_them() {
        let fields = |text: &str| text.split('|').map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(
            rows("\u{feff}\n\r\na, b\r\n\n \t\n\n1,\"2\n3 ,4\", \n\n,"),
            [
                (3, false, fields("a|b")),
                (7, false, fields("1|\"2")),
                (8, false, fields("3|4\"|")),
                (10, true, fields("|")),
            ]
        );
        assert_eq!(rows("1,2\n3,4\n").last().unwrap().0, 2);
        assert_eq!(rows("1,2\n3,4\n \n").last().unwrap().0, 2);
        assert_eq!(
            rows("1,2\n3,4\n  ").last().unwrap(),
            &(2, false, fields("3|4"))
        );
    }
}
