//! The two tables of a ROS 2 bag in SQLite, read straight from the pages (<https://sqlite.org/fileformat2.html>).
//!
//! Only leaves of the tables are read, and of a message only the part in its leaf unless it is wanted, so images cost
//! nothing; and no C library is needed.

use std::collections::{HashMap, HashSet};

use super::container::{Channel, Encoding, Fault, Visitor, plain_kind};
use super::data::Data;

/// Deepest tree: each level has at least two children.
const DEEPEST: usize = 40;
/// Longest message.
const LONGEST: u64 = 256 << 20;

/// An open file.
pub(crate) struct Recording<'a> {
    data: Data<'a>,
    page: u64,
    usable: u64,
    messages: u32,
    pub channels: Vec<Channel>,
}

/// A value of a row.
enum Value {
    Integer(i64),
    Bytes(Vec<u8>),
    Other,
}

fn damaged(found: &str) -> Fault {
    Fault::Damaged(found.to_owned())
}

/// The big-endian number of variable length at the front, and its length.
fn varint(bytes: &[u8]) -> Option<(u64, usize)> {
    let mut value = 0_u64;
    for (index, byte) in bytes.iter().take(9).enumerate() {
        if index == 8 {
            return Some((value << 8 | u64::from(*byte), 9));
        }
        value = value << 7 | u64::from(byte & 0x7f);
        if byte & 0x80 == 0 {
            return Some((value, index + 1));
        }
    }
    None
}

/// A row of a table, its payload partly on other pages.
struct Cell<'c> {
    rowid: i64,
    length: u64,
    local: &'c [u8],
    overflow: u32,
}

impl<'a> Recording<'a> {
    pub fn open(data: Data<'a>) -> Result<Self, Fault> {
        let head = data.read(0, 100)?.into_owned();
        let page = match u16::from_be_bytes([head[16], head[17]]) {
            1 => 65_536,
            size => u64::from(size),
        };
        let usable = page.saturating_sub(u64::from(head[20]));
        if page < 512 || usable < 480 {
            return Err(damaged("pages of an impossible size"));
        }
        let mut recording = Self {
            data,
            page,
            usable,
            messages: 0,
            channels: Vec::new(),
        };
        let (mut topics, mut messages) = (None, None);
        recording.rows(1, &mut |recording, cell| {
            let row = recording.values(cell, 4)?;
            if let [
                Value::Bytes(kind),
                Value::Bytes(name),
                _,
                Value::Integer(root),
            ] = &row[..]
                && kind == b"table"
            {
                match name.as_slice() {
                    b"topics" => topics = u32::try_from(*root).ok(),
                    b"messages" => messages = u32::try_from(*root).ok(),
                    _ => {}
                }
            }
            Ok(())
        })?;
        let (Some(topics), Some(messages)) = (topics, messages) else {
            return Err(damaged(
                "an SQLite file without the tables `topics` and `messages`",
            ));
        };
        recording.messages = messages;
        let mut channels = Vec::new();
        recording.rows(topics, &mut |recording, cell| {
            let row = recording.values(cell, 4)?;
            let text = |value: Option<&Value>| match value {
                Some(Value::Bytes(bytes)) => String::from_utf8_lossy(bytes).into_owned(),
                _ => String::new(),
            };
            channels.push(Channel {
                id: cell.rowid as u32,
                topic: text(row.get(1)),
                kind: plain_kind(&text(row.get(2))),
                encoding: match text(row.get(3)).as_str() {
                    "cdr" => Encoding::Cdr,
                    _ => Encoding::Other,
                },
                messages: None,
            });
            Ok(())
        })?;
        recording.channels = channels;
        Ok(recording)
    }

    pub fn messages(&self, wanted: &HashSet<u32>, visit: &mut Visitor<'_>) -> Result<(), Fault> {
        self.rows(self.messages, &mut |recording, cell| {
            let front = recording.values(cell, 3)?;
            let (Some(Value::Integer(topic)), Some(Value::Integer(time))) =
                (front.get(1), front.get(2))
            else {
                return Err(damaged("a message without topic or time"));
            };
            if !wanted.contains(&(*topic as u32)) {
                return Ok(());
            }
            match recording.values(cell, 4)?.pop() {
                Some(Value::Bytes(content)) => visit(*topic as u32, *time, &content),
                _ => Err(damaged("a message without content")),
            }
        })
    }

    /// Messages of each topic, by number.
    pub fn counts(&self) -> HashMap<u32, u64> {
        let mut counts = HashMap::new();
        let result = self.rows(self.messages, &mut |recording, cell| {
            if let Some(Value::Integer(topic)) = recording.values(cell, 2)?.pop() {
                *counts.entry(topic as u32).or_default() += 1;
            }
            Ok(())
        });
        // A listing of a damaged file tells what is there.
        result.map_or(HashMap::new(), |()| counts)
    }

