//! Recordings of ROS: MCAP files, ROS 1 bags, ROS 2 bags in SQLite, and folders of them.

mod bag;
mod code;
mod container;
mod contents;
mod data;
mod foxglove;
mod mcap;
mod message;
mod open;
mod sqlite;
mod tf;
pub(crate) mod write;

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use dose3_lie::Pose;
use nalgebra::{Quaternion, UnitQuaternion};

use self::container::{Channel, Container, Encoding, Fault, unpack};
use self::data::Data;
use self::message::{Kind, Stamped};
use crate::error::Place;
use crate::read::Collector;
use crate::{
    Error, Format, Frame, LoadOptions, LostKind, ReadOption, Remark, RemarkKind, RowKind,
    StampUnit, Trajectory,
};

pub(crate) use code::MAGIC;
pub use contents::{Chain, Contents, Topic, contents};
pub(crate) use open::{is_folder, open};

/// The files of one recording, opened; later ones continue the first.
pub(crate) struct Recording<'a> {
    path: PathBuf,
    format: Format,
    parts: Vec<Container<'a>>,
    remarks: Vec<Remark>,
}

/// Takes a message: its channel, the time of recording in nanoseconds, the unpacked content.
/// False where no more are wanted.
type MessageVisitor<'v> = dyn FnMut(&Channel, i64, &[u8]) -> Result<bool, Error> + 'v;

/// A topic over all files of a recording.
struct Merged {
    topic: String,
    kind: String,
}

impl<'a> Recording<'a> {
    /// A recording in memory.
    pub fn from_bytes(path: &Path, bytes: &'a [u8], format: Format) -> Result<Self, Error> {
        let mut recording = Self::new(path, format);
        recording.add(path, Data::Bytes(bytes))?;
        Ok(recording)
    }

    fn new(path: &Path, format: Format) -> Self {
        Self {
            path: path.to_path_buf(),
            format,
            parts: Vec::new(),
            remarks: Vec::new(),
        }
    }

    fn add(&mut self, path: &Path, data: Data<'a>) -> Result<(), Error> {
        let container = Container::open(data).map_err(|fault| broken(path, fault))?;
        if let Some(damage) = container.damage() {
            let text = format!("{damage}; what was whole is read");
            self.remarks
                .push(Remark::new(RemarkKind::DamagedRecording, text));
        }
        self.parts.push(container);
        Ok(())
    }

    fn merged(&self) -> Vec<Merged> {
        let (mut all, mut known) = (Vec::new(), HashSet::new());
        for channel in self.parts.iter().flat_map(Container::channels) {
            if known.insert(&channel.topic) {
                all.push(Merged {
                    topic: channel.topic.clone(),
                    kind: channel.kind.clone(),
                });
            }
        }
        all
    }

    /// The messages of topics that pass, in the order of the files.
    fn messages(
        &self,
        wanted: impl Fn(&Channel) -> bool,
        visit: &mut MessageVisitor<'_>,
    ) -> Result<(), Error> {
        for part in &self.parts {
            let channels: BTreeMap<u32, &Channel> = part
                .channels()
                .iter()
                .filter(|channel| wanted(channel))
                .map(|channel| (channel.id, channel))
                .collect();
            if channels.is_empty() {
                continue;
            }
            let ids: HashSet<u32> = channels.keys().copied().collect();
            let (mut failed, mut enough) = (None, false);
            let result = part.messages(&ids, &mut |id, time, content| {
                let channel = channels[&id];
                // ROS 2 can pack each message; CDR begins with two bytes that zstd does not begin with.
                let packed =
                    channel.encoding == Encoding::Cdr && content.starts_with(b"\x28\xb5\x2f\xfd");
                let result = if packed {
                    visit(channel, time, &unpack(content, "zstd", None)?)
                } else {
                    visit(channel, time, content)
                };
                match result {
                    Ok(true) => Ok(()),
                    Ok(false) => {
                        enough = true;
                        Err(Fault::Stop)
                    }
                    Err(error) => {
                        failed = Some(error);
                        Err(Fault::Stop)
                    }
                }
            });
            match (result, failed) {
                (_, Some(error)) => return Err(error),
                (_, None) if enough => return Ok(()),
                (Err(fault), None) => return Err(broken(&self.path, fault)),
                (Ok(()), None) => {}
            }
        }
        Ok(())
    }

