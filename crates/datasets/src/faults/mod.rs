//! Faults of pose sensors, injected into sound logs to measure what a detector sees, and controls that it must not
//! see.
//!
//! A fault takes a log, a range of its poses and a seed; the same three and the same severity give the same bytes.
//! Severity zero (a factor of one) changes nothing. Two kinds of fault behave differently at the ends of the range:
//!
//! * faults of the **motion** (jump, drifts, scale, reversal, mirrored axes, slip) change the steps between the poses
//!   of the range. Its first pose stays, and the poses after it are carried along rigidly: they are somewhere else,
//!   but move as before. A dead-reckoned log looks like this, and no artificial teleport marks the end.
//! * faults of the **pose** (jitter, mounting, roll/pitch swap, degrees for radians) change the poses of the range;
//!   all others stay, so the steps into the range and out of it change too.
//!
//! Freeze, dropped poses, time warp and wrong rate change which poses are there; all others keep their place.
//!
//! [`Injection::affected`] says which poses of the result count as faulty: those whose **step from the pose before**
//! is not the one a sound sensor would have reported. [`faulty_steps`] counts them in a window.
//!
//! ```
//! use dose3_datasets::faults::{Fault, faulty_steps};
//! use dose3_datasets::{synthetic, windows};
//!
//! let drive = synthetic::trajectory(synthetic::Platform::Vehicle, 7, 400, 10.0);
//! let fault: Fault = "freeze:2.0s".parse()?;
//! let injection = fault.inject(&drive, 200..300, 1)?;
//! // Twenty poses repeat pose 200, and the step into pose 221 makes up for them.
//! assert_eq!(injection.affected, 201..222);
//! let cut = windows(&[injection.trajectory], 128, 64);
//! let faulty: Vec<usize> = cut.iter().map(|window| faulty_steps(&injection.affected, window)).collect();
//! assert_eq!(faulty, [0, 0, 21, 21, 0]);
//! # Ok::<(), dose3_datasets::Error>(())
//! ```

mod control;
mod motion;
mod name;
mod pose;
mod suite;
mod timing;

use std::f64::consts::PI;
use std::ops::Range;

use dose3_lie::Vector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::{Error, Frame, Trajectory, Window, stretches};

pub use control::Control;

/// An axis of the body, or of a world whose axes follow the same convention.
///
/// Where [`Frame::has_forward`] is false, these are the frame's own x, y and z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    /// The direction of travel.
    Forward,
    /// To the left of it.
    Left,
    /// Away from the ground.
    Up,
}

/// A fault with its severity.
///
/// Written as `jump:1.0m`, `mounting:5.0deg`, `scale:1.2x` or `reversal` by `Display`, and read back by `FromStr`,
/// which also takes `rad` for `deg`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// Between the first two poses of the range the position jumps in a random direction (of the body's
    /// forward-left plane where there is one). For good: everything after is displaced.
    /// A satellite fix after a tunnel, a loop closure, multipath.
    Jump {
        /// Length of the jump, metres.
        metres: f64,
    },
    /// The first pose of the range is repeated for some time, at most to the end of the range; then the log goes on
    /// where it would have been. A stuck driver or filter whose last message is sent again.
    Freeze {
        /// Seconds of repeated poses by the log's stamps, after the first one.
        seconds: f64,
    },
    /// Each pose of the range but the first is missing with this probability; the stamps of the others are their
    /// own, so the log gets shorter. A lossy link, an overloaded recorder.
    Drop {
        /// Probability, 0 to 0.95.
        share: f64,
    },
    /// Independent normal noise on each coordinate of each position. A poor fix, a camera with little texture.
    JitterPosition {
        /// Standard deviation of each coordinate, metres.
        metres: f64,
    },
    /// Independent normal noise on each rotation, `R exp(n)`. Vibration, a poor attitude fix.
    JitterRotation {
        /// Standard deviation of each coordinate of the tangent `n`, radians.
        radians: f64,
    },
    /// Heading turns away at a constant rate to a random side and the path bends with it; for good.
    /// The bias of a gyroscope in dead reckoning.
    DriftYaw {
        /// Rate about the body's up axis, radians a second.
        radians_per_second: f64,
    },
    /// Position slides away at constant speed in a direction fixed in the world, drawn as that of the jump; the
    /// offset reached stays for good. An inertial system without a fix, a slowly moving multipath error.
    DriftPosition {
        /// Speed of the error, metres a second.
        metres_per_second: f64,
    },
    /// Steps are longer by a share that grows with time; after the range they are right again, the path stays
    /// displaced. Monocular odometry that loses its scale.
    DriftScale {
        /// Growth of the scale, per second.
        per_second: f64,
    },
    /// Steps are longer (shorter below 1) by a factor, from the first to the last. A wrong wheel radius or stereo
    /// base, feet for yards.
    Scale {
        /// Factor on every step, 0.001 to 1000.
        factor: f64,
    },
    /// The motion of the range backward in time, beginning at its first pose.
    /// A log played backward, a sign lost in a time difference.
    Reversal,
    /// Time runs faster and slower in turn, in whole waves of about ten seconds; poses are interpolated, the first
    /// and the last of the range stay. A clock that is being corrected, a buffer that stalls and catches up.
    TimeWarp {
        /// Speed is between `1 - depth` and `1 + depth` times the true one, 0 to 0.95.
        depth: f64,
    },
    /// The body is turned about its up axis by a constant angle to a random side; positions stay.
    /// A sensor knocked or mounted askew, a wrong extrinsic calibration.
    Mounting {
        /// The angle, radians.
        radians: f64,
    },
    /// Roll and pitch of each pose change places (`Rz(yaw) Ry(pitch) Rx(roll)` of forward-left-up body against world
    /// axes of the same convention; KITTI's world is its first camera). Two columns of a file taken for each other.
    RollPitchSwap,
    /// The whole motion in a mirror: one body axis points the other way, and rotations are turned with it into
    /// proper ones (`S R S`). Left-handed data taken for right-handed. On a car, whose mirror image is a car,
    /// `Left` leaves little more to see than the side of the road.
    Handedness {
        /// The axis that is mirrored.
        axis: Axis,
    },
    /// Positions in a mirror, rotations as they were: the body no longer moves where it points.
    /// One column with the wrong sign, east-north-up taken for north-east-down.
    MirroredPositions {
        /// The axis of the world that is mirrored.
        axis: Axis,
    },
    /// Each rotation is `exp(pi / 180 log R)` of itself: nearly the identity; positions stay.
    /// Angles in radians read as if they were degrees.
    DegreesForRadians,
    /// The body moves sideways at constant speed, to a random side, on top of its motion; the offset reached stays.
    /// Slipping wheels, cross wind, a drifting optical flow sensor.
    Slip {
        /// Speed along the body's left axis, metres a second.
        metres_per_second: f64,
    },
    /// The sensor's rate is this factor times the one claimed: poses of the range are skipped (above 1) or repeated
    /// (below 1), and the stamps go on at the claimed rate; the log gets shorter or longer and all later stamps move.
    /// A 20 Hz log read as 10 Hz, a slow topic published again by a fast node.
    Rate {
        /// True rate over claimed rate, 0.05 to 20. Above 1, motion looks faster than it is.
        factor: f64,
    },
}

