//! Judging pose by pose, while a log is recorded.
//!
//! ```
//! use dose3::stream::{Said, StreamOptions};
//! use dose3::{Detector, Frame};
//! use dose3_datasets::synthetic::{Platform, suite, trajectory};
//!
//! let trusted = suite(Platform::Vehicle, 4, 1);
//! let detector = Detector::builder().statistics("kinematic".parse()?).fit(&trusted)?;
//! let mut live = detector.stream(Frame::BodyFlu, &StreamOptions::default())?;
//!
//! let drive = trajectory(Platform::Vehicle, 9, 600, 20.0);
//! let mut windows = 0;
//! for (stamp, pose) in drive.stamps.iter().zip(&drive.poses) {
//!     for said in live.push(*stamp, *pose)? {
//!         match said {
//!             Said::Window(window) => windows += usize::from(window.chance > 0.0),
//!             Said::Alarm(alarm) => println!("{alarm}"),
//!             Said::Event(event) => println!("{event}"),
//!         }
//!     }
//! }
//! assert!(windows > 10);
//! # Ok::<(), dose3::Error>(())
//! ```
//!
//! The way of a pose: it is checked (finite, a rotation, later than the one before), brought to the detector's rate in
//! a fixed phase, kept as a step of motion in a ring, and every so many poses the window that ends with it is
//! measured. Every window that [`Detector::judge`] would cut from the same poses is among them, with the same numbers
//! to the last bit. What comes of a window, and of short windows beside it, goes to an alarm ([`dose3_ood::alarm`]), which
//! is raised at most so many times an hour on logs like the trusted ones, and ends when the fault does.
//!
//! Memory is constant. With a detector whose statistics need no network nothing is allocated once the first windows
//! have been judged, but when something is reported.
//!
//! [`Detector::judge`]: crate::Detector::judge

mod alarm;
mod event;
mod intake;
mod lifecycle;
mod measure;
mod monitor;
mod options;
mod ring;
mod said;
mod sampler;
mod scale;
mod stamps;
mod state;

pub use alarm::{Alarm, AlarmKind, GroupChance};
use dose3_ood::alarm::Change;
pub use dose3_ood::alarm::RaisedBy;
pub use event::{Event, EventKind, Fault};
pub use monitor::{Apart, Monitor};
pub use options::StreamOptions;
pub use said::{Said, WindowResult};
pub use state::StreamState;

use crate::detector::Detector;
use crate::error::{Error, Result};
use dose3_datasets::Frame;
use dose3_lie::Pose;
use dose3_lie::nalgebra::{Quaternion, UnitQuaternion};
use intake::{Intake, Taken};
use lifecycle::Lifecycle;
use ring::Ring;
use sampler::Sampler;
use scale::SPAN_EVERY;
use std::sync::Arc;

/// A log that is judged while it grows. Many streams share one [`Monitor`]; each may live on a thread of its own.
pub struct Stream {
    monitor: Arc<Monitor>,
    frame: Frame,
    intake: Intake,
    sampler: Sampler,
    ring: Ring,
    alarm: Lifecycle,
    /// Windows measured.
    windows: u64,
    said: Vec<Said>,
}

impl Detector {
    /// A stream of poses of a body whose axes are those of `frame`. Many streams are cheaper with one
    /// [`Detector::monitor`].
    ///
    /// # Errors
    /// As [`Detector::monitor`] and [`Monitor::stream`].
    pub fn stream(&self, frame: Frame, options: &StreamOptions) -> Result<Stream> {
        self.monitor(options)?.stream(frame)
    }

    /// What streams by this detector share.
    ///
    /// # Errors
    /// Options out of range; a detector of windows that count poses, not time; a backend that cannot be had.
    pub fn monitor(&self, options: &StreamOptions) -> Result<Arc<Monitor>> {
        Ok(Arc::new(Monitor::new(self, options)?))
    }
}

