//! A judged log as a recording that Foxglove, PlotJuggler and rerun open: poses, scores, motion against what is trusted,
//! and the bad stretches as log messages, all at the stamps of the log.

mod live;
mod schema;
mod wire;

use dose3::datasets::Trajectory;
use dose3::datasets::mcap::{Channel, MAGIC, Recording};
use dose3::series::{Axis, Quantity, Series};
use dose3::{Detector, Pose, Report, Score};
use wire::Wire;

pub use live::Live;

/// Frames of the poses.
const WORLD: &str = "world";
const BODY: &str = "body";
/// Levels of `foxglove.Log`.
const INFO: u64 = 2;
const WARNING: u64 = 3;
const ERROR: u64 = 4;
/// Share of the trusted poses on either side of what is trusted.
const BEYOND: f64 = 0.001;

/// The channels.
struct Channels {
    pose: Channel,
    transform: Channel,
    score: Channel,
    motion: Channel,
    log: Channel,
}

impl Channels {
    fn new(recording: &mut Recording) -> Self {
        let mut channel =
            |topic, message| recording.channel(topic, message, &schema::description(message));
        Self {
            pose: channel("/dose3/pose", "foxglove.PoseInFrame"),
            transform: channel("/tf", "foxglove.FrameTransform"),
            score: channel("/dose3/score", "dose3.Score"),
            motion: channel("/dose3/motion", "dose3.Motion"),
            log: channel("/dose3/log", "foxglove.Log"),
        }
    }
}

/// Whether a file that begins so was written by this program: its header names it.
pub fn is_own(start: &[u8]) -> bool {
    // Magic number, code and length of the header, an empty profile, the length of the writer's name.
    const WRITER: usize = 8 + 9 + 4 + 4;
    start.starts_with(MAGIC) && start.get(WRITER..WRITER + 6) == Some(b"dose3 ")
}

fn own_recording() -> Recording {
    Recording::new(concat!("dose3 ", env!("CARGO_PKG_VERSION")))
}

/// The bytes of the recording of `log`, of which `detector` gave `report`.
///
/// # Errors
/// A log that `detector` does not judge.
pub fn recording(detector: &Detector, log: &Trajectory, report: &Report) -> dose3::Result<Vec<u8>> {
    let series = detector.series(log, report)?;
    let mut recording = own_recording();
    let channels = Channels::new(&mut recording);
    let clock = Clock::new(&series);
    let windows = report.window_of_each_pose();
    let columns = Axis::ALL.map(|axis| series.column(Quantity::Velocity(axis)));
    let mut said = said(report).into_iter().peekable();
    for (i, pose) in series.poses.iter().enumerate() {
        let time = clock.of(series.stamps[i]);
        while let Some(said) = said.next_if(|said| said.pose <= i) {
            recording.message(channels.log, time, said.message(time).bytes());
        }
        let stamp = || timestamp(time);
        let in_frame = Wire::default()
            .message(1, stamp())
            .text(2, WORLD)
            .message(3, pose_message(pose));
        recording.message(channels.pose, time, in_frame.bytes());
        let transform = Wire::default()
            .message(1, stamp())
            .text(2, WORLD)
            .text(3, BODY)
            .message(4, position(pose))
            .message(5, attitude(pose));
        recording.message(channels.transform, time, transform.bytes());
        let score = score(report, &series, i, windows[i]).message(1, stamp());
        recording.message(channels.score, time, score.bytes());
        let axes = columns.iter().zip(2..).filter_map(|(column, number)| {
            let column = (*column)?;
            let trusted = column.trusted.map(|of| {
                [
                    of.poses.at(BEYOND),
                    of.poses.at(1.0 - BEYOND),
                    of.poses.median(),
                ]
            });
            Some((number, axis_message(column.values[i]?, trusted)))
        });
        let motion = axes.fold(
            Wire::default().message(1, stamp()),
            |wire, (number, axis)| wire.message(number, axis),
        );
        recording.message(channels.motion, time, motion.bytes());
    }
    recording.metadata("dose3", &facts(detector, report, &clock));
    Ok(recording.end())
}

/// Stamps as a recording has them: not negative.
struct Clock {
    added: u64,
}

impl Clock {
    fn new(series: &Series) -> Self {
        let first = series.stamps.first().copied().unwrap_or_default();
        let added = if first < 0 { first.unsigned_abs() } else { 0 };
        Self { added }
    }

