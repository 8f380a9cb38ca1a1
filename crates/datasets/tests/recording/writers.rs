//! Writers of small recordings.

use std::io::Write as _;

/// Which ROS writes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Ros {
    One,
    Two,
}

pub struct Channel {
    pub id: u32,
    pub topic: String,
    pub kind: String,
}

pub struct Message {
    pub channel: u32,
    pub time: i64,
    pub content: Vec<u8>,
}

/// One message, field by field.
pub struct Writer {
    ros: Ros,
    bytes: Vec<u8>,
}

impl Ros {
    pub fn message(self) -> Writer {
        Writer {
            ros: self,
            bytes: Vec::new(),
        }
    }
}

impl Writer {
    fn align(&mut self, size: usize) {
        if self.ros == Ros::Two {
            self.bytes
                .resize(self.bytes.len().next_multiple_of(size), 0);
        }
    }

    pub fn u32(&mut self, value: u32) -> &mut Self {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
        self
    }

    pub fn text(&mut self, text: &str) -> &mut Self {
        let end = if self.ros == Ros::Two { "\0" } else { "" };
        self.u32((text.len() + end.len()) as u32);
        self.bytes.extend(text.bytes().chain(end.bytes()));
        self
    }

    pub fn header(&mut self, stamp: i64, frame: &str) -> &mut Self {
        if self.ros == Ros::One {
            self.u32(9);
        }
        self.u32((stamp / 1_000_000_000) as u32)
            .u32((stamp % 1_000_000_000) as u32)
            .text(frame)
    }

    pub fn numbers(&mut self, values: &[f64]) -> &mut Self {
        for value in values {
            self.align(8);
            self.bytes.extend(value.to_le_bytes());
        }
        self
    }

    pub fn done(self) -> Vec<u8> {
        match self.ros {
            Ros::One => self.bytes,
            Ros::Two => [vec![0, 1, 0, 0], self.bytes].concat(),
        }
    }
}

fn pack(bytes: &[u8], compression: &str) -> Vec<u8> {
    match compression {
        "lz4" => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        }
        "bz2" => {
            let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        }
        "zstd" => {
            let level = ruzstd::encoding::CompressionLevel::Fastest;
            ruzstd::encoding::compress_to_vec(bytes, level)
        }
        _ => bytes.to_vec(),
    }
}

fn block(text: &[u8]) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text].concat()
}

/// An MCAP file of ROS with `per_chunk` messages a chunk (0: without chunks), with an index or without.
pub fn mcap(
    ros: Ros,
    channels: &[Channel],
    messages: &[Message],
    compression: &str,
    per_chunk: usize,
    index: bool,
) -> Vec<u8> {
    let encoding = match ros {
        Ros::One => "ros1",
        Ros::Two => "cdr",
    };
    mcap_of(encoding, channels, messages, compression, per_chunk, index)
}

