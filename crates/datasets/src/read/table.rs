//! One line of numbers, with errors that name the line and the column.

use std::path::Path;

use super::dates;
use super::numbers::{StampFault, decimal, float};
use super::text::Line;
use crate::error::Place;
use crate::{Error, ReadOption, StampUnit};

/// Coordinates beyond this many metres are no pose log (UTM and Earth-centred ones stay below 1e7).
pub(crate) const LARGEST_COORDINATE: f64 = 1e9;

/// How fields are separated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Separator {
    /// Any number of blanks and tabs.
    Blanks,
    /// One character.
    Character(char),
}

impl Separator {
    /// The separator of a line: semicolon, tab or comma where it has several or a name at one, else blanks.
    ///
    /// A comma between digits in a line with blanks is a decimal comma.
    pub fn of(line: &str) -> Self {
        if line.contains(';') {
            Self::Character(';')
        } else if line.contains('\t') && !line.contains(',') {
            Self::Character('\t')
        } else if line.contains(',') && !decimal_commas(line) {
            Self::Character(',')
        } else {
            Self::Blanks
        }
    }

    /// The fields of a line without outer white space and quotes.
    pub fn split<'a>(self, line: &'a str, fields: &mut Vec<&'a str>) {
        fields.clear();
        match self {
            Self::Blanks => split_blanks(line, fields),
            Self::Character(character)
                if line.contains('"') && line.matches('"').count().is_multiple_of(2) =>
            {
                split_quoted(line, character, fields);
            }
            Self::Character(character) => {
                fields.extend(line.split(character).map(str::trim));
            }
        }
    }

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Blanks => "spaces",
            Self::Character(';') => "semicolons",
            Self::Character('\t') => "tabs",
            Self::Character(_) => "commas",
        }
    }
}

/// As `split_ascii_whitespace`, a byte at a time.
fn split_blanks<'a>(line: &'a str, fields: &mut Vec<&'a str>) {
    let mut start = None;
    for (at, byte) in line.bytes().enumerate() {
        // Blanks are single bytes, so every cut lies between characters.
        match (byte, start) {
            (b' ' | b'\t' | b'\r' | b'\n' | 0x0c, Some(from)) => {
                fields.push(&line[from..at]);
                start = None;
            }
            (b' ' | b'\t' | b'\r' | b'\n' | 0x0c, None) => {}
            (_, None) => start = Some(at),
            (_, Some(_)) => {}
        }
    }
    fields.extend(start.map(|from| &line[from..]));
}

/// Fields between separators, of which those within quotes are none.
fn split_quoted<'a>(line: &'a str, separator: char, fields: &mut Vec<&'a str>) {
    let (mut quoted, mut start) = (false, 0);
    for (at, character) in line.char_indices() {
        if character == '"' {
            quoted = !quoted;
        } else if character == separator && !quoted {
            fields.push(unquoted(line[start..at].trim()));
            start = at + character.len_utf8();
        }
    }
    fields.push(unquoted(line[start..].trim()));
}

/// True where every field between blanks is a number with one comma in it.
fn decimal_commas(line: &str) -> bool {
    let mut fields = line.split_ascii_whitespace().peekable();
    let number = |field: &str| {
        field.matches(',').count() == 1
            && field.split(',').all(|part| !part.is_empty())
            && field
                .bytes()
                .all(|byte| byte.is_ascii_digit() || b",+-eE".contains(&byte))
    };
    line.split_ascii_whitespace().count() > 1 && fields.all(number)
}

fn unquoted(field: &str) -> &str {
    field
        .strip_prefix('"')
        .and_then(|field| field.strip_suffix('"'))
        .unwrap_or(field)
}

/// The fields of one line.
#[derive(Clone, Copy)]
pub(crate) struct Row<'r, 'a> {
    path: &'r Path,
    line: usize,
    unterminated: bool,
    fields: &'r [&'a str],
}