impl Stream {
    pub(super) fn new(monitor: Arc<Monitor>, frame: Frame) -> Self {
        Self {
            intake: Intake::new(&monitor),
            sampler: Sampler::new(monitor.rate()),
            ring: Ring::new(monitor.longest(), monitor.keeps_poses()),
            alarm: Lifecycle::new(&monitor),
            windows: 0,
            said: Vec::with_capacity(4),
            monitor,
            frame,
        }
    }

    /// What this stream shares with others.
    #[must_use]
    pub fn monitor(&self) -> &Arc<Monitor> {
        &self.monitor
    }

    /// The axes of the body.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// Takes a pose, `T_world_body` in metres, and its stamp in nanoseconds of any epoch. Answers with what there is to
    /// say, mostly nothing. Bad poses and stamps are left out and reported; they are no errors.
    ///
    /// # Errors
    /// A failing network.
    pub fn push(&mut self, stamp_ns: i64, pose: impl Into<Pose>) -> Result<&[Said]> {
        self.said.clear();
        let pose: Pose = pose.into();
        match intake::checked(pose) {
            Ok(pose) => self.take(stamp_ns, pose)?,
            Err(fault) => self.intake.refuse(stamp_ns, fault, &mut self.said),
        }
        Ok(&self.said)
    }

    /// As [`Stream::push`], from a position in metres and a quaternion x, y, z, w, whose norm may be off by a
    /// hundredth: as text and messages have them.
    ///
    /// # Errors
    /// As [`Stream::push`].
    pub fn push_quaternion(
        &mut self,
        stamp_ns: i64,
        position: [f64; 3],
        [x, y, z, w]: [f64; 4],
    ) -> Result<&[Said]> {
        self.said.clear();
        let quaternion = Quaternion::new(w, x, y, z);
        match intake::checked_quaternion(position, &quaternion) {
            Ok(()) => {
                let rotation = UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix();
                self.take(stamp_ns, Pose::new(rotation, position.into()))?;
            }
            Err(fault) => self.intake.refuse(stamp_ns, fault, &mut self.said),
        }
        Ok(&self.said)
    }

    /// Says that no pose is to come for now: the log as pushed has been judged. Poses may follow; they begin a new
    /// stretch.
    ///
    /// # Errors
    /// As [`Stream::push`].
    pub fn finish(&mut self) -> Result<&[Said]> {
        self.said.clear();
        self.drain(true)?;
        self.end_stretch()?;
        self.intake.forget();
        Ok(&self.said)
    }

    /// Forgets everything: the stream is as new.
    pub fn reset(&mut self) {
        *self = Self::new(self.monitor.clone(), self.frame);
    }

    /// The alarm that is raised, if any, as it stands.
    #[must_use]
    pub fn alarm(&self) -> Option<Alarm> {
        self.alarm.standing()
    }

    /// Windows judged so far.
    #[must_use]
    pub fn windows(&self) -> u64 {
        self.windows
    }

    /// Poses pushed so far, those left out included.
    #[must_use]
    pub fn pushed(&self) -> u64 {
        self.intake.pushed()
    }

    fn take(&mut self, stamp: i64, pose: Pose) -> Result<()> {
        if self.intake.arrive(stamp, pose, &mut self.said) {
            self.drain(false)?;
        }
        Ok(())
    }

    /// Feeds what waits, in order.
    fn drain(&mut self, ending: bool) -> Result<()> {
        while let Some(taken) = self.intake.next(ending, &mut self.sampler, &mut self.said) {
            match taken {
                Taken::Pose(stamp, pose) => {
                    self.look_at_stamp(stamp);
                    self.sampler.arrive(stamp, pose);
                    self.sample()?;
                }
                Taken::NewStretch => self.end_stretch()?,
            }
        }
        Ok(())
    }

