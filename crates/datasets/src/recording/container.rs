//! What the kinds of recording have in common: channels, and messages of some of them.

use std::collections::{HashMap, HashSet};
use std::io::Read;

use super::data::Data;
use super::{bag, mcap, sqlite};

/// How messages are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// ROS 1.
    Ros1,
    /// Common data representation, ROS 2.
    Cdr,
    /// Protocol buffers, of Foxglove.
    Protobuf,
    /// JSON, of Foxglove.
    Json,
    /// Anything else.
    Other,
}

/// One topic with its type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Channel {
    pub id: u32,
    pub topic: String,
    /// Like `nav_msgs/Odometry`, the same for ROS 1 and ROS 2.
    pub kind: String,
    pub encoding: Encoding,
    /// Number of messages, where the recording says it.
    pub messages: Option<u64>,
}

/// `nav_msgs/msg/Odometry` is `nav_msgs/Odometry`.
pub(crate) fn plain_kind(kind: &str) -> String {
    kind.replace("/msg/", "/")
}

/// Why a container cannot be read (on).
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Fault {
    /// It is not what it should be; says what was found.
    Damaged(String),
    /// The file system failed.
    Io(String),
    /// The messages were enough, or one of them was at fault.
    Stop,
}

impl From<std::io::Error> for Fault {
    fn from(error: std::io::Error) -> Self {
        match error.kind() {
            std::io::ErrorKind::UnexpectedEof => {
                Self::Damaged("the end of the file within a record".to_owned())
            }
            _ => Self::Io(error.to_string()),
        }
    }
}

/// Takes a message: channel, time of recording in nanoseconds, content.
pub(crate) type Visitor<'v> = dyn FnMut(u32, i64, &[u8]) -> Result<(), Fault> + 'v;

/// A recording of any kind.
pub(crate) enum Container<'a> {
    Mcap(mcap::Mcap<'a>),
    Bag(bag::Bag<'a>),
    Sqlite(sqlite::Recording<'a>),
}

impl<'a> Container<'a> {
    /// Opens the recording that its first bytes say.
    pub fn open(data: Data<'a>) -> Result<Self, Fault> {
        let magic = data.read(0, data.len().min(16))?.into_owned();
        if magic.starts_with(b"\x89MCAP") {
            Ok(Self::Mcap(mcap::Mcap::open(data)?))
        } else if magic.starts_with(b"#ROSBAG V2") {
            Ok(Self::Bag(bag::Bag::open(data)?))
        } else if magic.starts_with(b"SQLite format 3\0") {
            Ok(Self::Sqlite(sqlite::Recording::open(data)?))
        } else {
            Err(Fault::Damaged("no magic number of a recording".to_owned()))
        }
    }

    pub fn channels(&self) -> &[Channel] {
        match self {
            Self::Mcap(mcap) => &mcap.channels,
            Self::Bag(bag) => &bag.channels,
            Self::Sqlite(recording) => &recording.channels,
        }
    }

    /// Messages of each channel by its number, as far as known.
    pub fn counts(&self) -> HashMap<u32, u64> {
        match self {
            Self::Sqlite(recording) => recording.counts(),
            _ => {
                let channels = self.channels().iter();
                channels
                    .filter_map(|channel| Some((channel.id, channel.messages?)))
                    .collect()
            }
        }
    }

    /// What is damaged although it could be opened.
    pub fn damage(&self) -> Option<&str> {
        match self {
            Self::Mcap(mcap) => mcap.damage.as_deref(),
            Self::Bag(bag) => bag.damage.as_deref(),
            Self::Sqlite(_) => None,
        }
    }

    /// The messages of some channels in the order of the file; what cannot be read any more ends them.
    pub fn messages(&self, wanted: &HashSet<u32>, visit: &mut Visitor<'_>) -> Result<(), Fault> {
        match self {
            Self::Mcap(mcap) => mcap.messages(wanted, visit),
            Self::Bag(bag) => bag.messages(wanted, visit),
            Self::Sqlite(recording) => recording.messages(wanted, visit),
        }
    }
}

/// Unpacks the front of a chunk of `size` bytes, through the record (a code, a length in eight bytes, content) that begins
/// at `last`.
pub(crate) fn unpack_front(
    packed: &[u8],
    compression: &str,
    size: u64,
    last: u64,
) -> Result<Vec<u8>, Fault> {
    const RECORD: u64 = 9;
    let damaged = |fault: &(dyn std::error::Error + 'static)| {
        Fault::Damaged(crate::read::broken(compression, fault))
    };
    let limit = crate::read::chunk_limit(packed.len()).min(size);
    let mut reader: Box<dyn Read + '_> = match compression {
        "zstd" => Box::new(crate::read::zstd_chunk(packed).map_err(|fault| damaged(&fault))?),
        "lz4" => Box::new(lz4_flex::frame::FrameDecoder::new(packed)),
        _ => return unpack(packed, compression, Some(size)),
    };
    let mut out = Vec::new();
    let mut reach = last.saturating_add(RECORD);
    for _ in 0..2 {
        if reach > limit {
            return Err(Fault::Damaged(format!(
                "a chunk that reaches to {} MiB",
                reach >> 20
            )));
        }
        let missing = reach.saturating_sub(out.len() as u64);
        let read = reader.by_ref().take(missing).read_to_end(&mut out);
        if read.map_err(|fault| damaged(&fault))? as u64 != missing {
            return Err(Fault::Damaged("a chunk that ends too early".to_owned()));
        }
        let length = out.get(last as usize + 1..).and_then(|rest| rest.get(..8));
        let length = length
            .and_then(|eight| eight.try_into().ok())
            .map_or(0, u64::from_le_bytes);
        reach = last.saturating_add(RECORD).saturating_add(length);
    }
    Ok(out)
}

/// Unpacks a chunk or a message.
pub(crate) fn unpack(
    packed: &[u8],
    compression: &str,
    expected: Option<u64>,
) -> Result<Vec<u8>, Fault> {
    let limit = crate::read::chunk_limit(packed.len());
    if expected.is_some_and(|expected| expected > limit) {
        return Err(Fault::Damaged(format!(
            "a chunk that claims to unpack to {} MiB",
            expected.unwrap_or(0) >> 20
        )));
    }
    let damaged = |fault: &(dyn std::error::Error + 'static)| {
        Fault::Damaged(crate::read::broken(compression, fault))
    };
    // One byte more than promised shows that there is more.
    let limit = expected.map_or(limit, |expected| expected.saturating_add(1).min(limit));
    let mut out = Vec::new();
    let read = match compression {
        "zstd" => {
            let decoder = crate::read::zstd_chunk(packed).map_err(|fault| damaged(&fault))?;
            decoder.take(limit).read_to_end(&mut out)
        }
        "lz4" => lz4_flex::frame::FrameDecoder::new(packed)
            .take(limit)
            .read_to_end(&mut out),
        "bz2" => bzip2::read::MultiBzDecoder::new(packed)
            .take(limit)
            .read_to_end(&mut out),
        other => return Err(Fault::Damaged(format!("the unknown compression `{other}`"))),
    };
    read.map_err(|fault| damaged(&fault))?;
    if expected.is_some_and(|expected| expected != out.len() as u64) {
        let promised = expected.unwrap_or(0);
        let found = match out.len() as u64 {
            more if more > promised => format!("more than the {promised} bytes that were promised"),
            less => format!("{less} bytes where {promised} were promised"),
        };
        return Err(Fault::Damaged(found));
    }
    Ok(out)
}