/// The same of messages in any encoding.
pub fn mcap_of(
    encoding: &str,
    channels: &[Channel],
    messages: &[Message],
    compression: &str,
    per_chunk: usize,
    index: bool,
) -> Vec<u8> {
    let record = |code: u8, content: &[u8]| {
        [&[code][..], &(content.len() as u64).to_le_bytes(), content].concat()
    };
    let middle = if encoding == "cdr" { "/msg/" } else { "/" };
    let names: Vec<u8> = channels
        .iter()
        .flat_map(|channel| {
            let id = (channel.id as u16).to_le_bytes();
            let kind = channel.kind.replace('/', middle);
            let schema = [
                &id[..],
                &block(kind.as_bytes()),
                &block(encoding.as_bytes()),
                &block(b""),
            ]
            .concat();
            let own = [
                &id[..],
                &id,
                &block(channel.topic.as_bytes()),
                &block(encoding.as_bytes()),
                &block(b""),
            ]
            .concat();
            [record(3, &schema), record(4, &own)].concat()
        })
        .collect();
    let message = |message: &Message| {
        let time = (message.time as u64).to_le_bytes();
        record(
            5,
            &[
                &(message.channel as u16).to_le_bytes()[..],
                &[0; 4],
                &time,
                &time,
                &message.content,
            ]
            .concat(),
        )
    };
    let mut out = [
        b"\x89MCAP0\r\n".to_vec(),
        record(1, &[block(b""), block(b"test")].concat()),
    ]
    .concat();
    let mut indices = Vec::new();
    if per_chunk == 0 {
        out.extend(&names);
        messages.iter().for_each(|each| out.extend(message(each)));
    }
    for part in messages.chunks(per_chunk.max(1)).filter(|_| per_chunk > 0) {
        let records = [names.clone(), part.iter().flat_map(message).collect()].concat();
        let packed = pack(&records, compression);
        let chunk = [
            &[0; 16][..],
            &(records.len() as u64).to_le_bytes(),
            &[0; 4],
            &block(compression.as_bytes()),
            &(packed.len() as u64).to_le_bytes(),
            &packed,
        ]
        .concat();
        let channels: Vec<u8> = part
            .iter()
            .flat_map(|each| [&(each.channel as u16).to_le_bytes()[..], &[0; 8]].concat())
            .collect();
        indices.extend(record(
            8,
            &[
                &[0; 16][..],
                &(out.len() as u64).to_le_bytes(),
                &[0; 8],
                &block(&channels),
                &[0; 8],
                &block(compression.as_bytes()),
                &(packed.len() as u64).to_le_bytes(),
                &(records.len() as u64).to_le_bytes(),
            ]
            .concat(),
        ));
        out.extend(record(6, &chunk));
    }
    out.extend(record(15, &[0; 4]));
    let start = if index { out.len() as u64 } else { 0 };
    if index {
        out.extend(&names);
        out.extend(&indices);
        let counts: Vec<u8> = channels
            .iter()
            .flat_map(|channel| {
                let count = messages
                    .iter()
                    .filter(|message| message.channel == channel.id)
                    .count() as u64;
                [&(channel.id as u16).to_le_bytes()[..], &count.to_le_bytes()].concat()
            })
            .collect();
        out.extend(record(11, &[&[0; 42][..], &block(&counts)].concat()));
    }
    out.extend(record(2, &[&start.to_le_bytes()[..], &[0; 12]].concat()));
    out.extend(b"\x89MCAP0\r\n");
    out
}

