//! One line of numbers, with errors that name the line and the column.

use std::path::Path;

use super::numbers::{StampFault, decimal};
use super::text::Line;
use crate::error::Place;
use crate::{Error, StampUnit};

/// Coordinates beyond this many metres are no pose log (UTM and Earth-centred ones stay below 1e7).
const LARGEST_COORDINATE: f64 = 1e9;

/// The fields of one line.
pub(crate) struct Row<'a> {
    path: &'a Path,
    line: usize,
    unterminated: bool,
    fields: Vec<&'a str>,
}

impl<'a> Row<'a> {
    /// Splits the line at white space.
    pub fn spaces(path: &'a Path, line: &Line<'a>) -> Self {
        let fields = line.text.split_ascii_whitespace().collect();
        Self::new(path, line.number, line.unterminated, fields)
    }

    /// A row of line `line` (counted from 1) from its fields; `unterminated` as in [`Line`].
    pub fn new(path: &'a Path, line: usize, unterminated: bool, fields: Vec<&'a str>) -> Self {
        Self {
            path,
            line,
            unterminated,
            fields,
        }
    }

    /// The fields, without outer white space.
    pub fn fields(&self) -> &[&'a str] {
        &self.fields
    }

    /// Where the row is.
    pub fn place(&self) -> Place {
        Place::Line(self.line)
    }

    /// Number of fields.
    pub fn len(&self) -> usize {
        self.fields.len()
    }

    /// True for the last line of a file that ends within it: fewer than `columns` fields, or a last field
    /// that is the beginning of a number. Such a line is what a crash or a full disk leaves behind.
    pub fn is_cut_off(&self, columns: usize) -> bool {
        let last_is_broken = || match self.fields.last() {
            Some(last) => {
                let begins_like_a_number = last
                    .bytes()
                    .all(|byte| byte.is_ascii_digit() || b"+-.eE".contains(&byte));
                begins_like_a_number && last.parse::<f64>().is_err()
            }
            None => true,
        };
        self.unterminated
            && (self.fields.len() < columns || self.fields.len() == columns && last_is_broken())
    }

    /// The error for a row with the wrong number of fields.
    pub fn wrong_length(&self, expected: impl Into<String>, hint: &str) -> Error {
        let found = format!(
            "{} in `{}`",
            self.fields.len(),
            shorten(&self.fields.join(" "))
        );
        Error::input(self.path, self.place(), expected, found, hint)
    }

    /// The finite number in a column (counted from 0); `name` is for the message.
    pub fn number(&self, column: usize, name: &str) -> Result<f64, Error> {
        let field = self.field(column, name)?;
        match field.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(_) => Err(Error::input(
                self.path,
                self.place(),
                format!("a finite number for {name} (column {})", column + 1),
                format!("`{}`", shorten(field)),
                "remove the poses without a value; with stamps the hole is then seen as a gap, \
                 without stamps cut the file there",
            )),
            Err(_) => Err(Error::input(
                self.path,
                self.place(),
                format!("a number for {name} (column {})", column + 1),
                format!("`{}`", shorten(field)),
                "is this the right file and format? --format chooses another one",
            )),
        }
    }

    /// A coordinate in metres, bounded so that no later sum or square overflows.
    pub fn coordinate(&self, column: usize, name: &str) -> Result<f64, Error> {
        let value = self.number(column, name)?;
        check_coordinate(self.path, self.place(), value)?;
        Ok(value)
    }

    /// The stamp in a column in nanoseconds.
    pub fn stamp(&self, column: usize, unit: StampUnit) -> Result<i64, Error> {
        let field = self.field(column, "the stamp")?;
        let words = match unit {
            StampUnit::Seconds => "a stamp in seconds",
            StampUnit::Milliseconds => "a stamp in whole milliseconds",
            StampUnit::Microseconds => "a stamp in whole microseconds",
            StampUnit::Nanoseconds => "a stamp in whole nanoseconds",
        };
        let fault = |hint: &str| {
            Err(Error::input(
                self.path,
                self.place(),
                words,
                format!("`{}`", shorten(field)),
                hint,
            ))
        };
        if unit != StampUnit::Seconds
            && !field
                .bytes()
                .all(|byte| byte.is_ascii_digit() || byte == b'-')
        {
            return fault("stamps with a decimal point are seconds; a TUM file has those");
        }
        match decimal(field, unit.shift()) {
            Ok(stamp) => Ok(stamp),
            Err(StampFault::NotANumber) => {
                fault("is this the right file and format? --format chooses another one")
            }
            Err(StampFault::OutOfRange) => fault(
                "the number is too large for this unit; are these milli-, micro- or nanoseconds?",
            ),
        }
    }

    fn field(&self, column: usize, name: &str) -> Result<&'a str, Error> {
        self.fields.get(column).copied().ok_or_else(|| {
            self.wrong_length(
                format!("{name} in column {}", column + 1),
                "the line is cut off; remove it or repair it",
            )
        })
    }
}

/// Refuses coordinates that no log on Earth has.
pub(crate) fn check_coordinate(path: &Path, place: Place, value: f64) -> Result<(), Error> {
    if value.abs() > LARGEST_COORDINATE {
        return Err(Error::input(
            path,
            place,
            "a coordinate in metres below 1e9",
            format!("{value:e}"),
            "the unit is another one or the file is damaged",
        ));
    }
    Ok(())
}

/// The beginning of a text, for messages.
pub(crate) fn shorten(text: &str) -> String {
    const LIMIT: usize = 60;
    if text.chars().count() <= LIMIT {
        return text.to_owned();
    }
    text.chars().take(LIMIT).chain("...".chars()).collect()
}
