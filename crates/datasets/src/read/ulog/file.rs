//! The records of a ULog file (PX4, "ULog File Format", version 1): definitions and messages, little-endian.

use std::collections::HashMap;
use std::rc::Rc;

/// The first bytes of every ULog; a version and a time follow.
pub(crate) const MAGIC: &[u8] = b"ULog\x01\x12\x35";
const HEADER: usize = 16;
/// The record of type `S` with its fixed content, which a reader finds again behind damage.
const SYNC: &[u8] = b"\x08\x00S\x2f\x73\x13\x20\x25\x0c\xbb\x12";
/// Formats within formats, at most.
const DEEPEST: usize = 16;

/// What a log holds of poses.
#[derive(Default)]
pub(super) struct Log<'a> {
    pub topics: Vec<Topic<'a>>,
    /// Times the logger could not keep up, and how long in all, milliseconds.
    pub dropouts: usize,
    pub dropped: u64,
    /// What is broken.
    pub damage: Option<String>,
    formats: HashMap<String, Vec<Declared>>,
    sizes: HashMap<String, usize>,
    /// Topics of the identifiers in use; `None` for those that hold neither position nor attitude.
    ids: HashMap<u16, Option<usize>>,
}

/// The messages of one instance of a topic.
pub(super) struct Topic<'a> {
    pub name: String,
    pub instance: u8,
    /// Instances of one topic share them.
    fields: Rc<[Field]>,
    pub messages: Vec<&'a [u8]>,
    /// Messages that are the first after a dropout.
    pub after_dropout: Vec<usize>,
    dropouts: usize,
}

/// A field as a format declares it.
struct Declared {
    name: String,
    kind: String,
    count: usize,
}

struct Field {
    name: String,
    kind: String,
    count: usize,
    offset: usize,
}

impl<'a> Log<'a> {
    /// Takes the records of a file in; the error is in words.
    pub fn new(bytes: &'a [u8]) -> Result<Self, &'static str> {
        if !bytes.starts_with(MAGIC) || bytes.len() < HEADER {
            return Err("bytes that do not begin like one");
        }
        let mut log = Self::default();
        let mut start = HEADER;
        for end in ends(bytes)? {
            log.section(bytes, start, end);
            start = end;
        }
        Ok(log)
    }

    /// The records between two places; appended data may begin within a record that was cut off.
    fn section(&mut self, bytes: &'a [u8], start: usize, end: usize) {
        let mut rest = &bytes[start..end];
        while !rest.is_empty() {
            let Some((kind, content, after)) = record(rest) else {
                if end == bytes.len() {
                    self.damage
                        .get_or_insert_with(|| "the log ends within a record".to_owned());
                }
                return;
            };
            if !kind.is_ascii_uppercase() {
                let at = bytes[..end].len() - rest.len();
                self.damage
                    .get_or_insert_with(|| format!("no record at byte {at}"));
                let next = rest.windows(SYNC.len()).position(|bytes| bytes == SYNC);
                match next {
                    Some(next) => rest = &rest[next..],
                    None => return,
                }
                continue;
            }
            rest = after;
            if self.take(kind, content).is_none() {
                self.damage
                    .get_or_insert_with(|| format!("a record `{}` is broken", char::from(kind)));
            }
        }
    }

    /// Takes one record; `None` where its content is not what its type says.
    fn take(&mut self, kind: u8, content: &'a [u8]) -> Option<()> {
        match kind {
            b'F' => {
                let (name, fields) = declared(content)?;
                self.formats.insert(name, fields);
            }
            b'A' => {
                let (&instance, rest) = content.split_first()?;
                let id = u16_at(rest, 0)?;
                let name = std::str::from_utf8(rest.get(2..)?).ok()?.to_owned();
                let topic = self.topic(name, instance)?;
                self.ids.insert(id, topic);
            }
            b'D' => {
                let place = self.ids.get(&u16_at(content, 0)?)?;
                if let Some(topic) = place.and_then(|place| self.topics.get_mut(place)) {
                    if topic.dropouts < self.dropouts {
                        topic.after_dropout.push(topic.messages.len());
                        topic.dropouts = self.dropouts;
                    }
                    topic.messages.push(&content[2..]);
                }
            }
            b'R' => {
                self.ids.remove(&u16_at(content, 0)?);
            }
            b'O' => {
                self.dropped += u64::from(u16_at(content, 0)?);
                self.dropouts += 1;
            }
            _ => {}
        }
        Some(())
    }

    /// The place of a topic, new or known; `Some(None)` where it holds nothing of a pose.
    fn topic(&mut self, name: String, instance: u8) -> Option<Option<usize>> {
        let same = |topic: &Topic<'_>| topic.name == name && topic.instance == instance;
        if let Some(place) = self.topics.iter().position(same) {
            return Some(Some(place));
        }
        let mut known = self.topics.iter().filter(|topic| topic.name == name);
        let fields = match known.next() {
            Some(other) => Rc::clone(&other.fields),
            None => self.fields(&name)?.into(),
        };
        let topic = Topic {
            name,
            instance,
            fields,
            messages: Vec::new(),
            after_dropout: Vec::new(),
            dropouts: self.dropouts,
        };
        if !topic.has("timestamp", 1) || !(topic.position().is_some() || topic.has("q", 4)) {
            return Some(None);
        }
        self.topics.push(topic);
        Some(Some(self.topics.len() - 1))
    }

    fn fields(&mut self, name: &str) -> Option<Vec<Field>> {
        let declared = self.formats.get(name)?;
        let (mut fields, mut offset) = (Vec::new(), 0_usize);
        for field in declared {
            let size = size(&field.kind, &self.formats, &mut self.sizes, DEEPEST)?;
            fields.push(Field {
                name: field.name.clone(),
                kind: field.kind.clone(),
                count: field.count,
                offset,
            });
            offset = offset.checked_add(size.checked_mul(field.count)?)?;
        }
        Some(fields)
    }
}

impl Topic<'_> {
    fn has(&self, name: &str, count: usize) -> bool {
        self.fields
            .iter()
            .any(|field| field.name == name && field.count == count)
    }

