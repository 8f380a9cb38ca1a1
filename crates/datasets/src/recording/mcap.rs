//! MCAP (<https://mcap.dev/spec>): records with a code and a length, chunks of them packed, an index at the end.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use rayon::prelude::*;

use super::code::{self, MAGIC};
use super::container::{Channel, Encoding, Fault, Visitor, plain_kind, unpack, unpack_front};
use super::data::{Cursor, Data};

/// A footer record and the magic number behind it.
const TAIL: u64 = 9 + 20 + 8;
/// Code and length of a record.
const RECORD: u64 = 9;
/// Longest record other than messages, chunks and attachments.
const LONGEST: u64 = 64 << 20;
/// Longest message with a pose, and longest packed chunk: a larger one is damaged.
const LONGEST_MESSAGE: u64 = 256 << 20;
const LONGEST_CHUNK: u64 = 1 << 30;
/// Chunks that are unpacked at once, at most ...
const MOST_AT_ONCE: usize = 8;
/// ... and what they may become together, unless one alone is larger.
const MOST_UNPACKED: u64 = 128 << 20;

/// An open file.
pub(crate) struct Mcap<'a> {
    data: Data<'a>,
    pub channels: Vec<Channel>,
    pub damage: Option<String>,
    chunks: Vec<Chunk>,
}

/// A chunk as the index tells it.
struct Chunk {
    offset: u64,
    /// Bytes of its records, unpacked.
    size: u64,
    /// Channels with messages in it, and where the list of their places is.
    channels: Vec<(u32, u64)>,
}

#[derive(Default)]
struct Names {
    schemas: HashMap<u16, (String, String)>,
    channels: Vec<(u16, u16, String, String)>,
    counts: HashMap<u16, u64>,
}

impl Names {
    fn schema(&mut self, content: &[u8]) -> Option<()> {
        let mut cursor = Cursor(content);
        let id = cursor.u16()?;
        self.schemas.insert(id, (cursor.text()?, cursor.text()?));
        Some(())
    }

    fn channel(&mut self, content: &[u8]) -> Option<()> {
        let mut cursor = Cursor(content);
        let (id, schema) = (cursor.u16()?, cursor.u16()?);
        let channel = (id, schema, cursor.text()?, cursor.text()?);
        if self.channels.iter().all(|(known, ..)| *known != id) {
            self.channels.push(channel);
        }
        Some(())
    }

    fn statistics(&mut self, content: &[u8]) -> Option<()> {
        let mut cursor = Cursor(content);
        cursor.take(8 + 2 + 4 + 4 + 4 + 4 + 8 + 8)?;
        let mut counts = Cursor(cursor.block()?);
        while let (Some(channel), Some(count)) = (counts.u16(), counts.u64()) {
            self.counts.insert(channel, count);
        }
        Some(())
    }

    fn build(&self) -> Vec<Channel> {
        let channel = |(id, schema, topic, encoding): &(u16, u16, String, String)| {
            let kind = self.schemas.get(schema).map_or("", |(name, _)| name);
            Channel {
                id: u32::from(*id),
                topic: topic.clone(),
                kind: plain_kind(kind),
                encoding: match encoding.as_str() {
                    "ros1" => Encoding::Ros1,
                    "cdr" => Encoding::Cdr,
                    "protobuf" => Encoding::Protobuf,
                    "json" => Encoding::Json,
                    _ => Encoding::Other,
                },
                messages: self.counts.get(id).copied(),
            }
        };
        self.channels.iter().map(channel).collect()
    }
}

impl<'a> Mcap<'a> {
    pub fn open(data: Data<'a>) -> Result<Self, Fault> {
        if data.read(0, MAGIC.len() as u64)?.as_ref() != MAGIC {
            return Err(Fault::Damaged("another version of MCAP".to_owned()));
        }
        let mut mcap = Self {
            data,
            channels: Vec::new(),
            damage: None,
            chunks: Vec::new(),
        };
        if !mcap.read_summary().unwrap_or(false) {
            mcap.scan();
        }
        Ok(mcap)
    }