    /// The logs that the options ask for.
    pub fn read(&self, options: &LoadOptions) -> Result<Vec<Trajectory>, Error> {
        if let Some((parent, child)) = &options.tf {
            return Ok(vec![self.read_tf(parent, child, options)?]);
        }
        let merged = self.merged();
        let topics = self.choose(&merged, options)?;
        let single = topics.len() == 1;
        topics
            .into_iter()
            .map(|topic| self.read_topic(topic, single, options))
            .collect()
    }

    fn choose<'m>(
        &self,
        merged: &'m [Merged],
        options: &LoadOptions,
    ) -> Result<Vec<&'m Merged>, Error> {
        let judged =
            |topic: &&Merged| matches!(message::kind(&topic.kind), Kind::Pose(_) | Kind::Path);
        let listed = || {
            let words: Vec<String> = merged
                .iter()
                .map(|topic| format!("{} ({})", topic.topic, topic.kind))
                .collect();
            if words.is_empty() {
                "none".to_owned()
            } else {
                words.join(", ")
            }
        };
        let fault = |expected: String, found: String, hint: &str, option| {
            Err(Error::input(&self.path, Place::File, expected, found, hint).option(option))
        };
        if options.topics.is_empty() {
            let poses: Vec<&Merged> = merged.iter().filter(judged).collect();
            if poses.len() == 1 {
                return Ok(poses);
            }
            if !poses.is_empty() {
                let names: Vec<String> = poses
                    .iter()
                    .map(|topic| format!("{} ({})", topic.topic, topic.kind))
                    .collect();
                return fault(
                    "one topic of poses".to_owned(),
                    names.join(", "),
                    "name the topic",
                    ReadOption::Topic,
                );
            }
            let transforms = merged
                .iter()
                .any(|topic| matches!(message::kind(&topic.kind), Kind::Transforms(_)));
            let refused = merged
                .iter()
                .find_map(|topic| match message::kind(&topic.kind) {
                    Kind::Refused(reason) => Some(format!("{} holds {reason}", topic.topic)),
                    _ => None,
                });
            let (hint, option) = if transforms {
                (
                    "name the two frames of a pose in the transforms".to_owned(),
                    ReadOption::Tf,
                )
            } else {
                (refused.unwrap_or_else(|| "poses are PoseStamped, PoseWithCovarianceStamped, TransformStamped, Odometry, Path, PoseInFrame or transforms".to_owned()), ReadOption::Topic)
            };
            return fault("a topic of poses".to_owned(), listed(), &hint, option);
        }
        let mut chosen = Vec::new();
        for name in &options.topics {
            let same = |topic: &&Merged| {
                topic.topic.trim_start_matches('/') == name.trim_start_matches('/')
            };
            let Some(topic) = merged.iter().find(same) else {
                return fault(
                    format!("the topic {name}"),
                    listed(),
                    "name a topic that is there",
                    ReadOption::Topic,
                );
            };
            if !judged(&topic) {
                let reason = match message::kind(&topic.kind) {
                    Kind::Refused(reason) => format!("{name} ({}): {reason}", topic.kind),
                    Kind::Transforms(_) => format!(
                        "{name} ({}): transforms; name two frames instead",
                        topic.kind
                    ),
                    _ => format!("{name} ({}): no poses", topic.kind),
                };
                return fault(
                    "a topic of poses".to_owned(),
                    reason,
                    "name a topic of poses",
                    ReadOption::Topic,
                );
            }
            chosen.push(topic);
        }
        Ok(chosen)
    }

    fn collector<'o>(&'o self, options: &'o LoadOptions) -> Collector<'o> {
        let mut collector = Collector::new(&self.path, options);
        collector.rows_are(RowKind::Message);
        collector.stamps_in(StampUnit::Nanoseconds);
        collector.report.remarks.clone_from(&self.remarks);
        collector
    }

    fn read_topic(
        &self,
        topic: &Merged,
        single: bool,
        options: &LoadOptions,
    ) -> Result<Trajectory, Error> {
        let mut collector = self.collector(options);
        let kind = message::kind(&topic.kind);
        let mut last_path: Option<Vec<Stamped>> = None;
        let mut frames = (String::new(), String::new());
        let mut row = 0;
        self.messages(
            |channel| channel.topic == topic.topic,
            &mut |channel, time, content| {
                let place = Place::Message(row);
                row += 1;
                let short = || {
                    Error::input(
                        &self.path,
                        place,
                        format!("a {}", channel.kind),
                        format!("{} bytes that are none", content.len()),
                        "the message is damaged or of another type",
                    )
                };
                match kind {
                    Kind::Pose(shape) => {
                        let found =
                            message::pose(content, channel.encoding, shape).ok_or_else(short)?;
                        if frames.0.is_empty() {
                            frames = (found.parent.clone(), found.child.clone());
                        }
                        let stamp = if options.record_time {
                            time
                        } else {
                            found.stamp.unwrap_or(time)
                        };
                        take(&mut collector, place, row as u64 - 1, stamp, &found)?;
                    }
                    _ => {
                        last_path =
                            Some(message::path(content, channel.encoding).ok_or_else(short)?);
                    }
                }
                Ok(true)
            },
        )?;
        if let Some(poses) = last_path {
            let text = format!(
                "the last of {row} messages of the path, with its {} poses",
                poses.len()
            );
            collector
                .report
                .remarks
                .push(Remark::new(RemarkKind::Columns, text));
            collector.rows_are(RowKind::Record);
            let stamped = poses.windows(2).any(|pair| pair[0].stamp < pair[1].stamp)
                && options.rate.is_none();
            for (index, found) in poses.iter().enumerate() {
                let stamp = if stamped {
                    found.stamp.unwrap_or(0)
                } else {
                    collector.next_nominal(self.format)
                };
                take(
                    &mut collector,
                    Place::Pose(index),
                    index as u64,
                    stamp,
                    found,
                )?;
            }
            if let Some(first) = poses.first() {
                frames.0.clone_from(&first.parent);
            }
            if !stamped {
                collector.have_no_stamps();
                let log = collector.finish_without_stamps(self.format)?;
                return Ok(self.name(log, topic, single, &frames));
            }
        } else if let Kind::Pose(message::Shape::Pose) = kind {
            let text = "messages without a stamp: the time of recording is taken";
            collector
                .report
                .remarks
                .push(Remark::new(RemarkKind::StampUnit, text));
        }
        let log = collector.finish(self.format)?;
        Ok(self.name(log, topic, single, &frames))
    }

    fn name(
        &self,
        mut log: Trajectory,
        topic: &Merged,
        single: bool,
        frames: &(String, String),
    ) -> Trajectory {
        if !single {
            log.name = format!("{}:{}", log.name, topic.topic);
        }
        let from = if frames.0.is_empty() {
            String::new()
        } else {
            format!(" in `{}`", frames.0)
        };
        let of = if frames.1.is_empty() {
            String::new()
        } else {
            format!(" of `{}`", frames.1)
        };
        let text = format!("topic {} ({}), poses{of}{from}", topic.topic, topic.kind);
        log.report
            .remarks
            .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Topic));
        set_frame(&mut log, &frames.1);
        log
    }

    fn tree(&self) -> Result<tf::Tree, Error> {
        let mut tree = tf::Tree::default();
        self.messages(
            |channel| matches!(message::kind(&channel.kind), Kind::Transforms(_)),
            &mut |channel, time, content| {
                let Kind::Transforms(transforms) = message::kind(&channel.kind) else {
                    return Ok(true);
                };
                let held = if channel.topic.contains("static") {
                    tf::Held::Always
                } else if transforms.of_foxglove() {
                    tf::Held::Alone
                } else {
                    tf::Held::Never
                };
                match message::transforms(content, channel.encoding, transforms) {
                    Some(all) => {
                        let all = all.iter();
                        all.for_each(|transform| tree.add(transform, time, held));
                    }
                    None => tree.unusable += 1,
                }
                Ok(true)
            },
        )?;
        tree.finish();
        Ok(tree)
    }

    fn read_tf(
        &self,
        parent: &str,
        child: &str,
        options: &LoadOptions,
    ) -> Result<Trajectory, Error> {
        let tree = self.tree()?;
        let fault = |found: String| {
            Error::input(
                &self.path,
                Place::File,
                format!("the pose of `{child}` in `{parent}`"),
                found,
                "a listing of the recording shows its chains of frames",
            )
            .option(ReadOption::Tf)
        };
        if tree.is_empty() {
            return Err(fault(
                "no transforms (no topic of TFMessage or FrameTransforms)".to_owned(),
            ));
        }
        let samples = tree.lookup(parent, child).map_err(fault)?;
        let mut collector = self.collector(options);
        collector.rows_are(RowKind::Record);
        for (index, sample) in samples.iter().enumerate() {
            if sample.starts {
                collector.start_stretch();
            }
            collector.push_row(Place::Pose(index), index as u64, sample.stamp, sample.pose)?;
        }
        let text = format!("transforms of the recording: the pose of `{child}` in `{parent}`");
        collector
            .report
            .remarks
            .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Tf));
        if tree.unusable > 0 {
            let text = format!(
                "{} transform(s) without a rotation or a name left out",
                tree.unusable
            );
            collector
                .report
                .remarks
                .push(Remark::new(RemarkKind::DamagedRecording, text));
        }
        let mut log = collector.finish(self.format)?;
        set_frame(&mut log, child);
        Ok(log)
    }
}