/// A ROS 1 bag, closed (with an index) or not.
pub fn bag(
    channels: &[Channel],
    messages: &[Message],
    compression: &str,
    per_chunk: usize,
    closed: bool,
) -> Vec<u8> {
    let record = |fields: &[(&str, Vec<u8>)], data: &[u8]| {
        let header: Vec<u8> = fields
            .iter()
            .flat_map(|(name, value)| block(&[name.as_bytes(), b"=", value].concat()))
            .collect();
        [block(&header), block(data)].concat()
    };
    let connection = |channel: &Channel| {
        let kind = channel.kind.clone().into_bytes();
        let data: Vec<u8> = [
            ("topic", channel.topic.clone().into_bytes()),
            ("type", kind),
        ]
        .iter()
        .flat_map(|(name, value)| block(&[name.as_bytes(), b"=", value].concat()))
        .collect();
        let id = channel.id.to_le_bytes().to_vec();
        record(
            &[
                ("op", vec![7]),
                ("conn", id),
                ("topic", channel.topic.clone().into_bytes()),
            ],
            &data,
        )
    };
    let time = |time: i64| {
        [
            ((time / 1_000_000_000) as u32).to_le_bytes(),
            ((time % 1_000_000_000) as u32).to_le_bytes(),
        ]
        .concat()
    };
    let header = |index: u64| {
        let fields = [
            ("op", vec![3]),
            ("index_pos", index.to_le_bytes().to_vec()),
            ("conn_count", vec![0; 4]),
            ("chunk_count", vec![0; 4]),
        ];
        record(&fields, &[b' '; 40])
    };
    let mut out = [b"#ROSBAG V2.0\n".to_vec(), header(0)].concat();
    let mut infos = Vec::new();
    for part in messages.chunks(per_chunk) {
        let mut records: Vec<u8> = channels.iter().flat_map(connection).collect();
        for message in part {
            let id = message.channel.to_le_bytes().to_vec();
            records.extend(record(
                &[("op", vec![2]), ("conn", id), ("time", time(message.time))],
                &message.content,
            ));
        }
        let counts: Vec<u8> = channels
            .iter()
            .flat_map(|channel| {
                let count = part
                    .iter()
                    .filter(|message| message.channel == channel.id)
                    .count() as u32;
                [channel.id.to_le_bytes(), count.to_le_bytes()].concat()
            })
            .collect();
        infos.extend(record(
            &[
                ("op", vec![6]),
                ("ver", vec![1, 0, 0, 0]),
                ("chunk_pos", (out.len() as u64).to_le_bytes().to_vec()),
            ],
            &counts,
        ));
        let size = (records.len() as u32).to_le_bytes().to_vec();
        out.extend(record(
            &[
                ("op", vec![5]),
                ("compression", compression.as_bytes().to_vec()),
                ("size", size),
            ],
            &pack(&records, compression),
        ));
    }
    if closed {
        let index = out.len() as u64;
        out.extend(channels.iter().flat_map(connection));
        out.extend(infos);
        let head = header(index);
        out[13..13 + head.len()].copy_from_slice(&head);
    }
    out
}

const PAGE: usize = 512;

fn varint(value: u64) -> Vec<u8> {
    let mut bytes = vec![(value & 0x7f) as u8];
    let mut rest = value >> 7;
    while rest > 0 {
        bytes.insert(0, (rest & 0x7f) as u8 | 0x80);
        rest >>= 7;
    }
    bytes
}

