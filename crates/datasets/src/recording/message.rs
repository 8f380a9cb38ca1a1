//! The message types that hold poses, in the two ways that ROS writes them; those of Foxglove are in [`foxglove`].

use super::container::Encoding;
use super::foxglove;

/// A stamp, the frames and the numbers of a pose, as they stand in a message.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stamped {
    /// Nanoseconds; `None` for messages without a header.
    pub stamp: Option<i64>,
    /// The frame that the pose is given in.
    pub parent: String,
    /// The frame of the moving body, where the message says it.
    pub child: String,
    pub position: [f64; 3],
    /// x, y, z, w.
    pub quaternion: [f64; 4],
}

impl Stamped {
    /// A message that says nothing; a quaternion of zeros is no pose.
    pub fn unsaid() -> Self {
        Self {
            stamp: None,
            parent: String::new(),
            child: String::new(),
            position: [0.0; 3],
            quaternion: [0.0; 4],
        }
    }
}

/// What a type of message is to a reader of poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// One pose a message.
    Pose(Shape),
    /// A path so far a message; the last one holds all.
    Path,
    /// Transforms between frames.
    Transforms(Transforms),
    /// Holds positions, and no pose of one body, for this reason.
    Refused(&'static str),
    /// Something else.
    Other,
}

/// The message that transforms come in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Transforms {
    /// Those of ROS, many a message.
    Tf,
    /// `FrameTransform` of Foxglove.
    Frame,
    /// `FrameTransforms` of Foxglove.
    Frames,
}

impl Transforms {
    pub fn of_foxglove(self) -> bool {
        self != Self::Tf
    }
}

/// The order of fields in a message with one pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    Pose,
    Stamped,
    Transform,
    Odometry,
    InFrame,
}

/// The kind of a type like `nav_msgs/Odometry`.
pub(crate) fn kind(name: &str) -> Kind {
    match name {
        "geometry_msgs/Pose" | "geometry_msgs/PoseWithCovariance" => Kind::Pose(Shape::Pose),
        "geometry_msgs/PoseStamped" | "geometry_msgs/PoseWithCovarianceStamped" => {
            Kind::Pose(Shape::Stamped)
        }
        "geometry_msgs/TransformStamped" => Kind::Pose(Shape::Transform),
        "nav_msgs/Odometry" => Kind::Pose(Shape::Odometry),
        "foxglove_msgs/PoseInFrame" | "foxglove/PoseInFrame" | "foxglove.PoseInFrame" => {
            Kind::Pose(Shape::InFrame)
        }
        "nav_msgs/Path" => Kind::Path,
        "tf2_msgs/TFMessage" | "tf/tfMessage" => Kind::Transforms(Transforms::Tf),
        "foxglove.FrameTransform" => Kind::Transforms(Transforms::Frame),
        "foxglove.FrameTransforms" => Kind::Transforms(Transforms::Frames),
        "geometry_msgs/PointStamped" | "geometry_msgs/Point" | "sensor_msgs/NavSatFix" => {
            Kind::Refused("positions without an orientation")
        }
        "geometry_msgs/PoseArray" | "foxglove.PosesInFrame" => {
            Kind::Refused("many poses a message that belong to no one body")
        }
        "geometry_msgs/TwistStamped" | "geometry_msgs/Twist" => {
            Kind::Refused("velocities, not poses")
        }
        _ => Kind::Other,
    }
}

/// Numbers and strings of a message off its front.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// CDR aligns each number to its size, counted from behind its head of four bytes.
    aligned: bool,
    big: bool,
    /// ROS 1 headers begin with a counter.
    counter: bool,
    /// Version 2 of CDR aligns to four bytes at most.
    widest: usize,
}