    /// Reads the index at the end; false where there is none that tells all.
    fn read_summary(&mut self) -> Result<bool, Fault> {
        let length = self.data.len();
        let Some(tail) = length.checked_sub(TAIL) else {
            return Ok(false);
        };
        let bytes = self.data.read(tail, TAIL)?;
        if bytes[0] != code::FOOTER || &bytes[29..] != MAGIC {
            return Ok(false);
        }
        let start = Cursor(&bytes[9..]).u64().unwrap_or(0);
        if start == 0 || start > tail {
            return Ok(false);
        }
        let (mut names, mut chunks) = (Names::default(), Vec::new());
        let whole = walk(&self.data, start..tail, &mut |code, body| {
            if [
                code::SCHEMA,
                code::CHANNEL,
                code::CHUNK_INDEX,
                code::STATISTICS,
            ]
            .contains(&code)
            {
                let content = body.all()?;
                match code {
                    code::SCHEMA => names.schema(&content),
                    code::CHANNEL => names.channel(&content),
                    code::STATISTICS => names.statistics(&content),
                    _ => chunk_index(&content).map(|chunk| chunks.push(chunk)),
                }
                .ok_or_else(|| Fault::Damaged("a damaged index".to_owned()))?;
            }
            Ok(())
        });
        if whole.is_err() || names.channels.is_empty() || chunks.is_empty() {
            return Ok(false);
        }
        self.channels = names.build();
        self.chunks = chunks;
        Ok(true)
    }

    /// Goes through all records, for a file without an index; what cannot be read is said.
    fn scan(&mut self) {
        let mut names = Names::default();
        let mut counts: HashMap<u16, u64> = HashMap::new();
        let result = self.walk_all(&mut |code, body| {
            match code {
                code::SCHEMA => {
                    names.schema(&body.all()?);
                }
                code::CHANNEL => {
                    names.channel(&body.all()?);
                }
                code::MESSAGE => {
                    let front = body.front(2)?;
                    *counts.entry(Cursor(&front).u16().unwrap_or(0)).or_default() += 1;
                }
                _ => {}
            }
            Ok(())
        });
        self.damage = match result {
            Ok(true) => None,
            Ok(false) => Some("the recording ends without its end mark".to_owned()),
            Err(Fault::Damaged(found) | Fault::Io(found)) => {
                Some(format!("the recording breaks off: {found}"))
            }
            Err(Fault::Stop) => None,
        };
        names.counts = counts;
        self.channels = names.build();
    }

    /// All records of the data section, those of chunks too; true where it has an end mark.
    fn walk_all(&self, visit: &mut RecordVisitor<'_>) -> Result<bool, Fault> {
        let mut ended = false;
        let end = self.data.len();
        walk(&self.data, MAGIC.len() as u64..end, &mut |code, body| {
            match code {
                code::DATA_END | code::FOOTER => {
                    ended = true;
                    return Err(Fault::Stop);
                }
                code::CHUNK => walk_chunk(body, visit)?,
                _ => visit(code, body)?,
            }
            Ok(())
        })
        .or_else(|fault| {
            if fault == Fault::Stop && ended {
                Ok(())
            } else {
                Err(fault)
            }
        })?;
        Ok(ended)
    }

