//! The recording of a stream while it grows: poses, the scores of windows, alarms and events. Between two additions the
//! file is whole, with its index; whoever ends the program at once loses what came after the last addition.

use super::{
    BODY, ERROR, INFO, Said as Line, WARNING, WORLD, own_recording, quaternion_message, schema,
    timestamp, vector_message,
};
use crate::recording::wire::Wire;
use anyhow::{Context, Result};
use dose3::datasets::mcap::{Channel, Recording};
use dose3::stream::{AlarmKind, Said, WindowResult};
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Between two additions at least this passes, and so much longer for every chunk: each addition writes the whole index.
const PAUSE: Duration = Duration::from_secs(2);
const LONGER: Duration = Duration::from_millis(2);

pub struct Live {
    path: PathBuf,
    file: File,
    recording: Recording,
    pose: Channel,
    transform: Channel,
    score: Channel,
    log: Channel,
    /// Of windows.
    threshold: f64,
    /// Added to stamps, so that none is negative; known from the first one on.
    added: Option<u64>,
    last: u64,
    /// Bytes in front of the index.
    written: u64,
    at: Instant,
}

impl Live {
    /// Begins the file at `path` anew.
    ///
    /// # Errors
    /// What the operating system answers, with the path.
    pub fn begin(path: &Path, threshold: f64) -> Result<Self> {
        let file = File::create(path);
        let mut recording = own_recording();
        let mut channel =
            |topic, message| recording.channel(topic, message, &schema::description(message));
        let mut live = Self {
            file: file.with_context(|| format!("cannot write {}", path.display()))?,
            path: path.to_path_buf(),
            pose: channel("/dose3/pose", "foxglove.PoseInFrame"),
            transform: channel("/tf", "foxglove.FrameTransform"),
            score: channel("/dose3/score", "dose3.Score"),
            log: channel("/dose3/log", "foxglove.Log"),
            recording,
            threshold,
            added: None,
            last: 0,
            written: 0,
            at: Instant::now(),
        };
        live.add()?;
        Ok(live)
    }

    /// A pose as it came; what is no pose is left out.
    pub fn pose(&mut self, stamp: i64, position: [f64; 3], quaternion: [f64; 4]) {
        let numbers = position.iter().chain(&quaternion);
        if numbers.clone().any(|x| !x.is_finite()) || quaternion == [0.0; 4] {
            return;
        }
        let time = self.time(stamp);
        let (place, turn) = (
            || vector_message(position),
            || quaternion_message(quaternion),
        );
        let pose = Wire::default().message(1, place()).message(2, turn());
        let in_frame = Wire::default()
            .message(1, timestamp(time))
            .text(2, WORLD)
            .message(3, pose);
        self.recording.message(self.pose, time, in_frame.bytes());
        let transform = Wire::default()
            .message(1, timestamp(time))
            .text(2, WORLD)
            .text(3, BODY)
            .message(4, place())
            .message(5, turn());
        self.recording
            .message(self.transform, time, transform.bytes());
    }

    /// What the stream said; an alarm is in the file at once.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn said(&mut self, said: &Said) -> Result<()> {
        let (stamp, level, text) = match said {
            Said::Window(window) => {
                self.window(window);
                return Ok(());
            }
            Said::Event(event) => (event.stamp_ns, WARNING, event.to_string()),
            Said::Alarm(alarm) => {
                let level = match alarm.alarm {
                    AlarmKind::Ended => INFO,
                    _ => ERROR,
                };
                (alarm.at_ns, level, alarm.to_string())
            }
        };
        self.line(stamp, level, text);
        match said {
            Said::Alarm(_) => self.add(),
            _ => Ok(()),
        }
    }

    /// Adds what has come, if it is time.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn tick(&mut self) -> Result<()> {
        let chunks = u32::try_from(self.recording.chunks()).unwrap_or(u32::MAX);
        match self.at.elapsed() >= PAUSE + LONGER * chunks {
            true => self.add(),
            false => Ok(()),
        }
    }

    /// The last words.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn end(mut self, text: &str) -> Result<()> {
        let message = Line {
            pose: 0,
            level: INFO,
            text: text.to_owned(),
        };
        let line = message.message(self.last).bytes();
        self.recording.message(self.log, self.last, line);
        let facts = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("window_threshold", self.threshold.to_string()),
            (
                "nanoseconds_added_to_stamps",
                self.added.unwrap_or(0).to_string(),
            ),
        ];
        self.recording.metadata("dose3", &facts);
        self.add()
    }

    fn window(&mut self, window: &WindowResult) {
        let time = self.time(window.last_stamp_ns);
        let score = Wire::default()
            .message(1, timestamp(time))
            .double(2, window.score.value())
            .double(3, self.threshold)
            .whole(6, u64::from(window.beyond));
        self.recording.message(self.score, time, score.bytes());
    }

    fn line(&mut self, stamp: i64, level: u64, text: String) {
        let time = self.time(stamp);
        let message = Line {
            pose: 0,
            level,
            text,
        };
        let bytes = message.message(time).bytes();
        self.recording.message(self.log, time, bytes);
    }

    fn time(&mut self, stamp: i64) -> u64 {
        let added = *self.added.get_or_insert(match stamp < 0 {
            true => stamp.unsigned_abs(),
            false => 0,
        });
        self.last = stamp.saturating_add_unsigned(added).max(0) as u64;
        self.last
    }

    /// What has come becomes part of the file, and the index behind it new.
    fn add(&mut self) -> Result<()> {
        self.recording.close_chunk();
        let mut bytes = self.recording.take();
        let stays = bytes.len() as u64;
        bytes.extend(self.recording.ending());
        let file = &mut self.file;
        file.seek(SeekFrom::Start(self.written))
            .and_then(|_| file.write_all(&bytes))
            .with_context(|| format!("cannot write {}", self.path.display()))?;
        self.written += stays;
        self.at = Instant::now();
        Ok(())
    }
}
