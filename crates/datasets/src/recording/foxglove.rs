//! Poses and transforms of Foxglove (<https://docs.foxglove.dev/docs/sdk/schemas>) in MCAP: `PoseInFrame`, `FrameTransform`
//! and `FrameTransforms`, as protobuf (the few rules of its encoding that these need) and as JSON.

use serde::Deserialize;

use super::message::Stamped;

/// The pose of a `PoseInFrame` in protobuf; `None` where the content is none.
pub(super) fn pose_of_protobuf(content: &[u8]) -> Option<Stamped> {
    let mut found = Stamped::unsaid();
    each_field(content, |field| {
        match field {
            (1, Value::Bytes(time)) => found.stamp = Some(stamp(time)?),
            (2, Value::Bytes(name)) => found.parent = text(name)?,
            (3, Value::Bytes(pose)) => each_field(pose, |field| {
                match field {
                    (1, Value::Bytes(position)) => found.position = numbers(position)?,
                    (2, Value::Bytes(quaternion)) => found.quaternion = numbers(quaternion)?,
                    _ => {}
                }
                Some(())
            })?,
            _ => {}
        }
        Some(())
    })?;
    Some(found)
}

/// The transform of a `FrameTransform` in protobuf.
pub(super) fn transform_of_protobuf(content: &[u8]) -> Option<Stamped> {
    let mut found = Stamped::unsaid();
    each_field(content, |field| {
        match field {
            (1, Value::Bytes(time)) => found.stamp = Some(stamp(time)?),
            (2, Value::Bytes(name)) => found.parent = text(name)?,
            (3, Value::Bytes(name)) => found.child = text(name)?,
            (4, Value::Bytes(translation)) => found.position = numbers(translation)?,
            (5, Value::Bytes(rotation)) => found.quaternion = numbers(rotation)?,
            _ => {}
        }
        Some(())
    })?;
    Some(found)
}

/// The transforms of `FrameTransforms` in protobuf.
pub(super) fn transforms_of_protobuf(content: &[u8]) -> Option<Vec<Stamped>> {
    let mut all = Vec::new();
    each_field(content, |field| {
        if let (1, Value::Bytes(transform)) = field {
            all.push(transform_of_protobuf(transform)?);
        }
        Some(())
    })?;
    Some(all)
}

/// The value of a field of a message.
enum Value<'a> {
    Number(u64),
    /// Eight bytes: a double, for the fields read here.
    Double(f64),
    Bytes(&'a [u8]),
    Other,
}

/// Visits the fields of a message, numbers with values, in the order in which they stand; a later one counts.
fn each_field<'a>(
    mut rest: &'a [u8],
    mut visit: impl FnMut((u64, Value<'a>)) -> Option<()>,
) -> Option<()> {
    while !rest.is_empty() {
        let tag = varint(&mut rest)?;
        let value = match tag & 7 {
            0 => Value::Number(varint(&mut rest)?),
            1 => Value::Double(f64::from_le_bytes(take(&mut rest, 8)?.try_into().ok()?)),
            2 => {
                let length = usize::try_from(varint(&mut rest)?).ok()?;
                Value::Bytes(take(&mut rest, length)?)
            }
            5 => {
                take(&mut rest, 4)?;
                Value::Other
            }
            _ => return None,
        };
        visit((tag >> 3, value))?;
    }
    Some(())
}

fn take<'a>(rest: &mut &'a [u8], length: usize) -> Option<&'a [u8]> {
    let (front, back) = rest.split_at_checked(length)?;
    *rest = back;
    Some(front)
}

/// Seven bits a byte, the lowest first.
fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let byte = take(rest, 1)?[0];
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

/// Doubles that are the fields 1, 2, ... of a message; those that are zero are not written.
fn numbers<const N: usize>(content: &[u8]) -> Option<[f64; N]> {
    let mut values = [0.0; N];
    each_field(content, |(field, value)| {
        let index = usize::try_from(field).ok()?.checked_sub(1);
        if let (Some(slot), Value::Double(value)) = (index.and_then(|at| values.get_mut(at)), value)
        {
            *slot = value;
        }
        Some(())
    })?;
    Some(values)
}

