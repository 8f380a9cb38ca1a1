//! Poses as a robot sends them, and streams that were put away.

use crate::seeds::streams::{DRIVE, MONITOR, Push, pushes};
use dose3::stream::{EventKind, Said, Stream, StreamState};
use dose3::{Pose, Trajectory};
use dose3_datasets::Frame;

/// Most poses of one input.
const POSES: usize = 1500;
/// A stream keeps two windows of poses at most; as JSON they are shorter than this.
const STATE: usize = 150_000;

/// Poses of a drive with what the bytes do to them, to two streams, of which one is put away again and again: both say
/// the same. Where nothing was done they say what a verdict says.
pub fn poses(bytes: &[u8]) {
    let mut feed = Feed::new();
    for push in pushes(bytes) {
        if feed.sent >= POSES {
            break;
        }
        feed.take(push);
    }
    feed.finish();
    let state = to_json(&feed.stream);
    assert!(state.len() < STATE, "the state grew to {}", state.len());
    if feed.plain {
        feed.says_what_a_verdict_says();
    }
}

struct Feed {
    stream: Stream,
    twin: Stream,
    said: Vec<Said>,
    /// Pose of the drive that comes next.
    next: usize,
    sent: usize,
    stamp: i64,
    place: [f64; 3],
    /// Whether nothing but poses of the drive came, one after the other.
    plain: bool,
    log: Vec<(i64, Pose)>,
}

impl Feed {
    fn new() -> Self {
        Self {
            stream: fresh(),
            twin: fresh(),
            said: Vec::new(),
            next: 0,
            sent: 0,
            stamp: 0,
            place: [0.0; 3],
            plain: true,
            log: Vec::new(),
        }
    }

    fn take(&mut self, push: Push) {
        match push {
            Push::Drive(count) => {
                for _ in 0..count {
                    let (stamp, pose) = self.of_drive();
                    self.push(stamp, pose);
                }
                return;
            }
            Push::PutAway => return self.put_away(),
            Push::Skip(count) => self.next += usize::from(count),
            Push::Stamp(stamp) => {
                let (_, pose) = self.of_drive();
                self.push(stamp, pose);
            }
            Push::Quaternion(position, quaternion) => {
                let (stamp, _) = self.of_drive();
                self.sent += 1;
                let one = self.stream.push_quaternion(stamp, position, quaternion);
                let one = one.unwrap_or_else(|error| panic!("{error}")).to_vec();
                let other = self.twin.push_quaternion(stamp, position, quaternion);
                let other = other.unwrap_or_else(|error| panic!("{error}"));
                assert_eq!(one, other);
                self.hear(one);
            }
            Push::Later(nanoseconds) => self.stamp = self.stamp.wrapping_add(nanoseconds),
            Push::Elsewhere(place) => self.place = place,
            Push::Again => {
                self.next = self.next.saturating_sub(1);
                let (stamp, pose) = self.of_drive();
                self.push(stamp, pose);
            }
            Push::Back(count) => self.next = self.next.saturating_sub(usize::from(count)),
            Push::Finish => self.finish(),
            Push::Reset => {
                self.stream.reset();
                self.twin.reset();
            }
        }
        self.plain = false;
    }

    /// The next pose of the drive, which begins anew behind its end.
    fn of_drive(&mut self) -> (i64, Pose) {
        let place = self.next % DRIVE.len();
        self.plain &= place == self.next;
        self.next += 1;
        let mut pose = DRIVE.poses[place];
        pose.translation += dose3_lie::Vector::from(self.place);
        (DRIVE.stamps[place].wrapping_add(self.stamp), pose)
    }

    fn push(&mut self, stamp: i64, pose: Pose) {
        self.sent += 1;
        if self.plain {
            self.log.push((stamp, pose));
        }
        let one = self.stream.push(stamp, pose);
        let one = one.unwrap_or_else(|error| panic!("{error}")).to_vec();
        let other = self.twin.push(stamp, pose);
        assert_eq!(one, other.unwrap_or_else(|error| panic!("{error}")));
        self.hear(one);
    }

