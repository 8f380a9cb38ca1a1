//! MCAP (<https://mcap.dev/spec>) as it is written: chunks of messages, packed with LZ4, and an index at the end.

use std::collections::BTreeMap;
use std::io::Write;

pub const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// A chunk of about this many bytes is closed.
const CHUNK: usize = 1 << 20;

mod code {
    pub const HEADER: u8 = 0x01;
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const MESSAGE_INDEX: u8 = 0x07;
    pub const CHUNK_INDEX: u8 = 0x08;
    pub const STATISTICS: u8 = 0x0b;
    pub const METADATA: u8 = 0x0c;
    pub const METADATA_INDEX: u8 = 0x0d;
    pub const SUMMARY_OFFSET: u8 = 0x0e;
    pub const DATA_END: u8 = 0x0f;
}

/// A recording in the making, in memory.
pub struct Recording {
    out: Vec<u8>,
    /// Records of schemas and channels; they stand in front of the messages and again at the end.
    schemas: Vec<Vec<u8>>,
    channels: Vec<Vec<u8>>,
    chunk: Chunk,
    /// Bodies of the indices of the chunks so far.
    chunks: Vec<Vec<u8>>,
    metadata: Vec<Vec<u8>>,
    /// Messages of each channel.
    counts: BTreeMap<u16, u64>,
    times: Option<(u64, u64)>,
}

/// Messages that are not yet written.
#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    /// Of each channel times and offsets.
    places: BTreeMap<u16, Vec<(u64, u64)>>,
    times: Option<(u64, u64)>,
}

/// A channel of a [`Recording`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel(u16);

/// Fields of a record, one after the other.
#[derive(Default)]
struct Fields(Vec<u8>);

impl Fields {
    fn number<const N: usize>(mut self, bytes: [u8; N]) -> Self {
        self.0.extend(bytes);
        self
    }

    fn text(self, text: &str) -> Self {
        self.block(text.as_bytes())
    }

    /// Bytes with a length of four bytes in front.
    fn block(self, bytes: &[u8]) -> Self {
        let mut fields = self.number((bytes.len() as u32).to_le_bytes());
        fields.0.extend(bytes);
        fields
    }

    fn texts(self, pairs: &[(&str, String)]) -> Self {
        let empty = Self::default();
        let add = |fields: Self, (key, value): &(&str, String)| fields.text(key).text(value);
        self.block(&pairs.iter().fold(empty, add).0)
    }

    fn record(self, code: u8) -> Vec<u8> {
        let mut record = vec![code];
        record.extend((self.0.len() as u64).to_le_bytes());
        record.extend(self.0);
        record
    }
}

fn fields() -> Fields {
    Fields::default()
}

impl Recording {
    /// `library` says what wrote it.
    pub fn new(library: &str) -> Self {
        let mut out = MAGIC.to_vec();
        out.extend(fields().text("").text(library).record(code::HEADER));
        Self {
            out,
            schemas: Vec::new(),
            channels: Vec::new(),
            chunk: Chunk::default(),
            chunks: Vec::new(),
            metadata: Vec::new(),
            counts: BTreeMap::new(),
            times: None,
        }
    }

    /// A channel of messages that are described by a `FileDescriptorSet`. All channels come before the first message.
    pub fn channel(&mut self, topic: &str, message: &str, description: &[u8]) -> Channel {
        let id = self.channels.len() as u16 + 1;
        let schema = fields()
            .number(id.to_le_bytes())
            .text(message)
            .text("protobuf")
            .block(description);
        let channel = fields()
            .number(id.to_le_bytes())
            .number(id.to_le_bytes())
            .text(topic)
            .text("protobuf")
            .texts(&[]);
        self.schemas.push(schema.record(code::SCHEMA));
        self.channels.push(channel.record(code::CHANNEL));
        Channel(id)
    }

    /// The next message, `time` in nanoseconds.
    pub fn message(&mut self, channel: Channel, time: u64, content: Vec<u8>) {
        if self.chunk.records.is_empty() && self.chunks.is_empty() {
            let definitions = self.schemas.iter().chain(&self.channels).flatten();
            self.chunk.records.extend(definitions);
        }
        let Channel(id) = channel;
        let sequence = self.counts.entry(id).or_default();
        let mut message = fields()
            .number(id.to_le_bytes())
            .number((*sequence as u32).to_le_bytes())
            .number(time.to_le_bytes())
            .number(time.to_le_bytes());
        *sequence += 1;
        message.0.extend(content);
        let place = (time, self.chunk.records.len() as u64);
        self.chunk.places.entry(id).or_default().push(place);
        self.chunk.times = Some(within(self.chunk.times, time));
        self.times = Some(within(self.times, time));
        self.chunk.records.extend(message.record(code::MESSAGE));
        if self.chunk.records.len() >= CHUNK {
            self.close_chunk();
        }
    }