    fn page(&self, number: u32) -> Result<std::borrow::Cow<'_, [u8]>, Fault> {
        let index = u64::from(number)
            .checked_sub(1)
            .ok_or_else(|| damaged("page 0"))?;
        let start = index * self.page;
        Ok(self
            .data
            .read(start, self.page.min(self.data.len().saturating_sub(start)))?)
    }

    /// The rows of a table in order.
    fn rows(
        &self,
        root: u32,
        visit: &mut dyn FnMut(&Self, &Cell<'_>) -> Result<(), Fault>,
    ) -> Result<(), Fault> {
        // Pages yet to be seen, the next one last; each page is seen once, so that a loop ends.
        let mut left = self.data.len() / self.page + 1;
        // Rows do not overlap, so that together they are no longer than the file.
        let mut bytes_left = self.data.len();
        let mut stack = vec![(root, 0)];
        while let Some((number, depth)) = stack.pop() {
            left = left
                .checked_sub(1)
                .ok_or_else(|| damaged("a tree that runs in circles"))?;
            if depth > DEEPEST {
                return Err(damaged("a tree that is too deep"));
            }
            let page = self.page(number)?;
            let start = if number == 1 { 100 } else { 0 };
            let u16_at = |at: usize| {
                page.get(at..at + 2)
                    .map(|pair| usize::from(u16::from_be_bytes([pair[0], pair[1]])))
            };
            let u32_at = |at: usize| {
                page.get(at..at + 4)
                    .map(|four| u32::from_be_bytes([four[0], four[1], four[2], four[3]]))
            };
            let short = || damaged("a page that is cut off");
            let kind = *page.get(start).ok_or_else(short)?;
            let cells = u16_at(start + 3).ok_or_else(short)?;
            match kind {
                0x05 => {
                    stack.push((u32_at(start + 8).ok_or_else(short)?, depth + 1));
                    for index in (0..cells).rev() {
                        let at = u16_at(start + 12 + 2 * index).ok_or_else(short)?;
                        stack.push((u32_at(at).ok_or_else(short)?, depth + 1));
                    }
                }
                0x0d => {
                    for index in 0..cells {
                        let at = u16_at(start + 8 + 2 * index).ok_or_else(short)?;
                        let cell = self.cell(&page, at).ok_or_else(short)?;
                        bytes_left = bytes_left
                            .checked_sub(cell.length)
                            .ok_or_else(|| damaged("rows that are longer than the file"))?;
                        visit(self, &cell)?;
                    }
                }
                _ => return Err(damaged("a page that is no part of a table")),
            }
        }
        Ok(())
    }

    fn cell<'c>(&self, page: &'c [u8], at: usize) -> Option<Cell<'c>> {
        let (length, one) = varint(page.get(at..)?)?;
        let (rowid, two) = varint(page.get(at + one..)?)?;
        let start = at + one + two;
        let most = self.usable - 35;
        let local = if length <= most {
            length
        } else {
            let least = (self.usable - 12) * 32 / 255 - 23;
            let rest = least + (length - least) % (self.usable - 4);
            if rest <= most { rest } else { least }
        };
        let bytes = page.get(start..start + local as usize)?;
        let overflow = if local < length {
            let four = page.get(start + local as usize..start + local as usize + 4)?;
            u32::from_be_bytes([four[0], four[1], four[2], four[3]])
        } else {
            0
        };
        Some(Cell {
            rowid: rowid as i64,
            length,
            local: bytes,
            overflow,
        })
    }

    /// The first `count` values of a row.
    fn values(&self, cell: &Cell<'_>, count: usize) -> Result<Vec<Value>, Fault> {
        let broken = || damaged("a damaged row");
        let (header, used) = varint(cell.local).ok_or_else(broken)?;
        let header = usize::try_from(header)
            .ok()
            .filter(|end| *end <= cell.local.len())
            .ok_or_else(broken)?;
        let mut at = used;
        let mut place = header;
        let mut values = Vec::new();
        let mut whole: Option<Vec<u8>> = None;
        while at < header && values.len() < count {
            let (serial, length) = varint(&cell.local[at..header]).ok_or_else(broken)?;
            at += length;
            let size = match serial {
                0 | 8 | 9 => 0,
                1..=4 => serial as usize,
                5 => 6,
                6 | 7 => 8,
                12.. => usize::try_from((serial - 12) / 2).map_err(|_| broken())?,
                _ => return Err(broken()),
            };
            let end = place.checked_add(size).ok_or_else(broken)?;
            let bytes = match cell.local.get(place..end) {
                Some(bytes) => bytes,
                None => {
                    if whole.is_none() {
                        whole = Some(self.payload(cell)?);
                    }
                    whole
                        .as_deref()
                        .and_then(|all| all.get(place..end))
                        .ok_or_else(broken)?
                }
            };
            place = end;
            values.push(match serial {
                8 => Value::Integer(0),
                9 => Value::Integer(1),
                1..=6 => {
                    let negative = bytes[0] & 0x80 != 0;
                    let start = if negative { -1_i64 } else { 0 };
                    Value::Integer(
                        bytes
                            .iter()
                            .fold(start, |value, byte| value << 8 | i64::from(*byte)),
                    )
                }
                12.. => Value::Bytes(bytes.to_vec()),
                _ => Value::Other,
            });
        }
        Ok(values)
    }

    /// The whole payload of a row, from its chain of pages.
    fn payload(&self, cell: &Cell<'_>) -> Result<Vec<u8>, Fault> {
        if cell.length > LONGEST.min(self.data.len()) {
            return Err(damaged("a row that is longer than the file"));
        }
        let mut all = cell.local.to_vec();
        let mut next = cell.overflow;
        while (all.len() as u64) < cell.length {
            if next == 0 {
                return Err(damaged("a row that ends too early"));
            }
            let page = self.page(next)?;
            let body = page
                .get(..self.usable as usize)
                .ok_or_else(|| damaged("a page that is cut off"))?;
            next = u32::from_be_bytes([body[0], body[1], body[2], body[3]]);
            let left = (cell.length as usize - all.len()).min(body.len() - 4);
            all.extend_from_slice(&body[4..4 + left]);
        }
        Ok(all)
    }
}
