//! Faults of pose sensors, injected into sound logs to measure what a detector sees, and controls that it must not
//! see.
//!
//! A fault takes a log, a range of its poses and a seed; the same three and the same severity give the same bytes.
//! Severity zero (a factor of one) changes nothing. Two kinds of fault behave differently at the ends of the range:
//!
//! * faults of the **motion** (jump, drifts, scale, reversal, mirrored axes, slip) change the steps between the poses
//!   of the range. Its first pose stays, and the poses after it are carried along rigidly: they are somewhere else,
//!   but move as before. A dead-reckoned log looks like this, and no artificial teleport marks the end.
//!   Faults of the **coupling** between position and attitude (one of them late, lever arm, extrinsic turn, smoothing,
//!   a course taken for heading, a missing degree of freedom) are injected in the same way: the steps within the range
//!   are those of a log that has the fault from its first pose to its last.
//! * faults of the **pose** (jitter, mounting, roll/pitch swap, degrees for radians, rounding) change the poses of the
//!   range; all others stay, so the steps into the range and out of it change too. So do stale poses, interpolated
//!   ones and bridged gaps.
//!
//! Freeze, dropped poses, time warp and wrong rate change which poses are there; all others keep their place. Faults
//! of the **stamps** (stall, burst, jitter, doubled poses, uneven and thinned rates) change when they are there.
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
mod coupling;
mod fault;
mod filter;
mod inject;
mod level;
mod motion;
mod name;
mod pose;
mod severity;
mod stamps;
mod suite;
mod timing;

use std::f64::consts::PI;
use std::ops::Range;

use dose3_lie::Vector;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::{Frame, Trajectory, Window};

pub use control::Control;
pub use fault::{Axis, Fault};

/// A log with a fault in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Injection {
    /// The faulty log; name, group, frame and claimed rate are those of the sound one.
    pub trajectory: Trajectory,
    /// Poses of `trajectory` whose step from the pose before is faulty. For dropped poses and wrong rate some steps
    /// within are sound. Empty where the fault changes nothing.
    pub affected: Range<usize>,
}

/// How many faulty steps a window holds: poses in `affected` that have their predecessor in the window too.
pub fn faulty_steps(affected: &Range<usize>, window: &Window) -> usize {
    let start = affected.start.max(window.start + 1);
    let end = affected.end.min(window.start + window.length);
    end.saturating_sub(start)
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