/// Nanoseconds of a `google.protobuf.Timestamp`.
fn stamp(content: &[u8]) -> Option<i64> {
    let (mut seconds, mut nanoseconds) = (0, 0);
    each_field(content, |field| {
        match field {
            (1, Value::Number(value)) => seconds = value,
            (2, Value::Number(value)) => nanoseconds = value,
            _ => {}
        }
        Some(())
    })?;
    nanoseconds_of(seconds, nanoseconds)
}

/// Times from 1970 to 2106, as ROS has them too.
fn nanoseconds_of(seconds: u64, nanoseconds: u64) -> Option<i64> {
    let (seconds, nanoseconds) = (
        u32::try_from(seconds).ok()?,
        u32::try_from(nanoseconds).ok()?,
    );
    Some(i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds))
}

fn text(content: &[u8]) -> Option<String> {
    String::from_utf8(content.to_vec()).ok()
}

/// The pose of a `PoseInFrame` in JSON.
pub(super) fn pose_of_json(content: &[u8]) -> Option<Stamped> {
    let message: PoseInFrame = serde_json::from_slice(content).ok()?;
    Some(Stamped {
        stamp: message.timestamp.nanoseconds()?,
        parent: message.frame_id,
        child: String::new(),
        position: message.pose.position.xyz(),
        quaternion: message.pose.orientation.xyzw(),
    })
}

/// The transform of a `FrameTransform` in JSON.
pub(super) fn transform_of_json(content: &[u8]) -> Option<Stamped> {
    let message: FrameTransform = serde_json::from_slice(content).ok()?;
    message.stamped()
}

/// The transforms of `FrameTransforms` in JSON.
pub(super) fn transforms_of_json(content: &[u8]) -> Option<Vec<Stamped>> {
    let message: FrameTransforms = serde_json::from_slice(content).ok()?;
    let transforms = message.transforms.into_iter();
    transforms.map(FrameTransform::stamped).collect()
}

#[derive(Deserialize)]
struct PoseInFrame {
    #[serde(default)]
    timestamp: Time,
    #[serde(default)]
    frame_id: String,
    pose: Pose,
}

#[derive(Deserialize)]
struct Pose {
    position: Numbers,
    orientation: Numbers,
}

#[derive(Deserialize)]
struct FrameTransforms {
    transforms: Vec<FrameTransform>,
}

#[derive(Deserialize)]
struct FrameTransform {
    #[serde(default)]
    timestamp: Time,
    parent_frame_id: String,
    child_frame_id: String,
    translation: Numbers,
    rotation: Numbers,
}

impl FrameTransform {
    fn stamped(self) -> Option<Stamped> {
        Some(Stamped {
            stamp: self.timestamp.nanoseconds()?,
            parent: self.parent_frame_id,
            child: self.child_frame_id,
            position: self.translation.xyz(),
            quaternion: self.rotation.xyzw(),
        })
    }
}

#[derive(Deserialize, Default)]
struct Time {
    sec: Option<u64>,
    nsec: Option<u64>,
}

impl Time {
    /// `Some(None)` where the message has no time, `None` where it has an impossible one.
    fn nanoseconds(&self) -> Option<Option<i64>> {
        match (self.sec, self.nsec) {
            (None, None) => Some(None),
            (sec, nsec) => nanoseconds_of(sec.unwrap_or(0), nsec.unwrap_or(0)).map(Some),
        }
    }
}

/// A vector or a quaternion; `null`, as JSON writes NaN, is no number.
#[derive(Deserialize)]
struct Numbers {
    x: Option<f64>,
    y: Option<f64>,
    z: Option<f64>,
    w: Option<f64>,
}

impl Numbers {
    fn xyz(&self) -> [f64; 3] {
        [self.x, self.y, self.z].map(|value| value.unwrap_or(f64::NAN))
    }

    fn xyzw(&self) -> [f64; 4] {
        [self.x, self.y, self.z, self.w].map(|value| value.unwrap_or(f64::NAN))
    }
}