/// A log with a fault in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Injection {
    /// The faulty log; name, group, frame and claimed rate are those of the sound one.
    pub trajectory: Trajectory,
    /// Poses of `trajectory` whose step from the pose before is faulty. For dropped poses and wrong rate some steps
    /// within are sound. Empty where the fault changes nothing.
    pub affected: Range<usize>,
}

impl Fault {
    /// The log with the fault in poses `range` of it (start included, end not).
    ///
    /// # Errors
    /// [`Error::Parameter`] for a severity outside its range, and for a range of fewer than two poses or not within
    /// one gap-free stretch ([`stretches`]) of the log.
    pub fn inject(
        &self,
        log: &Trajectory,
        range: Range<usize>,
        seed: u64,
    ) -> Result<Injection, Error> {
        self.check()?;
        check_range(log, &range)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut faulty = log.clone();
        let within = range.start + 1..range.end;
        let changed = range.start.max(1)..(range.end + 1).min(log.len());
        let affected = match *self {
            Self::Jump { metres } => {
                motion::jump(&mut faulty, &range, metres, &mut rng);
                within.start..within.start + 1
            }
            Self::Freeze { seconds } => timing::freeze(&mut faulty, &range, seconds),
            Self::Drop { share } => timing::drop(&mut faulty, &range, share, &mut rng),
            Self::JitterPosition { metres } => {
                pose::jitter_position(&mut faulty.poses[range], metres, &mut rng);
                changed
            }
            Self::JitterRotation { radians } => {
                pose::jitter_rotation(&mut faulty.poses[range], radians, &mut rng);
                changed
            }
            Self::DriftYaw { radians_per_second } => {
                motion::drift_yaw(&mut faulty, &range, radians_per_second, &mut rng);
                within
            }
            Self::DriftPosition { metres_per_second } => {
                motion::drift_position(&mut faulty, &range, metres_per_second, &mut rng);
                within
            }
            Self::DriftScale { per_second } => {
                motion::scale(&mut faulty, &range, |seconds| 1.0 + per_second * seconds);
                within
            }
            Self::Scale { factor } => {
                motion::scale(&mut faulty, &range, |_| factor);
                within
            }
            Self::Reversal => {
                motion::reverse(&mut faulty, &range);
                within
            }
            Self::TimeWarp { depth } => {
                timing::warp(&mut faulty, &range, depth);
                within
            }
            Self::Mounting { radians } => {
                let angle = side(&mut rng) * radians;
                pose::mounting(&mut faulty.poses[range], log.frame, angle);
                changed
            }
            Self::RollPitchSwap => {
                pose::swap_roll_and_pitch(&mut faulty.poses[range], log.frame);
                changed
            }
            Self::Handedness { axis } => {
                motion::mirror(&mut faulty, &range, axis);
                within
            }
            Self::MirroredPositions { axis } => {
                motion::mirror_positions(&mut faulty, &range, axis);
                within
            }
            Self::DegreesForRadians => {
                pose::degrees_for_radians(&mut faulty.poses[range]);
                changed
            }
            Self::Slip { metres_per_second } => {
                let speed = side(&mut rng) * metres_per_second;
                motion::slip(&mut faulty, &range, speed);
                within
            }
            Self::Rate { factor } => timing::rate(&mut faulty, &range, factor),
        };
        Ok(Injection {
            trajectory: faulty,
            affected,
        })
    }