    /// Names with values, for people and programs.
    pub fn metadata(&mut self, name: &str, pairs: &[(&str, String)]) {
        self.close_chunk();
        let record = fields().text(name).texts(pairs).record(code::METADATA);
        let index = fields()
            .number((self.out.len() as u64).to_le_bytes())
            .number((record.len() as u64).to_le_bytes())
            .text(name);
        self.metadata.push(index.record(code::METADATA_INDEX));
        self.out.extend(record);
    }

    fn close_chunk(&mut self) {
        let chunk = std::mem::take(&mut self.chunk);
        let Some((first, last)) = chunk.times else {
            return;
        };
        let (packed, compression) = pack(&chunk.records);
        let start = self.out.len() as u64;
        // No checksum: 0 says so.
        let mut head = fields()
            .number(first.to_le_bytes())
            .number(last.to_le_bytes())
            .number((chunk.records.len() as u64).to_le_bytes())
            .number(0_u32.to_le_bytes())
            .text(compression)
            .number((packed.len() as u64).to_le_bytes());
        head.0.extend(&packed);
        self.out.extend(head.record(code::CHUNK));
        let length = self.out.len() as u64 - start;
        let indices_start = self.out.len() as u64;
        let mut offsets = fields();
        for (id, places) in chunk.places {
            offsets = offsets
                .number(id.to_le_bytes())
                .number((self.out.len() as u64).to_le_bytes());
            let pairs = places.iter().fold(fields(), |pairs, (time, offset)| {
                pairs
                    .number(time.to_le_bytes())
                    .number(offset.to_le_bytes())
            });
            let index = fields().number(id.to_le_bytes()).block(&pairs.0);
            self.out.extend(index.record(code::MESSAGE_INDEX));
        }
        let index = fields()
            .number(first.to_le_bytes())
            .number(last.to_le_bytes())
            .number(start.to_le_bytes())
            .number(length.to_le_bytes())
            .block(&offsets.0)
            .number((self.out.len() as u64 - indices_start).to_le_bytes())
            .text(compression)
            .number((packed.len() as u64).to_le_bytes())
            .number((chunk.records.len() as u64).to_le_bytes());
        self.chunks.push(index.record(code::CHUNK_INDEX));
    }

    /// The whole file.
    pub fn end(mut self) -> Vec<u8> {
        self.close_chunk();
        self.out
            .extend(fields().number(0_u32.to_le_bytes()).record(code::DATA_END));
        let summary = self.out.len() as u64;
        let statistics = vec![self.statistics()];
        let groups = [
            (code::SCHEMA, &self.schemas),
            (code::CHANNEL, &self.channels),
            (code::STATISTICS, &statistics),
            (code::CHUNK_INDEX, &self.chunks),
            (code::METADATA_INDEX, &self.metadata),
        ];
        let mut offsets = Vec::new();
        for (code, records) in groups
            .into_iter()
            .filter(|(_, records)| !records.is_empty())
        {
            let start = self.out.len() as u64;
            self.out.extend(records.iter().flatten());
            let length = self.out.len() as u64 - start;
            let offset = fields()
                .number([code])
                .number(start.to_le_bytes())
                .number(length.to_le_bytes());
            offsets.extend(offset.record(code::SUMMARY_OFFSET));
        }
        let offsets_start = self.out.len() as u64;
        self.out.extend(offsets);
        let footer = fields()
            .number(summary.to_le_bytes())
            .number(offsets_start.to_le_bytes())
            .number(0_u32.to_le_bytes());
        self.out.extend(footer.record(code::FOOTER));
        self.out.extend(MAGIC);
        self.out
    }

    fn statistics(&self) -> Vec<u8> {
        let (first, last) = self.times.unwrap_or_default();
        let counts = self.counts.iter().fold(fields(), |counts, (id, count)| {
            counts.number(id.to_le_bytes()).number(count.to_le_bytes())
        });
        fields()
            .number(self.counts.values().sum::<u64>().to_le_bytes())
            .number((self.schemas.len() as u16).to_le_bytes())
            .number((self.channels.len() as u32).to_le_bytes())
            .number(0_u32.to_le_bytes())
            .number((self.metadata.len() as u32).to_le_bytes())
            .number((self.chunks.len() as u32).to_le_bytes())
            .number(first.to_le_bytes())
            .number(last.to_le_bytes())
            .block(&counts.0)
            .record(code::STATISTICS)
    }
}

fn within(times: Option<(u64, u64)>, time: u64) -> (u64, u64) {
    times.map_or((time, time), |(first, last)| {
        (first.min(time), last.max(time))
    })
}

/// Packed records and the name of how; as they are where packing fails, which in memory it does not.
fn pack(records: &[u8]) -> (Vec<u8>, &'static str) {
    let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
    match encoder.write_all(records).map(|()| encoder.finish()) {
        Ok(Ok(packed)) => (packed, "lz4"),
        _ => (records.to_vec(), ""),
    }
}
