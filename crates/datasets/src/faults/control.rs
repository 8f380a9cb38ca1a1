//! Changes that are no faults: a detector that raises an alarm at them looks at the wrong thing.

use std::fmt;
use std::str::FromStr;

use dose3_lie::{Pose, Vector};
use nalgebra::{Quaternion, UnitQuaternion};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::resample::resample_at;
use crate::{Error, Trajectory};

/// Largest shift of the origin along each axis, metres.
const LARGEST_SHIFT: f64 = 1000.0;

/// A change of a log that leaves its motion as it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Control {
    /// The world's origin is moved, up to a kilometre along each axis. Steps and rotations stay the same.
    Reanchor,
    /// The world is turned about the log's first position by a rotation drawn uniformly. Body-frame steps stay the
    /// same; the `paper` representation, which shows the world's axes to the network, does not.
    RotateWorld,
    /// The log is sampled again at its own rate, but between its poses (at a share of a step drawn from the seed):
    /// what a recorder with another clock, brought to the right rate by [`crate::resample`], would give.
    /// Interpolation averages neighbours: where much of a step is noise of the sensor, as in IROS20's logs (their
    /// paths get 8 to 43 % shorter), the motion does change and an alarm is no mistake.
    Resample,
}

impl Control {
    /// All controls.
    pub const ALL: [Self; 3] = [Self::Reanchor, Self::RotateWorld, Self::Resample];

    /// The name used on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reanchor => "reanchor",
            Self::RotateWorld => "rotate-world",
            Self::Resample => "resample",
        }
    }

    /// The whole log, changed. The same log and seed give the same bytes.
    ///
    /// # Errors
    /// Those of [`crate::resample`] for `Resample`; [`Error::Parameter`] for a log without poses.
    pub fn apply(self, log: &Trajectory, seed: u64) -> Result<Trajectory, Error> {
        let Some(first) = log.poses.first() else {
            return Err(Error::Parameter {
                what: "log",
                expected: "at least one pose long",
                found: "no pose".to_owned(),
            });
        };
        let origin = first.translation;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut changed = log.clone();
        match self {
            Self::Reanchor => {
                let shift = Vector::from_fn(|_, _| rng.random_range(-LARGEST_SHIFT..LARGEST_SHIFT));
                for pose in &mut changed.poses {
                    pose.translation += shift;
                }
            }
            Self::RotateWorld => {
                // Four normal numbers have no preferred direction: uniform on the unit quaternions.
                let [w, x, y, z] = std::array::from_fn(|_| rng.sample(StandardNormal));
                let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
                let turn = turn.to_rotation_matrix();
                for pose in &mut changed.poses {
                    let place = origin + turn * (pose.translation - origin);
                    *pose = Pose::new(turn * pose.rotation, place);
                }
            }
            Self::Resample => {
                return resample_at(log, log.rate.hertz, rng.random_range(0.25..0.75));
            }
        }
        Ok(changed)
    }
}

impl fmt::Display for Control {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Control {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL
            .into_iter()
            .find(|control| control.name() == text)
            .ok_or_else(|| Error::UnknownName {
                what: "control",
                found: text.to_owned(),
                expected: Self::ALL.map(Self::name).join(", "),
            })
    }
}