    /// The faulty log alone.
    ///
    /// # Errors
    /// As [`Self::inject`].
    pub fn apply(
        &self,
        log: &Trajectory,
        range: Range<usize>,
        seed: u64,
    ) -> Result<Trajectory, Error> {
        Ok(self.inject(log, range, seed)?.trajectory)
    }

    /// The poses of the faulty log that count as faulty ([`Injection::affected`]), alone.
    ///
    /// # Errors
    /// As [`Self::inject`].
    pub fn affected(
        &self,
        log: &Trajectory,
        range: Range<usize>,
        seed: u64,
    ) -> Result<Range<usize>, Error> {
        Ok(self.inject(log, range, seed)?.affected)
    }

    /// Refuses severities that are no numbers or beyond what a log can hold.
    fn check(&self) -> Result<(), Error> {
        let (value, allowed, expected) = match *self {
            Self::Jump { metres: value }
            | Self::Freeze { seconds: value }
            | Self::JitterPosition { metres: value }
            | Self::DriftYaw {
                radians_per_second: value,
            }
            | Self::DriftPosition {
                metres_per_second: value,
            }
            | Self::DriftScale { per_second: value }
            | Self::Slip {
                metres_per_second: value,
            } => (value, 0.0..=1e4, "between 0 and 10000"),
            Self::JitterRotation { radians } | Self::Mounting { radians } => {
                (radians, 0.0..=PI, "between 0 and 180 degrees")
            }
            Self::Drop { share: value } | Self::TimeWarp { depth: value } => {
                (value, 0.0..=0.95, "between 0 and 0.95")
            }
            Self::Scale { factor } => (factor, 1e-3..=1e3, "between 0.001 and 1000"),
            Self::Rate { factor } => (factor, 0.05..=20.0, "between 0.05 and 20"),
            Self::Reversal
            | Self::RollPitchSwap
            | Self::Handedness { .. }
            | Self::MirroredPositions { .. }
            | Self::DegreesForRadians => return Ok(()),
        };
        if allowed.contains(&value) {
            return Ok(());
        }
        Err(Error::Parameter {
            what: "severity of the fault",
            expected,
            found: self.to_string(),
        })
    }
}

/// How many faulty steps a window holds: poses in `affected` that have their predecessor in the window too.
pub fn faulty_steps(affected: &Range<usize>, window: &Window) -> usize {
    let start = affected.start.max(window.start + 1);
    let end = affected.end.min(window.start + window.length);
    end.saturating_sub(start)
}

fn check_range(log: &Trajectory, range: &Range<usize>) -> Result<(), Error> {
    let fits = stretches(log, log.max_gap)
        .iter()
        .any(|stretch| stretch.start <= range.start && range.end <= stretch.end);
    if fits && range.len() >= 2 {
        return Ok(());
    }
    Err(Error::Parameter {
        what: "range of the fault",
        expected: "at least two poses within one gap-free stretch of the log",
        found: format!("{}..{} of {} poses", range.start, range.end, log.len()),
    })
}

/// Coordinates in the frame's own axes of a vector given as forward, left, up.
fn from_forward_left_up(frame: Frame, vector: Vector) -> Vector {
    frame.to_forward_left_up().inverse() * vector
}

/// A random unit vector in body coordinates: in the forward-left plane where there is one, else of any direction.
fn direction(frame: Frame, rng: &mut ChaCha8Rng) -> Vector {
    if frame.has_forward() {
        let angle: f64 = rng.random_range(-PI..PI);
        return from_forward_left_up(frame, Vector::new(angle.cos(), angle.sin(), 0.0));
    }
    let vector = normal(rng);
    // Three normal numbers that are all zero do not occur; if they did, any direction is as good.
    vector.try_normalize(1e-12).unwrap_or_else(Vector::x)
}

/// 1 or -1.
fn side(rng: &mut ChaCha8Rng) -> f64 {
    if rng.random() { 1.0 } else { -1.0 }
}

/// Three independent standard normal numbers.
fn normal(rng: &mut ChaCha8Rng) -> Vector {
    Vector::from_fn(|_, _| rng.sample(StandardNormal))
}
