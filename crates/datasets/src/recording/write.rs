//! MCAP (<https://mcap.dev/spec>) as it is written: chunks of messages, packed with LZ4, and an index at the end.

use super::code::{self, MAGIC};
use std::collections::BTreeMap;
use std::io::Write;

/// A chunk of about this many bytes is closed.
const CHUNK: usize = 1 << 20;

/// A recording in the making. What is finished can be [taken](Self::take) and appended to a file, which
/// [an ending](Self::ending) makes whole at any time; or all of it stays here until [`Self::end`].
///
/// ```
/// use dose3_datasets::mcap::Recording;
///
/// let mut recording = Recording::new("an example");
/// let channel = recording.channel("/said", "example.Text", b"");
/// recording.message(channel, 1_000_000_000, b"\x0a\x02hi".to_vec());
/// let bytes = recording.end();
/// assert_eq!(&bytes[..8], dose3_datasets::mcap::MAGIC);
/// assert_eq!(&bytes[bytes.len() - 8..], dose3_datasets::mcap::MAGIC);
/// ```
pub struct Recording {
    /// What was not taken yet.
    out: Vec<u8>,
    /// Bytes that were taken.
    taken: u64,
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
    #[must_use]
    pub fn new(library: &str) -> Self {
        let mut out = MAGIC.to_vec();
        out.extend(fields().text("").text(library).record(code::HEADER));
        Self {
            out,
            taken: 0,
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
            .number(self.position().to_le_bytes())
            .number((record.len() as u64).to_le_bytes())
            .text(name);
        self.metadata.push(index.record(code::METADATA_INDEX));
        self.out.extend(record);
    }

    /// Chunks so far.
    #[must_use]
    pub fn chunks(&self) -> usize {
        self.chunks.len()
    }

    /// What is written so far and stays as it is, once: to be appended to what was taken before.
    pub fn take(&mut self) -> Vec<u8> {
        self.taken = self.position();
        std::mem::take(&mut self.out)
    }

    /// Where the next record will be in the file.
    fn position(&self) -> u64 {
        self.taken + self.out.len() as u64
    }

    /// Messages that wait become a chunk.
    pub fn close_chunk(&mut self) {
        let chunk = std::mem::take(&mut self.chunk);
        let Some((first, last)) = chunk.times else {
            return;
        };
        let (packed, compression) = pack(&chunk.records);
        let start = self.position();
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
        let length = self.position() - start;
        let indices_start = self.position();
        let mut offsets = fields();
        for (id, places) in chunk.places {
            offsets = offsets
                .number(id.to_le_bytes())
                .number(self.position().to_le_bytes());
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
            .number((self.position() - indices_start).to_le_bytes())
            .text(compression)
            .number((packed.len() as u64).to_le_bytes())
            .number((chunk.records.len() as u64).to_le_bytes());
        self.chunks.push(index.record(code::CHUNK_INDEX));
    }

    /// The rest of the file, were nothing else to come: chunks that are closed, and the index. What comes later takes its
    /// place.
    #[must_use]
    pub fn ending(&self) -> Vec<u8> {
        let mut out = fields().number(0_u32.to_le_bytes()).record(code::DATA_END);
        let before = self.position();
        let summary = before + out.len() as u64;
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
            let start = before + out.len() as u64;
            out.extend(records.iter().flatten());
            let length = before + out.len() as u64 - start;
            let offset = fields()
                .number([code])
                .number(start.to_le_bytes())
                .number(length.to_le_bytes());
            offsets.extend(offset.record(code::SUMMARY_OFFSET));
        }
        let offsets_start = before + out.len() as u64;
        out.extend(offsets);
        let footer = fields()
            .number(summary.to_le_bytes())
            .number(offsets_start.to_le_bytes())
            .number(0_u32.to_le_bytes());
        out.extend(footer.record(code::FOOTER));
        out.extend(MAGIC);
        out
    }

    /// All that was not taken, to its end.
    #[must_use]
    pub fn end(mut self) -> Vec<u8> {
        self.close_chunk();
        let ending = self.ending();
        let mut out = self.take();
        out.extend(ending);
        out
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

#[cfg(test)]
mod tests {
    use super::*;

    fn message(recording: &mut Recording, channel: Channel, time: u64) {
        recording.message(channel, time, vec![7; 100]);
    }

    #[test]
    fn taken_piece_by_piece_it_is_the_same_file() {
        let (mut whole, mut pieces) = (Recording::new("test"), Recording::new("test"));
        let mut file = Vec::new();
        let channels = [&mut whole, &mut pieces].map(|r| r.channel("/a", "some.Message", b"x"));
        for time in 0..50 {
            message(&mut whole, channels[0], time);
            message(&mut pieces, channels[1], time);
            if time % 20 == 10 {
                whole.close_chunk();
                pieces.close_chunk();
                file.extend(pieces.take());
            }
        }
        assert_eq!(pieces.chunks(), 2);
        file.extend(pieces.end());
        assert_eq!(file, whole.end());
    }
}