    pub fn messages(&self, wanted: &HashSet<u32>, visit: &mut Visitor<'_>) -> Result<(), Fault> {
        let mut take = |code: u8, body: &Body<'_, '_>| {
            if code != code::MESSAGE {
                return Ok(());
            }
            let front = body.front(22)?;
            let mut cursor = Cursor(&front);
            let (Some(channel), Some(_), Some(time)) = (cursor.u16(), cursor.u32(), cursor.u64())
            else {
                return Err(Fault::Damaged("a message shorter than its head".to_owned()));
            };
            if !wanted.contains(&u32::from(channel)) {
                return Ok(());
            }
            let content = body.from(22)?;
            visit(
                u32::from(channel),
                i64::try_from(time).unwrap_or(i64::MAX),
                &content,
            )
        };
        if self.chunks.is_empty() {
            return match self.walk_all(&mut take) {
                // Said when the file was opened.
                Err(Fault::Damaged(_)) if self.damage.is_some() => Ok(()),
                result => result.map(|_| ()),
            };
        }
        // A chunk without an index of its messages may hold any.
        let holds = |chunk: &&Chunk| {
            let mut channels = chunk.channels.iter();
            chunk.channels.is_empty() || channels.any(|(channel, _)| wanted.contains(channel))
        };
        let chunks: Vec<&Chunk> = self.chunks.iter().filter(holds).collect();
        let mut rest = &chunks[..];
        while !rest.is_empty() {
            let (group, behind) = rest.split_at(group(rest));
            rest = behind;
            let found: Vec<_> = group
                .par_iter()
                .map(|chunk| {
                    self.is_as_large(chunk)
                        .then(|| self.records_of(chunk, wanted))
                })
                .collect();
            for (chunk, records) in group.iter().zip(found) {
                match records.unwrap_or_else(|| self.records_of(chunk, wanted))? {
                    Records::Here(range) => walk(&self.data, range, &mut take)?,
                    Records::Unpacked(records) => {
                        let range = 0..records.len() as u64;
                        walk(&Data::Bytes(&records), range, &mut take)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Whether a chunk is no larger than its index says, by which those that are unpacked at once were chosen.
    fn is_as_large(&self, chunk: &Chunk) -> bool {
        // Code and length of the record, and two stamps.
        const BEFORE: u64 = RECORD + 16;
        let size = chunk.offset.checked_add(BEFORE);
        let size = size.and_then(|place| self.data.read(place, 8).ok());
        size.and_then(|size| Cursor(&size).u64())
            .is_some_and(|size| size <= chunk.size)
    }

    /// The records of a chunk, through the last wanted message.
    fn records_of(&self, chunk: &Chunk, wanted: &HashSet<u32>) -> Result<Records, Fault> {
        let (code, body) = record(&self.data, &(chunk.offset..self.data.len()))?;
        if code != code::CHUNK {
            let found = "an index that points to no chunk".to_owned();
            return Err(Fault::Damaged(found));
        }
        records(&body, self.last_place(chunk, wanted))
    }

    /// Where the last wanted message of a chunk begins among its unpacked records; `None` where the index does not
    /// tell. What lies behind, pictures mostly, need not be unpacked.
    fn last_place(&self, chunk: &Chunk, wanted: &HashSet<u32>) -> Option<u64> {
        let mut last = None;
        for (channel, offset) in chunk
            .channels
            .iter()
            .filter(|(channel, _)| wanted.contains(channel))
        {
            let (code, body) = record(&self.data, &(*offset..self.data.len())).ok()?;
            let content = body.all().ok()?;
            let mut cursor = Cursor(&content);
            if code != code::MESSAGE_INDEX || u32::from(cursor.u16()?) != *channel {
                return None;
            }
            let mut entries = Cursor(cursor.block()?);
            while let (Some(_), Some(place)) = (entries.u64(), entries.u64()) {
                last = last.max(Some(place));
            }
        }
        last
    }
}

fn chunk_index(content: &[u8]) -> Option<Chunk> {
    let mut cursor = Cursor(content);
    cursor.take(16)?;
    let offset = cursor.u64()?;
    cursor.take(8)?;
    let mut entries = Cursor(cursor.block()?);
    let mut channels = Vec::new();
    while let (Some(channel), Some(offset)) = (entries.u16(), entries.u64()) {
        channels.push((u32::from(channel), offset));
    }
    cursor.take(8)?;
    cursor.text()?;
    cursor.take(8)?;
    let size = cursor.u64()?;
    Some(Chunk {
        offset,
        channels,
        size,
    })
}

/// The content of a record, still where it lies.
struct Body<'d, 'a> {
    data: &'d Data<'a>,
    range: Range<u64>,
}

type RecordVisitor<'v> = dyn FnMut(u8, &Body<'_, '_>) -> Result<(), Fault> + 'v;

impl Body<'_, '_> {
    fn length(&self) -> u64 {
        self.range.end - self.range.start
    }

    fn all(&self) -> Result<std::borrow::Cow<'_, [u8]>, Fault> {
        if self.length() > LONGEST {
            return Err(Fault::Damaged(format!(
                "a record of {} bytes",
                self.length()
            )));
        }
        Ok(self.data.read(self.range.start, self.length())?)
    }

    fn front(&self, length: u64) -> Result<std::borrow::Cow<'_, [u8]>, Fault> {
        Ok(self.data.read_up_to(&self.range, length)?)
    }

    fn from(&self, skip: u64) -> Result<std::borrow::Cow<'_, [u8]>, Fault> {
        let start = self.range.start + skip;
        if self.length() > LONGEST_MESSAGE {
            let found = format!("a message of {} bytes", self.length());
            return Err(Fault::Damaged(found));
        }
        Ok(self
            .data
            .read(start, self.range.end.saturating_sub(start))?)
    }
}

/// The record at the front of a range.
fn record<'d, 'a>(data: &'d Data<'a>, range: &Range<u64>) -> Result<(u8, Body<'d, 'a>), Fault> {
    let head = data.read_up_to(range, RECORD)?;
    let mut cursor = Cursor(&head);
    let (Some(code), Some(length)) = (cursor.u8(), cursor.u64()) else {
        return Err(Fault::Damaged(
            "the end of the file within a record".to_owned(),
        ));
    };
    let start = range.start + RECORD;
    let end = start.checked_add(length).filter(|end| *end <= range.end);
    let end =
        end.ok_or_else(|| Fault::Damaged("the end of the file within a record".to_owned()))?;
    Ok((
        code,
        Body {
            data,
            range: start..end,
        },
    ))
}

fn walk(
    data: &Data<'_>,
    mut range: Range<u64>,
    visit: &mut RecordVisitor<'_>,
) -> Result<(), Fault> {
    while range.start < range.end {
        // What lies behind a footer is the magic number.
        if range.end - range.start < RECORD {
            return Err(Fault::Damaged(
                "the end of the file within a record".to_owned(),
            ));
        }
        // A chunk cut off at the end of the file: its whole messages can still be had where it is not packed.
        let (code, body) = match record(data, &range) {
            Ok(found) => found,
            Err(fault) => {
                if data.read_up_to(&range, 1)?.first() == Some(&code::CHUNK) {
                    let cut = Body {
                        data,
                        range: range.start + RECORD..range.end,
                    };
                    walk_chunk(&cut, visit)?;
                }
                return Err(fault);
            }
        };
        range.start = body.range.end;
        visit(code, &body)?;
    }
    Ok(())
}

/// How many of the chunks at the front are unpacked at once: as many as there are threads, but not more than memory should
/// hold.
fn group(chunks: &[&Chunk]) -> usize {
    let mut sum = 0_u64;
    let fits = |chunk: &&&Chunk| {
        sum = sum.saturating_add(chunk.size);
        sum <= MOST_UNPACKED
    };
    let threads = rayon::current_num_threads().min(MOST_AT_ONCE);
    chunks.iter().take(threads).take_while(fits).count().max(1)
}

/// Where the records of a chunk are.
enum Records {
    /// In the file, as they are.
    Here(Range<u64>),
    Unpacked(Vec<u8>),
}

/// Visits the records of a chunk.
fn walk_chunk(body: &Body<'_, '_>, visit: &mut RecordVisitor<'_>) -> Result<(), Fault> {
    match records(body, None)? {
        Records::Here(range) => walk(body.data, range, visit),
        Records::Unpacked(records) => walk(&Data::Bytes(&records), 0..records.len() as u64, visit),
    }
}

/// The records of a chunk, those after the one that begins at `last` left out where it is known.
fn records(body: &Body<'_, '_>, last: Option<u64>) -> Result<Records, Fault> {
    const FIXED: u64 = 8 + 8 + 8 + 4;
    let damaged = || Fault::Damaged("a damaged chunk".to_owned());
    let head = body.front(FIXED + 4 + 16 + 8)?;
    let mut cursor = Cursor(&head);
    cursor.take(16).ok_or_else(damaged)?;
    let size = cursor.u64().ok_or_else(damaged)?;
    cursor.take(4).ok_or_else(damaged)?;
    let compression = cursor.text().ok_or_else(damaged)?;
    let length = cursor.u64().ok_or_else(damaged)?;
    let start = body.range.start + FIXED + 4 + compression.len() as u64 + 8;
    let end = start.saturating_add(length).min(body.range.end);
    if compression.is_empty() {
        return Ok(Records::Here(start..end));
    }
    let length = end.saturating_sub(start);
    if length > LONGEST_CHUNK {
        return Err(Fault::Damaged(format!("a packed chunk of {length} bytes")));
    }
    let packed = body.data.read(start, length)?;
    Ok(Records::Unpacked(match last {
        Some(last) if last < size => unpack_front(&packed, &compression, size, last)?,
        _ => unpack(&packed, &compression, Some(size))?,
    }))
}
