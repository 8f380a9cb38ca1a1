//! Writers of Foxglove's messages.

/// How they are written.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Protobuf,
    Json,
}

impl Encoding {
    pub fn name(self) -> &'static str {
        match self {
            Self::Protobuf => "protobuf",
            Self::Json => "json",
        }
    }

    /// A `PoseInFrame`: position, and quaternion x, y, z, w.
    pub fn pose(self, stamp: i64, frame: &str, p: [f64; 3], q: [f64; 4]) -> Vec<u8> {
        match self {
            Self::Protobuf => {
                let pose = [part(1, &doubles(&p)), part(2, &doubles(&q))].concat();
                let fields = [
                    part(1, &time(stamp)),
                    part(2, frame.as_bytes()),
                    part(3, &pose),
                ];
                fields.concat()
            }
            Self::Json => format!(
                r#"{{"timestamp":{},"frame_id":"{frame}","pose":{{"position":{},"orientation":{}}}}}"#,
                json_time(stamp),
                json(&p),
                json(&q)
            )
            .into_bytes(),
        }
    }

    /// A `FrameTransform`.
    pub fn transform(
        self,
        stamp: i64,
        parent: &str,
        child: &str,
        p: [f64; 3],
        q: [f64; 4],
    ) -> Vec<u8> {
        match self {
            Self::Protobuf => [
                part(1, &time(stamp)),
                part(2, parent.as_bytes()),
                part(3, child.as_bytes()),
                part(4, &doubles(&p)),
                part(5, &doubles(&q)),
            ]
            .concat(),
            Self::Json => format!(
                r#"{{"timestamp":{},"parent_frame_id":"{parent}","child_frame_id":"{child}","translation":{},"rotation":{}}}"#,
                json_time(stamp),
                json(&p),
                json(&q)
            )
            .into_bytes(),
        }
    }

    /// `FrameTransforms` of such.
    pub fn transforms(self, all: &[Vec<u8>]) -> Vec<u8> {
        match self {
            Self::Protobuf => all.iter().flat_map(|each| part(1, each)).collect(),
            Self::Json => {
                let all = all.join(&b',');
                [&br#"{"transforms":["#[..], &all, b"]}"].concat()
            }
        }
    }
}

pub fn varint(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

/// A field with bytes.
fn part(field: u64, content: &[u8]) -> Vec<u8> {
    [
        varint(field << 3 | 2),
        varint(content.len() as u64),
        content.to_vec(),
    ]
    .concat()
}

/// Fields 1, 2, ... with doubles, zeros left out as protobuf does, and one of later versions that readers pass over.
fn doubles(values: &[f64]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (index, value) in values.iter().enumerate() {
        if *value != 0.0 {
            bytes.extend(varint((index as u64 + 1) << 3 | 1));
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes.extend(part(100, b"a name of its own"));
    bytes
}

fn time(stamp: i64) -> Vec<u8> {
    [
        varint(1 << 3),
        varint(stamp as u64 / 1_000_000_000),
        varint(2 << 3),
        varint(stamp as u64 % 1_000_000_000),
    ]
    .concat()
}

fn json_time(stamp: i64) -> String {
    let (sec, nsec) = (stamp / 1_000_000_000, stamp % 1_000_000_000);
    format!(r#"{{"sec":{sec},"nsec":{nsec}}}"#)
}

fn json(values: &[f64]) -> String {
    let fields = ["x", "y", "z", "w"].iter().zip(values);
    let fields: Vec<String> = fields
        .map(|(name, value)| {
            let value = if value.is_finite() {
                format!("{value:?}")
            } else {
                "null".to_owned()
            };
            format!(r#""{name}":{value}"#)
        })
        .collect();
    format!("{{{}}}", fields.join(","))
}
