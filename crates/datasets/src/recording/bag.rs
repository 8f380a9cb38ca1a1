//! ROS 1 bags, version 2.0: records with a header of named fields, chunks of them packed.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::ops::Range;

use super::container::{Channel, Encoding, Fault, Visitor, plain_kind, unpack};
use super::data::{Cursor, Data};

const MAGIC: u64 = 13;
/// Longest header of a record.
const LONGEST_HEADER: u64 = 1 << 20;
/// Longest content of another record: a message with a pose, a packed chunk, an index.
const LONGEST: u64 = 1 << 30;

mod code {
    pub const MESSAGE: u8 = 0x02;
    pub const BAG: u8 = 0x03;
    pub const CHUNK: u8 = 0x05;
    pub const CHUNK_INFO: u8 = 0x06;
    pub const CONNECTION: u8 = 0x07;
}

/// An open bag.
pub(crate) struct Bag<'a> {
    data: Data<'a>,
    pub channels: Vec<Channel>,
    pub damage: Option<String>,
    /// Offsets of the chunks and the connections in each; empty for a bag without an index.
    chunks: Vec<(u64, Vec<u32>)>,
}

struct Record {
    fields: HashMap<String, Vec<u8>>,
    data: Range<u64>,
}

impl Record {
    fn code(&self) -> u8 {
        self.fields
            .get("op")
            .and_then(|field| field.first())
            .copied()
            .unwrap_or(0)
    }

    fn number(&self, name: &str) -> Option<u64> {
        let field = self.fields.get(name)?;
        let mut bytes = [0; 8];
        bytes.get_mut(..field.len())?.copy_from_slice(field);
        Some(u64::from_le_bytes(bytes))
    }

    fn text(&self, name: &str) -> String {
        let field = self.fields.get(name).map_or(&[][..], Vec::as_slice);
        String::from_utf8_lossy(field).into_owned()
    }
}

fn fields(header: &[u8]) -> Option<HashMap<String, Vec<u8>>> {
    let mut cursor = Cursor(header);
    let mut fields = HashMap::new();
    while !cursor.0.is_empty() {
        let field = cursor.block()?;
        let split = field.iter().position(|byte| *byte == b'=')?;
        let name = String::from_utf8_lossy(&field[..split]).into_owned();
        fields.insert(name, field[split + 1..].to_vec());
    }
    Some(fields)
}

/// The record at the front of a range.
fn record(data: &Data<'_>, range: &Range<u64>) -> Result<Record, Fault> {
    let cut = || Fault::Damaged("the end of the file within a record".to_owned());
    let length = |offset: u64| -> Result<u64, Fault> {
        let bytes = data.read_up_to(&(offset..range.end), 4)?;
        Ok(u64::from(Cursor(&bytes).u32().ok_or_else(cut)?))
    };
    let header_length = length(range.start)?;
    if header_length > LONGEST_HEADER {
        return Err(Fault::Damaged(format!("a header of {header_length} bytes")));
    }
    let header_end = range.start + 4 + header_length;
    if header_end + 4 > range.end {
        return Err(cut());
    }
    let header = data.read(range.start + 4, header_length)?;
    let fields =
        fields(&header).ok_or_else(|| Fault::Damaged("a damaged header of a record".to_owned()))?;
    let start = header_end + 4;
    let end = start + length(header_end)?;
    if end > range.end {
        return Err(cut());
    }
    Ok(Record {
        fields,
        data: start..end,
    })
}

/// The content of a record.
fn content<'d>(data: &'d Data<'_>, record: &Record) -> Result<Cow<'d, [u8]>, Fault> {
    let length = record.data.end - record.data.start;
    if length > LONGEST {
        return Err(Fault::Damaged(format!("a record of {length} bytes")));
    }
    Ok(data.read(record.data.start, length)?)
}

type RecordVisitor<'v> = dyn FnMut(&Data<'_>, &Record) -> Result<(), Fault> + 'v;

fn walk(
    data: &Data<'_>,
    mut range: Range<u64>,
    visit: &mut RecordVisitor<'_>,
) -> Result<(), Fault> {
    while range.start < range.end {
        let record = record(data, &range)?;
        range.start = record.data.end;
        visit(data, &record)?;
    }
    Ok(())
}

fn walk_chunk(
    data: &Data<'_>,
    record: &Record,
    visit: &mut RecordVisitor<'_>,
) -> Result<(), Fault> {
    let compression = record.text("compression");
    if compression == "none" {
        return walk(data, record.data.clone(), visit);
    }
    let packed = content(data, record)?;
    let records = unpack(&packed, &compression, record.number("size"))?;
    walk(&Data::Bytes(&records), 0..records.len() as u64, visit)
}

impl<'a> Bag<'a> {
    pub fn open(data: Data<'a>) -> Result<Self, Fault> {
        let first = record(&data, &(MAGIC..data.len()))?;
        if first.code() != code::BAG {
            return Err(Fault::Damaged("no header of a bag".to_owned()));
        }
        let index = first.number("index_pos").unwrap_or(0);
        let mut bag = Self {
            data,
            channels: Vec::new(),
            damage: None,
            chunks: Vec::new(),
        };
        if index == 0
            || index >= bag.data.len()
            || bag.read_index(index).is_err()
            || bag.channels.is_empty()
        {
            bag.scan();
        }
        Ok(bag)
    }