impl<'a> Reader<'a> {
    fn new(content: &'a [u8], encoding: Encoding) -> Option<Self> {
        match encoding {
            Encoding::Ros1 => Some(Self {
                bytes: content,
                at: 0,
                aligned: false,
                big: false,
                counter: true,
                widest: 1,
            }),
            Encoding::Cdr => {
                let (head, body) = content.split_at_checked(4)?;
                let widest = if head[1] >= 6 { 4 } else { 8 };
                Some(Self {
                    bytes: body,
                    at: 0,
                    aligned: true,
                    big: head[1] & 1 == 0,
                    counter: false,
                    widest,
                })
            }
            Encoding::Protobuf | Encoding::Json | Encoding::Other => None,
        }
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        if self.aligned {
            let width = N.min(self.widest);
            self.at = self.at.next_multiple_of(width);
        }
        let mut bytes: [u8; N] = self.bytes.get(self.at..self.at + N)?.try_into().ok()?;
        self.at += N;
        if self.big {
            bytes.reverse();
        }
        Some(bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take()?))
    }

    fn f64(&mut self) -> Option<f64> {
        Some(f64::from_le_bytes(self.take()?))
    }

    fn text(&mut self) -> Option<String> {
        let length = self.u32()? as usize;
        let bytes = self.bytes.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        Some(String::from_utf8_lossy(bytes).into_owned())
    }

    fn time(&mut self) -> Option<i64> {
        let seconds = self.u32()?;
        let nanoseconds = self.u32()?;
        // ROS 2 has signed seconds, ROS 1 unsigned ones.
        let seconds = if self.counter {
            i64::from(seconds)
        } else {
            i64::from(seconds as i32)
        };
        Some(seconds * 1_000_000_000 + i64::from(nanoseconds))
    }

    fn header(&mut self) -> Option<(i64, String)> {
        if self.counter {
            self.u32()?;
        }
        Some((self.time()?, self.text()?))
    }

    fn numbers<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Some(values)
    }
}

/// The one pose of a message; `None` where the content is shorter than its type says.
pub(crate) fn pose(content: &[u8], encoding: Encoding, shape: Shape) -> Option<Stamped> {
    match (encoding, shape) {
        (Encoding::Protobuf, Shape::InFrame) => return foxglove::pose_of_protobuf(content),
        (Encoding::Json, Shape::InFrame) => return foxglove::pose_of_json(content),
        _ => {}
    }
    let mut reader = Reader::new(content, encoding)?;
    let (stamp, parent) = match shape {
        Shape::Pose => (None, String::new()),
        Shape::InFrame => (Some(reader.time()?), reader.text()?),
        _ => reader.header().map(|(stamp, frame)| (Some(stamp), frame))?,
    };
    let child = match shape {
        Shape::Transform | Shape::Odometry => reader.text()?,
        _ => String::new(),
    };
    Some(Stamped {
        stamp,
        parent,
        child,
        position: reader.numbers()?,
        quaternion: reader.numbers()?,
    })
}

/// The poses of a path.
pub(crate) fn path(content: &[u8], encoding: Encoding) -> Option<Vec<Stamped>> {
    let mut reader = Reader::new(content, encoding)?;
    reader.header()?;
    many(&mut reader, false)
}

/// The transforms of a message.
pub(crate) fn transforms(
    content: &[u8],
    encoding: Encoding,
    kind: Transforms,
) -> Option<Vec<Stamped>> {
    let one = |transform: Option<Stamped>| transform.map(|transform| vec![transform]);
    match (kind, encoding) {
        (Transforms::Tf, _) => many(&mut Reader::new(content, encoding)?, true),
        (Transforms::Frame, Encoding::Protobuf) => one(foxglove::transform_of_protobuf(content)),
        (Transforms::Frame, Encoding::Json) => one(foxglove::transform_of_json(content)),
        (Transforms::Frames, Encoding::Protobuf) => foxglove::transforms_of_protobuf(content),
        (Transforms::Frames, Encoding::Json) => foxglove::transforms_of_json(content),
        _ => None,
    }
}

fn many(reader: &mut Reader<'_>, children: bool) -> Option<Vec<Stamped>> {
    let count = reader.u32()? as usize;
    let mut all = Vec::new();
    for _ in 0..count {
        let (stamp, parent) = reader.header()?;
        let child = if children {
            reader.text()?
        } else {
            String::new()
        };
        all.push(Stamped {
            stamp: Some(stamp),
            parent,
            child,
            position: reader.numbers()?,
            quaternion: reader.numbers()?,
        });
    }
    Some(all)
}
