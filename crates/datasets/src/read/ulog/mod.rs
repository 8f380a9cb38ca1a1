//! Flight logs of PX4 (ULog): positions north, east, down in metres, attitudes of the body forward, right, down.

mod file;

use std::path::Path;

use dose3_lie::{Pose, Rotation, Vector, se3};
use nalgebra::{Quaternion, UnitQuaternion};

pub(crate) use file::MAGIC;
use file::{Log, Topic};

use super::collect::{Collector, pose};
use super::table::check_coordinate;
use crate::error::Place;
use crate::{
    Error, Format, LoadOptions, LostKind, ReadOption, Remark, RemarkKind, RowKind, StampUnit,
    Trajectory, stretch,
};

/// Topics of poses, the first that is there is taken.
const USUAL: [&str; 3] = [
    "vehicle_odometry",
    "vehicle_local_position",
    "vehicle_visual_odometry",
];
const POSITION: &str = "vehicle_local_position";
const ATTITUDE: &str = "vehicle_attitude";
/// Attitudes further apart are not interpolated, nanoseconds.
const FURTHEST: i64 = 500_000_000;
/// A step this many times the typical one says that a dropout cost messages of the topic.
const LONG_STEP: f64 = 1.5;

/// One pose as it is in the log: w, x, y, z.
struct Sample {
    row: usize,
    stamp: i64,
    position: [f64; 3],
    quaternion: [f64; 4],
    /// The estimator says that the position is one.
    valid: bool,
}

/// Reads the topics that the options name, else the usual one.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
) -> Result<Vec<Trajectory>, Error> {
    let log = Log::new(bytes)
        .map_err(|found| Error::input(path, Place::File, "a ULog of PX4", found, ""))?;
    let reader = Reader { path, log, options };
    let topics = reader.choose()?;
    let single = topics.len() == 1;
    topics
        .into_iter()
        .map(|topic| reader.topic(topic, single))
        .collect()
}

struct Reader<'a> {
    path: &'a Path,
    log: Log<'a>,
    options: &'a LoadOptions,
}

