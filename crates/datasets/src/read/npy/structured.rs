//! Structured arrays: records of fields with names, as in `[('t', '<f8'), ('position', '<f4', (3,))]`.

use super::{NpyFault, header_bytes};
use crate::StampUnit;
use crate::read::columns::{Name, Role};
use crate::read::records::{Cell, List, MOST, Part};
use crate::read::table::shorten;

/// The end of the length of a header in version 1 of the format.
const LENGTH_END: usize = 10;
/// Fields within fields.
const DEEPEST: usize = 4;

/// The records of one array.
pub(crate) struct Structured<'a> {
    length: usize,
    /// Those of numbers.
    fields: Vec<Field>,
    /// Names and types of the others.
    others: Vec<(String, String)>,
    /// Bytes of a record.
    size: usize,
    data: &'a [u8],
}

/// Numbers under one name.
#[derive(Debug)]
struct Field {
    /// Names from the record down, joined by points.
    name: String,
    /// Its first byte in a record.
    at: usize,
    count: usize,
    number: Number,
}

/// How one number is written.
#[derive(Debug, Clone, Copy)]
struct Number {
    kind: Kind,
    size: usize,
    big_endian: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Float,
    Signed,
    Unsigned,
    Date(StampUnit),
}

impl<'a> Structured<'a> {
    /// The first array of a file where it is one of records; `None` for another.
    pub fn new(bytes: &'a [u8]) -> Option<Result<Self, NpyFault>> {
        let header = header_bytes(bytes).ok()?;
        let text = String::from_utf8_lossy(&header[LENGTH_END..]);
        let (_, descr) = text.split_once("'descr'")?;
        let mut reader = Reader { rest: descr };
        (reader.take(":") && reader.sees("["))
            .then(|| Self::of_header(reader, &bytes[header.len()..]))
    }

    /// From a header behind its key `descr`.
    fn of_header(mut reader: Reader<'_>, data: &'a [u8]) -> Result<Self, NpyFault> {
        let text = reader.rest;
        let damaged = || {
            let found = format!("a damaged header: {}", shorten(text.trim()));
            NpyFault::NotNpy(found)
        };
        let mut found = Self {
            length: 0,
            fields: Vec::new(),
            others: Vec::new(),
            size: 0,
            data: &[],
        };
        found.size = found.add(&mut reader, "", 0, 0).ok_or_else(damaged)?;
        let (_, shape) = reader.rest.split_once("'shape'").ok_or_else(damaged)?;
        reader.rest = shape;
        let shape = reader.take(":").then(|| reader.sizes()).flatten();
        let shape = shape.ok_or_else(damaged)?;
        let [length] = shape[..] else {
            return Err(NpyFault::Records(format!("the shape {shape:?}")));
        };
        if let Some((name, kind)) = found.others.iter().find(|(_, kind)| kind.contains('O')) {
            return Err(NpyFault::Records(format!("`{name}` of dtype `{kind}`")));
        }
        if found.fields.is_empty() {
            return Err(NpyFault::Records("no field of numbers".to_owned()));
        }
        let bytes = length.checked_mul(found.size);
        let bytes = bytes.ok_or_else(|| NpyFault::NotNpy(format!("an impossible shape {shape:?}")));
        found.length = length;
        found.data = data.get(..bytes?).ok_or(NpyFault::Truncated)?;
        Ok(found)
    }

    /// Adds the fields of a list that begin at a byte of the record, below a name; its bytes, `None` for a damaged one.
    fn add(
        &mut self,
        reader: &mut Reader<'_>,
        above: &str,
        at: usize,
        depth: usize,
    ) -> Option<usize> {
        let mut size = 0_usize;
        if depth == DEEPEST || !reader.take("[") {
            return None;
        }
        while !reader.take("]") {
            // A field with a title has it before its name.
            let name = match (reader.take("("), reader.take("(")) {
                (true, true) => {
                    let (_, _, name) = (reader.word()?, reader.must(",")?, reader.word()?);
                    reader.must(")")?;
                    name
                }
                (true, false) => reader.word()?,
                _ => return None,
            };
            reader.must(",")?;
            let is_room = name.is_empty();
            let name = match above {
                "" => name.to_owned(),
                above => format!("{above}.{name}"),
            };
            let start = at.checked_add(size)?;
            let (fields, others) = (self.fields.len(), self.others.len());
            let (one, number, kind) = if reader.sees("[") {
                (self.add(reader, &name, start, depth + 1)?, None, "")
            } else {
                let kind = reader.word()?;
                let (size, number) = element(kind)?;
                (size, number, kind)
            };
            let mut count = 1_usize;
            if reader.take(",") && !reader.sees(")") {
                let sizes = reader.sizes()?;
                count = sizes.into_iter().try_fold(1, usize::checked_mul)?;
            }
            reader.must(")")?;
            match number {
                Some(number) if (1..=MOST).contains(&count) => self.fields.push(Field {
                    name,
                    at: start,
                    count,
                    number,
                }),
                _ if is_room || one == 0 => {}
                // Lists of records.
                None if kind.is_empty() && count != 1 => {
                    self.fields.truncate(fields);
                    self.others.truncate(others);
                    self.others.push((name, "a list of records".to_owned()));
                }
                _ if kind.is_empty() => {}
                _ => self.others.push((name, kind.to_owned())),
            }
            size = size.checked_add(one.checked_mul(count)?)?;
            if !reader.take(",") && !reader.sees("]") {
                return None;
            }
        }
        Some(size)
    }