    fn look_at_stamp(&mut self, stamp: i64) {
        let monitor = self.monitor.clone();
        let Some(levels) = monitor.stamps() else {
            return;
        };
        let mut work = monitor.borrow();
        self.intake
            .look_at_stamp(stamp, levels, &mut work.sorted, &mut self.said);
        monitor.give_back(work);
    }

    fn end_stretch(&mut self) -> Result<()> {
        self.sampler.end();
        self.sample()?;
        self.sampler.begin();
        self.ring.clear();
        self.alarm.begin_stretch();
        Ok(())
    }

    /// Takes every sample that is due, and judges the windows that end with them.
    fn sample(&mut self) -> Result<()> {
        while let Some((stamp, pose)) = self.sampler.next() {
            self.ring.push(stamp, pose, self.frame);
            self.look_at_spans()?;
            // Short windows first: they end with the same pose and know more of it.
            for scale in (0..self.monitor.scales().len()).rev() {
                let poses = self.monitor.scales()[scale].poses;
                let start = self.ring.window_start(poses);
                let every = self.monitor.every() as u64;
                if let Some(start) = start.filter(|start| start.is_multiple_of(every)) {
                    self.judge(scale, start)?;
                }
            }
        }
        Ok(())
    }

    /// Spans that end with the last pose, the shorter ones first.
    fn look_at_spans(&mut self) -> Result<()> {
        let monitor = self.monitor.clone();
        for (index, span) in monitor.spans().iter().enumerate() {
            let start = self.ring.window_start(span.poses);
            if start.is_none_or(|start| !start.is_multiple_of(SPAN_EVERY)) {
                continue;
            }
            let mut work = monitor.borrow();
            let measured = work.span(span.poses, monitor.rate(), &self.ring);
            monitor.give_back(work);
            // Windows say that a number is none.
            if let Some(row) = measured? {
                let stretch = (&self.ring, self.frame);
                self.alarm
                    .look_at(&monitor, index, &row, stretch, &mut self.said);
            }
        }
        Ok(())
    }

    fn judge(&mut self, scale: usize, start: u64) -> Result<()> {
        let monitor = self.monitor.clone();
        let mut work = monitor.borrow();
        let measured = work.measure(&monitor, scale, &self.ring, self.frame)?;
        let of = &monitor.scales()[scale];
        let Some(scores) = measured else {
            monitor.give_back(work);
            self.intake
                .unmeasured(self.ring.last_stamp(), &mut self.said);
            return Ok(());
        };
        let step = self.alarm.watch(of, scale, scores.tests);
        let (poses, statistics) = (of.poses, &of.statistics);
        let window = WindowResult {
            number: self.windows,
            first_stamp_ns: self.ring.first_stamp(poses),
            last_stamp_ns: self.ring.last_stamp(),
            score: scores.score,
            p_value: monitor.p_value(scores.score),
            beyond: monitor.is_beyond(scores.score),
            chance: step.ln_p.exp(),
            excess: of.alarm.excess(scores.tests),
            in_verdict: start.is_multiple_of(monitor.stride() as u64),
        };
        // Short windows are the alarm's own affair.
        if scale == 0 {
            self.windows += 1;
            if monitor.options().windows {
                self.said.push(Said::Window(window));
            }
        }
        let evidence = lifecycle::Evidence {
            watcher: scale,
            poses,
            stamps: [window.first_stamp_ns, window.last_stamp_ns],
            chance: window.chance,
            excess: window.excess,
            unusual: step.unusual,
            raised: (step.change == Some(Change::Raised))
                .then_some(step.by)
                .flatten(),
            shown: lifecycle::Shown::Groups(statistics, step.test, scores.groups),
            ring: &self.ring,
            frame: self.frame,
        };
        self.alarm.push(&monitor, &evidence, &mut self.said);
        monitor.give_back(work);
        Ok(())
    }
}

/// The error of a frame that the detector does not take.
fn frame_error(found: Frame, expected: Frame) -> Error {
    Error::Frame {
        log: "stream".to_owned(),
        found,
        expected,
    }
}