    fn read_index(&mut self, index: u64) -> Result<(), Fault> {
        let (mut channels, mut chunks) = (Channels::default(), Vec::new());
        let mut counts: HashMap<u32, u64> = HashMap::new();
        walk(&self.data, index..self.data.len(), &mut |data, record| {
            match record.code() {
                code::CONNECTION => channels.add(data, record)?,
                code::CHUNK_INFO => {
                    let bytes = content(data, record)?;
                    let mut cursor = Cursor(&bytes);
                    let mut within = Vec::new();
                    while let (Some(connection), Some(count)) = (cursor.u32(), cursor.u32()) {
                        within.push(connection);
                        *counts.entry(connection).or_default() += u64::from(count);
                    }
                    let offset = record
                        .number("chunk_pos")
                        .ok_or_else(|| Fault::Damaged("a damaged index".to_owned()))?;
                    chunks.push((offset, within));
                }
                _ => {}
            }
            Ok(())
        })?;
        (self.channels, self.chunks) = (channels.counted(&counts), chunks);
        Ok(())
    }

    /// Goes through all records, for a bag that was not closed.
    fn scan(&mut self) {
        let mut channels = Channels::default();
        let mut counts: HashMap<u32, u64> = HashMap::new();
        let result = self.walk_all(&mut |data, record| {
            match record.code() {
                code::CONNECTION => channels.add(data, record)?,
                code::MESSAGE => {
                    *counts
                        .entry(record.number("conn").unwrap_or(0) as u32)
                        .or_default() += 1
                }
                _ => {}
            }
            Ok(())
        });
        let found = match result {
            Ok(()) => String::new(),
            Err(Fault::Damaged(found) | Fault::Io(found)) => format!(", and breaks off: {found}"),
            Err(Fault::Stop) => String::new(),
        };
        self.damage = Some(format!("the bag has no index (it was not closed){found}"));
        self.channels = channels.counted(&counts);
        self.chunks.clear();
    }

    fn walk_all(&self, visit: &mut RecordVisitor<'_>) -> Result<(), Fault> {
        walk(
            &self.data,
            MAGIC..self.data.len(),
            &mut |data, record| match record.code() {
                code::CHUNK => walk_chunk(data, record, visit),
                _ => visit(data, record),
            },
        )
    }

    pub fn messages(&self, wanted: &HashSet<u32>, visit: &mut Visitor<'_>) -> Result<(), Fault> {
        let mut take = |data: &Data<'_>, record: &Record| {
            if record.code() != code::MESSAGE {
                return Ok(());
            }
            let damaged = || Fault::Damaged("a message without connection or time".to_owned());
            let connection = record.number("conn").ok_or_else(damaged)? as u32;
            if !wanted.contains(&connection) {
                return Ok(());
            }
            let time = record.number("time").ok_or_else(damaged)?;
            let nanoseconds = (time & 0xffff_ffff) as i64 * 1_000_000_000 + (time >> 32) as i64;
            let content = content(data, record)?;
            visit(connection, nanoseconds, &content)
        };
        if self.chunks.is_empty() {
            return match self.walk_all(&mut take) {
                // Said when the bag was opened.
                Err(Fault::Damaged(_)) if self.damage.is_some() => Ok(()),
                result => result,
            };
        }
        for (offset, within) in &self.chunks {
            if within.iter().any(|connection| wanted.contains(connection)) {
                let chunk = record(&self.data, &(*offset..self.data.len()))?;
                walk_chunk(&self.data, &chunk, &mut take)?;
            }
        }
        Ok(())
    }
}

/// Connections, each once.
#[derive(Default)]
struct Channels {
    all: Vec<Channel>,
    known: HashSet<u32>,
}

impl Channels {
    fn add(&mut self, data: &Data<'_>, record: &Record) -> Result<(), Fault> {
        let damaged = || Fault::Damaged("a damaged connection".to_owned());
        let id = record.number("conn").ok_or_else(damaged)? as u32;
        if !self.known.insert(id) {
            return Ok(());
        }
        let content = data.read(
            record.data.start,
            (record.data.end - record.data.start).min(LONGEST_HEADER),
        )?;
        let kind = fields(&content)
            .and_then(|fields| {
                fields
                    .get("type")
                    .map(|kind| String::from_utf8_lossy(kind).into_owned())
            })
            .unwrap_or_default();
        self.all.push(Channel {
            id,
            topic: record.text("topic"),
            kind: plain_kind(&kind),
            encoding: Encoding::Ros1,
            messages: None,
        });
        Ok(())
    }

    fn counted(mut self, counts: &HashMap<u32, u64>) -> Vec<Channel> {
        for channel in &mut self.all {
            channel.messages = Some(counts.get(&channel.id).copied().unwrap_or(0));
        }
        self.all
    }
}
