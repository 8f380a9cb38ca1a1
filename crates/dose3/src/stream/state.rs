//! What is kept of a stream when its program ends.

use super::intake::{FARTHEST, Intake, REPAIRED};
use super::lifecycle::Lifecycle;
use super::ring::Ring;
use super::sampler::Sampler;
use super::{Monitor, Stream};
use crate::error::{Error, Result};
use dose3_datasets::Frame;
use dose3_lie::project::orthogonality_error;
use dose3_lie::{Matrix, Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Version of [`StreamState`] that this build writes and reads.
const VERSION: u32 = 2;

/// What a stream counts is less: a pose each nanosecond for a hundred days.
pub(super) const MOST: u64 = 1 << 53;

/// A stream as it stands, to go on from: what follows is the same to the last bit as if it had never been put away. It
/// belongs to one detector and one set of options.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StreamState {
    version: u32,
    /// Of detector and options.
    monitor: String,
    frame: Frame,
    windows: u64,
    intake: Intake,
    sampler: Sampler,
    ring: Ring,
    alarm: Lifecycle,
}

/// A pose in numbers: the rotation's columns, then the translation. Unlike a [`Pose`] it is read back as it was, not
/// brought to the nearest rotation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Flat([f64; 12]);

impl From<&Pose> for Flat {
    fn from(pose: &Pose) -> Self {
        let mut numbers = [0.0; 12];
        numbers[..9].copy_from_slice(pose.rotation.matrix().as_slice());
        numbers[9..].copy_from_slice(pose.translation.as_slice());
        Self(numbers)
    }
}

impl Flat {
    /// Whether it is a pose, as what comes from a file must be.
    pub fn is_pose(&self) -> bool {
        let pose = self.pose();
        let matrix = pose.rotation.matrix();
        pose.translation.amax() <= FARTHEST
            && pose.is_finite()
            && orthogonality_error(matrix) <= REPAIRED
            && matrix.determinant() > 0.0
    }

    pub fn pose(&self) -> Pose {
        let matrix = Matrix::from_column_slice(&self.0[..9]);
        Pose::new(
            Rotation::from_matrix_unchecked(matrix),
            Vector::from_column_slice(&self.0[9..]),
        )
    }
}

impl Stream {
    /// What there is to keep.
    #[must_use]
    pub fn state(&self) -> StreamState {
        StreamState {
            version: VERSION,
            monitor: self.monitor.fingerprint().to_owned(),
            frame: self.frame,
            windows: self.windows,
            intake: self.intake.clone(),
            sampler: self.sampler.clone(),
            ring: self.ring.clone(),
            alarm: self.alarm.clone(),
        }
    }
}

impl Monitor {
    /// Goes on with a stream that was put away.
    ///
    /// # Errors
    /// A state of another detector, of other options or of another version; one whose parts do not belong together.
    pub fn resume(self: &Arc<Self>, state: StreamState) -> Result<Stream> {
        let wrong = |reason: &str| Err(Error::unsound("state of a stream", reason.to_owned()));
        if state.version != VERSION {
            return wrong("it is of another version");
        }
        if state.monitor != self.fingerprint() {
            return wrong("it belongs to another detector or to other options");
        }
        let mut stream = self.stream(state.frame)?;
        let fits = state.intake.fits(&stream.intake)
            && state.sampler.fits(&stream.sampler)
            && state.sampler.takes_as_they_are() == state.intake.are_samples()
            && state.sampler.latest() == state.intake.last_fed()
            && state.ring.fits(self.longest(), self.keeps_poses())
            && state.ring.newest() == state.sampler.last_sample()
            && state.alarm.fits(self)
            && state.windows < MOST;
        if !fits {
            return wrong("its parts do not belong together");
        }
        stream.windows = state.windows;
        stream.intake = state.intake;
        stream.sampler = state.sampler;
        stream.ring = state.ring;
        stream.alarm = state.alarm;
        Ok(stream)
    }
}