/// ROS fixes what the axes of some frames are (REP 103, 105).
fn set_frame(log: &mut Trajectory, child: &str) {
    let child = child.trim_start_matches('/');
    let last = child.rsplit('/').next().unwrap_or(child);
    log.frame = if last.starts_with("base_") {
        Frame::BodyFlu
    } else if last.ends_with("_optical_frame") || last.ends_with("_optical") {
        Frame::CameraRdf
    } else {
        return;
    };
    let text = format!(
        "body frame {} from the name `{child}`, by the conventions of ROS",
        log.frame
    );
    log.report
        .remarks
        .push(Remark::new(RemarkKind::Frame, text).option(ReadOption::Frame));
}

/// Takes one pose, or counts it as lost.
fn take(
    collector: &mut Collector<'_>,
    place: Place,
    row: u64,
    stamp: i64,
    found: &Stamped,
) -> Result<(), Error> {
    let [x, y, z, w] = found.quaternion;
    let finite = found
        .position
        .iter()
        .chain(&found.quaternion)
        .all(|value| value.is_finite());
    if !finite && collector.looks_for(LostKind::Nan) {
        return collector.lose(place, row, Some(stamp), LostKind::Nan);
    }
    if found.quaternion.iter().all(|value| value.abs() < 1e-6)
        && collector.looks_for(LostKind::Zero)
    {
        return collector.lose(place, row, Some(stamp), LostKind::Zero);
    }
    let rotation = collector.quaternion(place, w, x, y, z)?;
    for value in found.position {
        collector.check_coordinate(place, value)?;
    }
    collector.push_row(
        place,
        row,
        stamp,
        Pose {
            rotation,
            translation: found.position.into(),
        },
    )
}

/// The pose of a translation and a quaternion x, y, z, w, where these make one.
fn pose_of(position: [f64; 3], [x, y, z, w]: [f64; 4]) -> Option<Pose> {
    let quaternion = Quaternion::new(w, x, y, z);
    let sound = position
        .iter()
        .all(|value| value.is_finite() && value.abs() < 1e9)
        && (quaternion.norm() - 1.0).abs() < 0.01;
    sound.then(|| Pose {
        rotation: UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix(),
        translation: position.into(),
    })
}

fn broken(path: &Path, fault: Fault) -> Error {
    match fault {
        Fault::Io(found) => Error::io(path, std::io::Error::other(found)),
        Fault::Damaged(found) => Error::input(
            path,
            Place::File,
            "a whole recording",
            found,
            "the file is cut off or damaged; copy or repair it",
        ),
        Fault::Stop => Error::input(
            path,
            Place::File,
            "a whole recording",
            "one that stops",
            "the file is damaged",
        ),
    }
}