impl<'a> Reader<'a> {
    /// The first instance of a topic that has messages.
    fn find(&self, name: &str) -> Option<&Topic<'a>> {
        let topics = self.log.topics.iter();
        topics
            .filter(|topic| topic.name == name && !topic.messages.is_empty())
            .min_by_key(|topic| topic.instance)
    }

    /// The topic with the attitudes that belong to positions without.
    fn attitude(&self, topic: &Topic<'_>) -> Option<&Topic<'a>> {
        let suffix = topic.name.strip_prefix(POSITION)?;
        self.find(&format!("{ATTITUDE}{suffix}"))
            .filter(|topic| topic.has_attitude())
    }

    fn judged(&self, topic: &Topic<'_>) -> bool {
        topic.position().is_some() && (topic.has_attitude() || self.attitude(topic).is_some())
    }

    /// Names of the topics that can be judged.
    fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for topic in &self.log.topics {
            let first = !names.contains(&topic.name.as_str());
            if first && !topic.messages.is_empty() && self.judged(topic) {
                names.push(&topic.name);
            }
        }
        names
    }

    fn choose(&self) -> Result<Vec<&Topic<'a>>, Error> {
        let fault = |expected: String| {
            let names = self.names();
            let found = match names.is_empty() {
                true => "none with position and attitude".to_owned(),
                false => names.join(", "),
            };
            let hint = "poses are vehicle_odometry, vehicle_local_position with vehicle_attitude, or vehicle_visual_odometry";
            Error::input(self.path, Place::File, expected, found, hint).option(ReadOption::Topic)
        };
        let named = |name: &str| self.find(name).filter(|topic| self.judged(topic));
        if self.options.topics.is_empty() {
            let first = USUAL.into_iter().find_map(named);
            return Ok(vec![
                first.ok_or_else(|| fault("a topic of poses".to_owned()))?,
            ]);
        }
        let topics = self.options.topics.iter();
        topics
            .map(|name| {
                named(name.trim_start_matches('/'))
                    .ok_or_else(|| fault(format!("poses in the topic {name}")))
            })
            .collect()
    }

    fn topic(&self, topic: &Topic<'a>, single: bool) -> Result<Trajectory, Error> {
        let mut collector = Collector::new(self.path, self.options);
        collector.rows_are(RowKind::Message);
        collector.stamps_in(StampUnit::Microseconds);
        let mut remark = |kind, text: String| {
            let remark = Remark::new(kind, text).option(ReadOption::Topic);
            collector.report.remarks.push(remark);
        };
        if let Some(damage) = &self.log.damage {
            let text = format!("{damage}; what was whole is read");
            remark(RemarkKind::DamagedRecording, text);
        }
        let attitude = match topic.has_attitude() {
            true => None,
            false => self.attitude(topic),
        };
        let with = attitude.map_or(String::new(), |attitude| {
            format!(", attitudes of {} at its stamps", attitude.name)
        });
        let names = self.names();
        let others: Vec<&str> = names
            .into_iter()
            .filter(|name| *name != topic.name)
            .collect();
        let others = match others.is_empty() {
            true => String::new(),
            false => format!("; there are also {}", others.join(", ")),
        };
        let text = format!("topic {}{with}{others}", topic.name);
        remark(RemarkKind::Columns, text);
        let samples = self.samples(topic)?;
        let stamps: Vec<i64> = samples.iter().map(|sample| sample.stamp).collect();
        let typical = stretch::median_step(&stamps).unwrap_or(0.0) * 1e9;
        let lossy: Vec<usize> = topic
            .after_dropout
            .iter()
            .copied()
            .filter(|index| {
                let before = index.checked_sub(1).and_then(|before| stamps.get(before));
                let step = before
                    .zip(stamps.get(*index))
                    .map(|(a, b)| b.saturating_sub(*a));
                step.is_some_and(|step| step as f64 > LONG_STEP * typical)
            })
            .collect();
        if self.log.dropouts > 0 {
            let text = format!(
                "{} dropout(s) of the logger, {} ms in all; messages of this topic are missing at {} of them, a new stretch starts there",
                self.log.dropouts,
                self.log.dropped,
                lossy.len()
            );
            remark(RemarkKind::DamagedRecording, text);
        }
        let attitudes = attitude
            .map(|attitude| self.attitudes(attitude))
            .transpose()?;
        let mut without = 0;
        for sample in samples {
            if lossy.binary_search(&sample.row).is_ok() {
                collector.start_stretch();
            }
            match &attitudes {
                None => self.take(&mut collector, &sample, None)?,
                Some(attitudes) => match between(attitudes, sample.stamp) {
                    Some(rotation) => self.take(&mut collector, &sample, Some(rotation))?,
                    None => {
                        without += 1;
                        collector.start_stretch();
                    }
                },
            }
        }
        if without > 0 {
            let text = format!(
                "{without} position(s) left out before, after or between attitudes more than half a second apart"
            );
            let remark = Remark::new(RemarkKind::Columns, text).option(ReadOption::Topic);
            collector.report.remarks.push(remark);
        }
        let mut log = collector.finish(Format::Ulog)?;
        if !single {
            log.name = format!("{}:{}", log.name, topic.name);
        }
        Ok(log)
    }

    /// Takes a sample, with a rotation from elsewhere where one is given.
    fn take(
        &self,
        collector: &mut Collector<'_>,
        sample: &Sample,
        rotation: Option<Rotation>,
    ) -> Result<(), Error> {
        let (place, row) = (Place::Message(sample.row), sample.row as u64);
        let [w, x, y, z] = sample.quaternion;
        let numbers = sample.position.iter().chain(&sample.quaternion);
        let finite = numbers.into_iter().all(|value| value.is_finite());
        // NaN is how PX4 says that there is no value, so there is no other reading of it.
        if !finite || !sample.valid {
            return collector.lose(place, row, Some(sample.stamp), LostKind::Nan);
        }
        let zero = sample.quaternion == [0.0; 4];
        if rotation.is_none() && zero && collector.looks_for(LostKind::Zero) {
            return collector.lose(place, row, Some(sample.stamp), LostKind::Zero);
        }
        for value in sample.position {
            check_coordinate(self.path, place, value)?;
        }
        let rotation = match rotation {
            Some(rotation) => rotation,
            None => collector.quaternion(place, w, x, y, z)?,
        };
        collector.push_row(place, row, sample.stamp, pose(rotation, sample.position))
    }

    /// All messages of a topic, with zeros where it has no attitude or no position.
    fn samples(&self, topic: &Topic<'_>) -> Result<Vec<Sample>, Error> {
        let position = topic.position();
        let sample = |(row, message): (usize, &&[u8])| {
            let mut sample = Sample {
                row,
                stamp: i64::try_from(topic.stamp(message)?)
                    .ok()?
                    .checked_mul(1000)?,
                position: [0.0; 3],
                quaternion: [0.0; 4],
                valid: true,
            };
            for ((name, index), value) in position.into_iter().flatten().zip(&mut sample.position) {
                *value = topic.number(message, name, index)?;
            }
            if topic.has_attitude() {
                for (index, value) in sample.quaternion.iter_mut().enumerate() {
                    *value = topic.number(message, "q", index)?;
                }
            }
            sample.valid = ["xy_valid", "z_valid"]
                .iter()
                .all(|name| topic.number(message, name, 0) != Some(0.0));
            Some(sample)
        };
        let messages = topic.messages.iter().enumerate();
        messages
            .map(|(row, message)| {
                sample((row, message)).ok_or_else(|| {
                    Error::input(
                        self.path,
                        Place::Message(row),
                        format!("a message of {}", topic.name),
                        format!("{} bytes that are none", message.len()),
                        "the log is damaged",
                    )
                })
            })
            .collect()
    }

    /// Stamps and rotations of a topic of attitudes, in order; those without a value are left out.
    fn attitudes(&self, topic: &Topic<'_>) -> Result<Vec<(i64, Pose)>, Error> {
        let mut found: Vec<(i64, Pose)> = Vec::new();
        for sample in self.samples(topic)? {
            let [w, x, y, z] = sample.quaternion;
            let quaternion = Quaternion::new(w, x, y, z);
            let later = found.last().is_none_or(|(last, _)| *last < sample.stamp);
            let unit = (quaternion.norm() - 1.0).abs() <= self.options.quaternion_tolerance;
            if later && unit {
                let rotation = UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix();
                found.push((
                    sample.stamp,
                    Pose {
                        rotation,
                        translation: Vector::zeros(),
                    },
                ));
            }
        }
        Ok(found)
    }
}

/// The attitude at a stamp, on the geodesic between its neighbours.
fn between(attitudes: &[(i64, Pose)], stamp: i64) -> Option<Rotation> {
    let after = attitudes.partition_point(|(other, _)| *other < stamp);
    let (later, b) = attitudes.get(after)?;
    if *later == stamp {
        return Some(b.rotation);
    }
    let (earlier, a) = attitudes.get(after.checked_sub(1)?)?;
    let step = later
        .checked_sub(*earlier)
        .filter(|step| *step <= FURTHEST)?;
    let share = (stamp - earlier) as f64 / step as f64;
    Some(se3::interpolate(a, b, share).rotation)
}
