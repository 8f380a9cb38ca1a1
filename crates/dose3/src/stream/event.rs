//! What may be wrong with poses as they come.

use dose3_ood::timing::StampFinding;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Something wrong with the poses as they come; what is plainly wrong is left out and judged as if it had not come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Stamp of the pose at which it was seen, nanoseconds.
    pub stamp_ns: i64,
    /// Which pose of the stream it was, counted from 0.
    pub pose: u64,
    /// What it is.
    #[serde(flatten)]
    pub kind: EventKind,
}

/// Kinds of [`Event`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum EventKind {
    /// The rate of the poses was found; `measured_hz` is what windows are made of.
    Rate {
        /// Of the poses as they come, hertz.
        hertz: f64,
        /// Of the poses as they are judged.
        judged_hz: f64,
    },
    /// The poses come too slowly to be judged; nothing is until they come faster.
    TooSlow {
        /// Of the poses as they come, hertz.
        hertz: f64,
        /// That is needed.
        needed_hz: f64,
    },
    /// A pause: the poses behind it begin a new stretch, and the next window is due a window's length later.
    Gap {
        /// How long.
        seconds: f64,
    },
    /// The position jumped farther than anything moves: the estimator began anew. A new stretch begins.
    Reset {
        /// How many since the last report of this kind.
        count: u64,
        /// How far the last one was.
        metres: f64,
    },
    /// The clock went back by more than a pause: a new stretch begins.
    ClockBack {
        /// How far.
        seconds: f64,
    },
    /// Poses that came after a later one; left out.
    Late {
        /// How many since the last report of this kind.
        count: u64,
        /// How late the worst of them was.
        seconds: f64,
    },
    /// Poses with the stamp of the one before; left out.
    Doubled {
        /// How many since the last report of this kind.
        count: u64,
    },
    /// Poses that are none: NaN, infinity, a zero quaternion, a matrix that is no rotation; left out.
    BadPose {
        /// How many since the last report of this kind.
        count: u64,
        /// What was wrong with the last one.
        what: Fault,
    },
    /// The last stamps come unlike those of the trusted logs: poses are lost, pause, scatter, come doubled or at another
    /// pace. Said once while it lasts.
    Stamps(StampFinding),
    /// Numbers so large that no statistic of the window is one.
    Unmeasured {
        /// How many windows since the last report of this kind.
        count: u64,
    },
}

/// What is wrong with a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// NaN or infinity.
    NotFinite,
    /// A coordinate beyond 1e9 m.
    TooFar,
    /// A quaternion of zeros, as in a message that was never filled in.
    ZeroQuaternion,
    /// A quaternion whose norm is not 1, a matrix that is not orthogonal.
    NoRotation,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a number that is not finite",
            Self::TooFar => "a position beyond 1e9 m",
            Self::ZeroQuaternion => "a zero quaternion",
            Self::NoRotation => "no rotation",
        })
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let poses = |count: &u64| match count {
            1 => "one pose".to_owned(),
            n => format!("{n} poses"),
        };
        match &self.kind {
            EventKind::Rate { hertz, judged_hz } => {
                write!(f, "{hertz:.2} poses a second, judged at {judged_hz:.2}")
            }
            EventKind::TooSlow { hertz, needed_hz } => write!(
                f,
                "{hertz:.2} poses a second, {needed_hz:.2} are needed: nothing can be judged"
            ),
            EventKind::Gap { seconds } => write!(f, "no pose for {seconds:.3} s"),
            EventKind::Reset {
                count: 0 | 1,
                metres,
            } => write!(
                f,
                "the position jumps by {metres:.1} m: the estimator began anew"
            ),
            EventKind::Reset { count, metres } => write!(
                f,
                "the position jumped {count} times, the last time by {metres:.1} m: the estimator begins anew again and \
                 again"
            ),
            EventKind::ClockBack { seconds } => write!(f, "the clock goes back by {seconds:.3} s"),
            EventKind::Late { count, seconds } => {
                write!(f, "{} up to {seconds:.3} s late, left out", poses(count))
            }
            EventKind::Doubled { count } => {
                let poses = poses(count);
                write!(f, "{poses} with the stamp of the one before, left out")
            }
            EventKind::BadPose { count, what } => {
                write!(f, "{} with {what}, left out", poses(count))
            }
            EventKind::Stamps(finding) => finding.fmt(f),
            EventKind::Unmeasured { count } => {
                write!(f, "windows with numbers too large to be judged ({count})")
            }
        }
    }
}