    fn finish(&mut self) {
        let one = self.stream.finish();
        let one = one.unwrap_or_else(|error| panic!("{error}")).to_vec();
        let other = self.twin.finish();
        assert_eq!(one, other.unwrap_or_else(|error| panic!("{error}")));
        self.hear(one);
    }

    /// What is said is numbers, and reads back.
    fn hear(&mut self, said: Vec<Said>) {
        for one in said {
            let text = serde_json::to_string(&one).unwrap_or_else(|error| panic!("{error}"));
            let back: Said = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}"));
            assert_eq!(back, one, "{text}");
            if let Said::Window(window) = &one {
                let share = |x: f64| (0.0..=1.0).contains(&x);
                assert!(share(window.p_value) && share(window.chance), "{text}");
                assert!(window.first_stamp_ns < window.last_stamp_ns, "{text}");
            }
            self.said.push(one);
        }
    }

    fn put_away(&mut self) {
        let json = to_json(&self.stream);
        let state: StreamState = serde_json::from_slice(&json).unwrap_or_else(|e| panic!("{e}"));
        let resumed = MONITOR.resume(state);
        self.stream = resumed.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(to_json(&self.stream), json);
    }

    fn says_what_a_verdict_says(&self) {
        let (stamps, poses): (Vec<i64>, Vec<Pose>) = self.log.iter().copied().unzip();
        let Ok(log) = Trajectory::from_poses("log", Frame::BodyFlu, stamps, poses) else {
            return;
        };
        // A verdict on a short log rests on shorter windows.
        if log.len() < 400 {
            return;
        }
        let events: Vec<_> = self.said.iter().filter_map(event).collect();
        assert!(
            matches!(events[..], [EventKind::Rate { .. }]),
            "{events:?} of a sound drive"
        );
        let report = crate::seeds::streams::DETECTOR.judge(&log);
        let report = report.unwrap_or_else(|error| panic!("{error}"));
        let live: Vec<u64> = self.said.iter().filter_map(in_verdict).collect();
        let whole = report.windows.iter().map(|w| w.score.value().to_bits());
        assert_eq!(live, whole.collect::<Vec<u64>>());
    }
}

fn fresh() -> Stream {
    let stream = MONITOR.stream(Frame::BodyFlu);
    stream.unwrap_or_else(|error| panic!("{error}"))
}

fn to_json(stream: &Stream) -> Vec<u8> {
    serde_json::to_vec(&stream.state()).unwrap_or_else(|error| panic!("{error}"))
}

fn event(said: &Said) -> Option<&EventKind> {
    match said {
        Said::Event(event) => Some(&event.kind),
        _ => None,
    }
}

fn in_verdict(said: &Said) -> Option<u64> {
    match said {
        Said::Window(window) if window.in_verdict => Some(window.score.value().to_bits()),
        _ => None,
    }
}

/// A state that says that it belongs to the detector: refused, or it goes on.
pub fn state(bytes: &[u8]) {
    let Ok(mut value) = serde_json::from_slice::<serde_json::Value>(bytes) else {
        return;
    };
    let Some(entry) = value.get_mut("monitor") else {
        return;
    };
    *entry = MONITOR.fingerprint().into();
    let newest = value["intake"]["newest"].as_i64().unwrap_or_default();
    let Ok(state) = serde_json::from_value::<StreamState>(value) else {
        return;
    };
    let Ok(mut stream) = MONITOR.resume(state) else {
        return;
    };
    // What follows the last pose, or another log, if that was the end of time.
    for (stamp, pose) in DRIVE.stamps.iter().zip(&DRIVE.poses).take(300) {
        let stamp = newest.wrapping_add(stamp - DRIVE.stamps[0] + 50_000_000);
        let said = stream.push(stamp, *pose).unwrap_or_else(|e| panic!("{e}"));
        let text = serde_json::to_string(said).unwrap_or_else(|error| panic!("{error}"));
        let back: Vec<Said> = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}"));
        assert_eq!(back, said, "{text}");
    }
    let _ = stream.finish().unwrap_or_else(|error| panic!("{error}"));
    let json = to_json(&stream);
    let again: StreamState = serde_json::from_slice(&json).unwrap_or_else(|e| panic!("{e}"));
    assert!(MONITOR.resume(again).is_ok(), "its own state is refused");
}