    /// Names and indices of the fields with the position, by either habit of PX4.
    pub fn position(&self) -> Option<[(&'static str, usize); 3]> {
        if self.has("position", 3) {
            return Some([("position", 0), ("position", 1), ("position", 2)]);
        }
        let all = ["x", "y", "z"].iter().all(|name| self.has(name, 1));
        all.then_some([("x", 0), ("y", 0), ("z", 0)])
    }

    /// True where the attitude is in the same messages, or alone.
    pub fn has_attitude(&self) -> bool {
        self.has("q", 4)
    }

    /// The number in a field of a message; `None` where the field is not there or the message too short for it.
    pub fn number(&self, message: &[u8], name: &str, index: usize) -> Option<f64> {
        let field = self.fields.iter().find(|field| field.name == name)?;
        if index >= field.count {
            return None;
        }
        let width = scalar(&field.kind)?;
        let at = field.offset.checked_add(index.checked_mul(width)?)?;
        let bytes = message.get(at..at.checked_add(width)?)?;
        Some(match field.kind.as_str() {
            "float" => f64::from(f32::from_le_bytes(bytes.try_into().ok()?)),
            "double" => f64::from_le_bytes(bytes.try_into().ok()?),
            "bool" | "uint8_t" => f64::from(bytes[0]),
            _ => return None,
        })
    }

    /// The stamp of a message, microseconds.
    pub fn stamp(&self, message: &[u8]) -> Option<u64> {
        let field = self.fields.iter().find(|field| field.name == "timestamp")?;
        if field.kind != "uint64_t" {
            return None;
        }
        u64_at(message, field.offset)
    }
}

/// Ends of the sections of a file: where data was appended after the flight, and its end.
fn ends(bytes: &[u8]) -> Result<Vec<usize>, &'static str> {
    let mut ends = vec![bytes.len()];
    if let Some((b'B', content, _)) = record(&bytes[HEADER..]) {
        let incompatible = content.get(8..16).unwrap_or_default();
        // Only the first flag is defined: data was appended.
        if incompatible
            .iter()
            .enumerate()
            .any(|(byte, bits)| *bits & !u8::from(byte == 0) != 0)
        {
            return Err("a log with features that this reader does not know");
        }
        let offsets = (0..3).filter_map(|index| u64_at(content, 16 + 8 * index));
        let inside = HEADER as u64 + 1..bytes.len() as u64;
        ends.extend(
            offsets
                .filter(|offset| inside.contains(offset))
                .map(|offset| offset as usize),
        );
        ends.sort_unstable();
    }
    Ok(ends)
}

/// Type and content of the first record, and what follows it.
fn record(bytes: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let (head, rest) = bytes.split_at_checked(3)?;
    let (content, rest) = rest.split_at_checked(usize::from(u16_at(head, 0)?))?;
    Some((head[2], content, rest))
}

/// Name and fields of a format: `name:float[4] q;uint64_t timestamp;`.
fn declared(content: &[u8]) -> Option<(String, Vec<Declared>)> {
    let (name, fields) = std::str::from_utf8(content).ok()?.split_once(':')?;
    let fields = fields
        .split(';')
        .map(str::trim)
        .filter(|field| !field.is_empty());
    let fields = fields.map(|field| {
        let (kind, name) = field.split_once(' ')?;
        let (kind, count) = match kind.split_once('[') {
            Some((kind, count)) => (kind, count.strip_suffix(']')?.parse().ok()?),
            None => (kind, 1),
        };
        Some(Declared {
            name: name.trim().to_owned(),
            kind: kind.to_owned(),
            count,
        })
    });
    Some((name.to_owned(), fields.collect::<Option<_>>()?))
}

/// Bytes of a type of its own.
fn scalar(kind: &str) -> Option<usize> {
    Some(match kind {
        "int8_t" | "uint8_t" | "bool" | "char" => 1,
        "int16_t" | "uint16_t" => 2,
        "int32_t" | "uint32_t" | "float" => 4,
        "int64_t" | "uint64_t" | "double" => 8,
        _ => return None,
    })
}

/// Bytes of a type, which may be a format; `None` for unknown ones and for formats that hold themselves.
fn size(
    kind: &str,
    formats: &HashMap<String, Vec<Declared>>,
    known: &mut HashMap<String, usize>,
    depth: usize,
) -> Option<usize> {
    if let Some(size) = scalar(kind).or_else(|| known.get(kind).copied()) {
        return Some(size);
    }
    let mut sum = 0_usize;
    for field in formats.get(kind)? {
        let one = size(&field.kind, formats, known, depth.checked_sub(1)?)?;
        sum = sum.checked_add(one.checked_mul(field.count)?)?;
    }
    known.insert(kind.to_owned(), sum);
    Some(sum)
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?))
}

fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    let end = at.checked_add(8)?;
    Some(u64::from_le_bytes(bytes.get(at..end)?.try_into().ok()?))
}