    fn of(&self, stamp: i64) -> u64 {
        stamp.wrapping_add_unsigned(self.added) as u64
    }
}

fn facts(detector: &Detector, report: &Report, clock: &Clock) -> Vec<(&'static str, String)> {
    let e = &report.evidence;
    vec![
        ("log", report.log.name.clone()),
        ("verdict", report.verdict.name().to_owned()),
        ("chance", e.p_value.to_string()),
        ("alpha", e.alpha.to_string()),
        ("decided_by", e.deciding().name.clone()),
        ("window_threshold", e.threshold.value().to_string()),
        (
            "statistics",
            detector.header().statistics.config().statistics.to_string(),
        ),
        ("trusted_logs", detector.header().trusted.len().to_string()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("nanoseconds_added_to_stamps", clock.added.to_string()),
    ]
}

/// A log message, and the pose that it comes before.
struct Said {
    pose: usize,
    level: u64,
    text: String,
}

impl Said {
    fn message(&self, time: u64) -> Wire {
        Wire::default()
            .message(1, timestamp(time))
            .whole(2, self.level)
            .text(3, &self.text)
            .text(4, "dose3")
    }
}

/// The verdict, then where stretches begin and end, in order of time.
fn said(report: &Report) -> Vec<Said> {
    let level = if report.verdict.differs() {
        WARNING
    } else {
        INFO
    };
    let text = report.to_string().trim_end().to_owned();
    let mut all = vec![Said {
        pose: 0,
        level,
        text,
    }];
    for segment in &report.segments {
        let place = &segment.place;
        let mut text = format!(
            "unlike the trusted logs until {:.1} s, worst score {:.2}",
            place.end_s,
            segment.worst_score.value(),
        );
        for reason in &segment.reasons {
            text = format!("{text}; {}", reason.sentence);
        }
        let begins = Said {
            pose: place.first_pose,
            level: WARNING,
            text,
        };
        let ends = Said {
            pose: place.last_pose,
            level: INFO,
            text: "like the trusted logs again".to_owned(),
        };
        all.extend([begins, ends]);
    }
    all.sort_by_key(|said| said.pose);
    all
}

fn timestamp(time: u64) -> Wire {
    const SECOND: u64 = 1_000_000_000;
    Wire::default()
        .whole(1, time / SECOND)
        .whole(2, time % SECOND)
}

fn pose_message(pose: &Pose) -> Wire {
    Wire::default()
        .message(1, position(pose))
        .message(2, attitude(pose))
}

fn position(pose: &Pose) -> Wire {
    vector_message(pose.translation.into())
}

fn vector_message([x, y, z]: [f64; 3]) -> Wire {
    Wire::default().double(1, x).double(2, y).double(3, z)
}

fn attitude(pose: &Pose) -> Wire {
    let q = dose3::nalgebra::UnitQuaternion::from_rotation_matrix(&pose.rotation);
    quaternion_message([q.i, q.j, q.k, q.w])
}

fn quaternion_message([x, y, z, w]: [f64; 4]) -> Wire {
    let xyz = Wire::default().double(1, x).double(2, y).double(3, z);
    xyz.double(4, w)
}

fn score(report: &Report, series: &Series, i: usize, window: Option<usize>) -> Wire {
    let mut wire = Wire::default().double(3, report.evidence.threshold.value());
    if let Some(window) = window.map(|w| &report.windows[w]) {
        wire = wire
            .double(2, window.score.value())
            .whole(6, u64::from(window.beyond));
    }
    if let Some(score) = series.scores[i] {
        wire = wire.double(4, score.value());
    }
    if let Some(threshold) = series.threshold.map(Score::value) {
        wire = wire.double(5, threshold);
    }
    wire.whole(7, series.rows[i])
}

/// `trusted` are the low and high end of what is trusted, and its middle.
fn axis_message(value: f64, trusted: Option<[f64; 3]>) -> Wire {
    let wire = Wire::default().double(1, value);
    let Some([low, high, middle]) = trusted else {
        return wire;
    };
    let reach = if value < middle {
        middle - low
    } else {
        high - middle
    };
    let excess = (value - middle).abs() / reach.max(1e-9);
    wire.double(2, low).double(3, high).double(4, excess)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_recordings_are_told_from_others() {
        let own = Recording::new("dose3 9.10.11").end();
        assert!(is_own(&own));
        assert!(!is_own(&Recording::new("another").end()));
        assert!(!is_own(&own[..20]));
    }
}