impl<'r, 'a> Row<'r, 'a> {
    /// A row of a line from its fields.
    pub fn new(path: &'r Path, line: &Line<'_>, fields: &'r [&'a str]) -> Self {
        Self {
            path,
            line: line.number,
            unterminated: line.unterminated,
            fields,
        }
    }

    /// The fields, without outer white space.
    pub fn fields(&self) -> &'r [&'a str] {
        self.fields
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
    ///
    /// `digits` is the number of characters after the point that all last fields before have, where they agree.
    pub fn is_cut_off(&self, columns: usize, digits: Option<usize>) -> bool {
        let last_is_broken = || match self.fields.last() {
            Some(last) => {
                let begins_like_a_number = last
                    .bytes()
                    .all(|byte| byte.is_ascii_digit() || b"+-.eE".contains(&byte));
                let shorter = digits.is_some_and(|digits| after_point(last) < digits);
                begins_like_a_number && (shorter || last.parse::<f64>().is_err())
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
        match float(field) {
            Some(value) if value.is_finite() => Ok(value),
            Some(_) => Err(Error::input(
                self.path,
                self.place(),
                format!("a finite number for {name} (column {})", column + 1),
                format!("`{}`", shorten(field)),
                "there is no value; remove the row, or let it count as lost tracking",
            )
            .option(ReadOption::Lost)),
            None => Err(Error::input(
                self.path,
                self.place(),
                format!("a number for {name} (column {})", column + 1),
                format!("`{}`", shorten(field)),
                number_hint(field),
            )
            .option(ReadOption::Format)),
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
            StampUnit::Milliseconds => "a stamp in milliseconds",
            StampUnit::Microseconds => "a stamp in microseconds",
            StampUnit::Nanoseconds => "a stamp in nanoseconds",
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
        match decimal(field, unit.shift()) {
            Ok(stamp) => Ok(stamp),
            Err(StampFault::NotANumber) => {
                if let Some(stamp) = dates::nanoseconds(field) {
                    return Ok(stamp);
                }
                fault("is this the right file and format? Another format can be chosen")
            }
            Err(StampFault::OutOfRange) => fault(
                "the number is too large for this unit; are these milli-, micro- or nanoseconds? Say the unit of the stamps",
            )
            .map_err(|fault| fault.option(ReadOption::StampUnit)),
        }
    }

    /// The field in a column.
    pub fn field(&self, column: usize, name: &str) -> Result<&'a str, Error> {
        self.fields.get(column).copied().ok_or_else(|| {
            self.wrong_length(
                format!("{name} in column {}", column + 1),
                "the line is cut off; remove it or repair it",
            )
        })
    }
}

/// Characters of a number after its point; 0 without one.
pub(crate) fn after_point(field: &str) -> usize {
    field.find('.').map_or(0, |point| field.len() - point - 1)
}

/// True for the words that stand where there is no value: `nan`, `-nan(ind)`, `1.#IND`, `inf`, `null`, nothing.
pub(crate) fn is_no_value(field: &str) -> bool {
    let plain = |byte: &u8| byte.is_ascii_digit() || *byte == b'.';
    if field.len() < 300 && !field.is_empty() && field.bytes().all(|byte| plain(&byte)) {
        return false;
    }
    let word = field.trim_start_matches(['+', '-']).to_ascii_lowercase();
    matches!(
        word.as_str(),
        "" | "nan" | "inf" | "infinity" | "null" | "none" | "na" | "n/a"
    ) || word.starts_with("nan(")
        || word.starts_with("1.#")
        || field.parse::<f64>().is_ok_and(|value| !value.is_finite())
}

fn number_hint(field: &str) -> &'static str {
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    let unsigned = field.trim_start_matches(['+', '-']);
    if unsigned
        .split_once(',')
        .is_some_and(|(a, b)| digits(a) && digits(b))
    {
        return "this is a decimal comma; write numbers with a point";
    }
    if unsigned
        .split_once(['d', 'D'])
        .is_some_and(|(a, _)| a.parse::<f64>().is_ok())
    {
        return "this is a Fortran exponent; write numbers with `e`";
    }
    "is this the right file and format? Another format can be chosen"
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