enum Value<'v> {
    Null,
    Integer(i64),
    Text(&'v str),
    Blob(&'v [u8]),
}

fn row(values: &[Value<'_>]) -> Vec<u8> {
    let (mut types, mut body) = (Vec::new(), Vec::new());
    for value in values {
        match value {
            Value::Null => types.extend(varint(0)),
            Value::Integer(number) => {
                types.extend(varint(6));
                body.extend(number.to_be_bytes());
            }
            Value::Text(text) => {
                types.extend(varint(13 + 2 * text.len() as u64));
                body.extend(text.as_bytes());
            }
            Value::Blob(blob) => {
                types.extend(varint(12 + 2 * blob.len() as u64));
                body.extend(*blob);
            }
        }
    }
    [varint(types.len() as u64 + 1), types, body].concat()
}

/// Pages of a database: leaves under one root, long rows on pages of their own.
struct Pages(Vec<Vec<u8>>);

impl Pages {
    fn add(&mut self, page: Vec<u8>) -> u32 {
        self.0.push(page);
        self.0.len() as u32
    }

    /// A cell with its payload, the end of a long one on other pages.
    fn cell(&mut self, id: u64, payload: &[u8]) -> Vec<u8> {
        let most = PAGE - 35;
        let mut cell = [varint(payload.len() as u64), varint(id)].concat();
        if payload.len() <= most {
            cell.extend(payload);
            return cell;
        }
        let least = (PAGE - 12) * 32 / 255 - 23;
        let rest = least + (payload.len() - least) % (PAGE - 4);
        let local = if rest <= most { rest } else { least };
        let mut next = 0_u32;
        let parts: Vec<&[u8]> = payload[local..].chunks(PAGE - 4).collect();
        for part in parts.into_iter().rev() {
            let mut page = [&next.to_be_bytes()[..], part].concat();
            page.resize(PAGE, 0);
            next = self.add(page);
        }
        cell.extend(&payload[..local]);
        cell.extend(next.to_be_bytes());
        cell
    }

    fn leaf(cells: &[Vec<u8>], first: bool) -> Vec<u8> {
        let mut page = vec![0; PAGE];
        let start = if first { 100 } else { 0 };
        page[start] = 0x0d;
        page[start + 3..start + 5].copy_from_slice(&(cells.len() as u16).to_be_bytes());
        let mut end = PAGE;
        for (index, cell) in cells.iter().enumerate() {
            end -= cell.len();
            page[end..end + cell.len()].copy_from_slice(cell);
            let at = start + 8 + 2 * index;
            assert!(at + 2 <= end, "a leaf that is too full");
            page[at..at + 2].copy_from_slice(&(end as u16).to_be_bytes());
        }
        page
    }

    /// A table whose rows have leaves of their own below an inner page.
    fn table(&mut self, rows: &[Vec<u8>]) -> u32 {
        let leaves: Vec<u32> = rows
            .iter()
            .enumerate()
            .map(|(index, payload)| {
                let cell = self.cell(index as u64 + 1, payload);
                self.add(Self::leaf(&[cell], false))
            })
            .collect();
        self.inner(&leaves, 0)
    }

    /// Inner pages of twenty children each, as many levels as it takes.
    fn inner(&mut self, children: &[u32], depth: usize) -> u32 {
        if children.len() == 1 && depth > 0 {
            return children[0];
        }
        let level: Vec<u32> = children
            .chunks(20)
            .map(|part| {
                let mut page = vec![0; PAGE];
                page[0] = 0x05;
                let (last, others) = part.split_last().unwrap();
                page[3..5].copy_from_slice(&(others.len() as u16).to_be_bytes());
                page[8..12].copy_from_slice(&last.to_be_bytes());
                let mut end = PAGE;
                for (index, child) in others.iter().enumerate() {
                    let cell = [&child.to_be_bytes()[..], &varint(index as u64 + 1)].concat();
                    end -= cell.len();
                    page[end..end + cell.len()].copy_from_slice(&cell);
                    page[12 + 2 * index..14 + 2 * index]
                        .copy_from_slice(&(end as u16).to_be_bytes());
                }
                self.add(page)
            })
            .collect();
        self.inner(&level, depth + 1)
    }
}

/// A ROS 2 bag in SQLite.
pub fn rosbag2(channels: &[Channel], messages: &[Message]) -> Vec<u8> {
    let mut pages = Pages(vec![Vec::new()]);
    let topics: Vec<Vec<u8>> = channels
        .iter()
        .map(|channel| {
            let kind = channel.kind.replace('/', "/msg/");
            row(&[
                Value::Null,
                Value::Text(&channel.topic),
                Value::Text(&kind),
                Value::Text("cdr"),
                Value::Text(""),
            ])
        })
        .collect();
    // The number of a topic is that of its row.
    assert!(
        channels
            .iter()
            .enumerate()
            .all(|(index, channel)| channel.id as usize == index + 1)
    );
    let rows: Vec<Vec<u8>> = messages
        .iter()
        .map(|message| {
            row(&[
                Value::Null,
                Value::Integer(message.channel.into()),
                Value::Integer(message.time),
                Value::Blob(&message.content),
            ])
        })
        .collect();
    let (topics, messages) = (pages.table(&topics), pages.table(&rows));
    let schema = |name: &str, root: u32| {
        row(&[
            Value::Text("table"),
            Value::Text(name),
            Value::Text(name),
            Value::Integer(root.into()),
            Value::Text("CREATE TABLE"),
        ])
    };
    let cells = [
        pages.cell(1, &schema("topics", topics)),
        pages.cell(2, &schema("messages", messages)),
    ];
    let mut first = Pages::leaf(&cells, true);
    first[..16].copy_from_slice(b"SQLite format 3\0");
    first[16..18].copy_from_slice(&(PAGE as u16).to_be_bytes());
    pages.0[0] = first;
    pages.0.concat()
}