    /// Refuses records with a field of a pose that is not read.
    pub fn check(&self) -> Result<(), NpyFault> {
        let is_needed = |name: &str| Name::new(name).role().is_some();
        match self.others.iter().find(|(name, _)| is_needed(name)) {
            Some((name, kind)) => {
                let found = format!("`{name}` of dtype `{}`", shorten(kind));
                Err(NpyFault::Records(found))
            }
            None => Ok(()),
        }
    }

    pub fn has_stamps(&self) -> bool {
        self.fields.iter().any(Field::is_stamp)
    }

    /// The records as a list of that name.
    pub fn list(&self, name: &str) -> List<'_> {
        let unit = |field: &Field| match field.number.kind {
            Kind::Date(unit) => Some(unit),
            _ => None,
        };
        let mut stamps = self.fields.iter().filter(|field| field.is_stamp());
        List {
            name: name.to_owned(),
            length: self.length,
            record: Box::new(|index| {
                let record = &self.data[index * self.size..][..self.size];
                self.fields.iter().map(|field| field.part(record)).collect()
            }),
            stamps: None,
            unit: stamps.find_map(unit),
        }
    }
}

impl Field {
    fn is_stamp(&self) -> bool {
        let role = Name::new(&self.name).role();
        role.is_some_and(|(role, _)| matches!(role, Role::Stamp | Role::Seconds))
    }

    fn part(&self, record: &[u8]) -> Part<'static> {
        let length = self.count * self.number.size;
        let numbers = record[self.at..][..length].chunks_exact(self.number.size);
        Part {
            name: self.name.clone(),
            cells: numbers.map(|bytes| self.number.cell(bytes)).collect(),
            is_pose: false,
        }
    }
}

impl Number {
    fn cell(self, bytes: &[u8]) -> Cell<'static> {
        let mut wide = [0; 8];
        wide[..self.size].copy_from_slice(bytes);
        if self.big_endian {
            wide[..self.size].reverse();
        }
        let unsigned = u64::from_le_bytes(wide);
        let beyond = 64 - 8 * self.size;
        let signed = ((unsigned << beyond) as i64) >> beyond;
        match (self.kind, self.size) {
            (Kind::Float, 4) => Cell::Number(f32::from_bits(unsigned as u32).into()),
            (Kind::Float, _) => Cell::Number(f64::from_bits(unsigned)),
            (Kind::Unsigned, _) => i64::try_from(unsigned).map_or(Cell::Nothing, Cell::Whole),
            // The smallest number stands for no date.
            (Kind::Date(_), _) if signed == i64::MIN => Cell::Nothing,
            (Kind::Signed | Kind::Date(_), _) => Cell::Whole(signed),
        }
    }
}

/// Bytes of an element of a dtype such as `<f8`, and how to read it where it is a number that is read; `None` for no dtype.
fn element(dtype: &str) -> Option<(usize, Option<Number>)> {
    let big_endian = dtype.starts_with('>');
    let plain = dtype.trim_start_matches(['<', '>', '=', '|']);
    let kind = plain.chars().next()?;
    let (digits, unit) = match plain[kind.len_utf8()..].split_once('[') {
        Some((digits, unit)) => (digits, unit.strip_suffix(']')?),
        None => (&plain[kind.len_utf8()..], ""),
    };
    let size: usize = match (kind, digits) {
        ('O', "") => 8,
        _ => digits.parse().ok()?,
    };
    let kind = match (kind, size) {
        ('f', 4 | 8) => Some(Kind::Float),
        ('i', 1 | 2 | 4 | 8) => Some(Kind::Signed),
        ('u', 1 | 2 | 4 | 8) => Some(Kind::Unsigned),
        ('M', 8) => StampUnit::ALL
            .into_iter()
            .find(|known| known.symbol() == unit)
            .map(Kind::Date),
        // Characters of four bytes.
        ('U', _) => return Some((size.checked_mul(4)?, None)),
        _ => None,
    };
    let number = kind.map(|kind| Number {
        kind,
        size,
        big_endian,
    });
    Some((size, number))
}

/// What is left of a header, which is a literal of Python.
struct Reader<'t> {
    rest: &'t str,
}

impl<'t> Reader<'t> {
    fn sees(&mut self, mark: &str) -> bool {
        self.rest = self.rest.trim_start();
        self.rest.starts_with(mark)
    }

    /// Takes a mark that may be there.
    fn take(&mut self, mark: &str) -> bool {
        let sees = self.sees(mark);
        if sees {
            self.rest = &self.rest[mark.len()..];
        }
        sees
    }

    fn must(&mut self, mark: &str) -> Option<()> {
        self.take(mark).then_some(())
    }

    /// A text in quotes without any escape.
    fn word(&mut self) -> Option<&'t str> {
        let quote = ["'", "\""].into_iter().find(|quote| self.take(quote))?;
        let (word, rest) = self.rest.split_once(quote)?;
        self.rest = rest;
        (!word.contains('\\')).then_some(word)
    }

    /// `(3,)`, `(3, 3)`, `()` or `3`.
    fn sizes(&mut self) -> Option<Vec<usize>> {
        if !self.take("(") {
            return Some(vec![self.size()?]);
        }
        let mut sizes = Vec::new();
        while !self.take(")") {
            sizes.push(self.size()?);
            if !self.take(",") && !self.sees(")") {
                return None;
            }
        }
        Some(sizes)
    }

    fn size(&mut self) -> Option<usize> {
        self.rest = self.rest.trim_start();
        let end = self.rest.find(|c: char| !c.is_ascii_digit());
        let (digits, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = rest;
        digits.parse().ok()
    }
}
