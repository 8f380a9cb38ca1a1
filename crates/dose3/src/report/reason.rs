//! Why a stretch of a log is unlike the trusted ones: one deviation with its numbers, and in words.

use super::Place;
use crate::series::{Axis, Unit};
use serde::{Deserialize, Serialize};

/// One deviation from the trusted logs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Reason {
    /// What deviates.
    pub kind: ReasonKind,
    /// Along or about which axis, or of which part of the pose.
    pub axis: ReasonAxis,
    /// How much there is of it, in `unit`.
    pub amount: f64,
    /// What 99 of 100 trusted windows stay within, lowest and highest, in `unit`; none where there is nothing to
    /// compare with.
    pub trusted: Option<[f64; 2]>,
    /// Unit of `amount` and `trusted`: SI.
    pub unit: Unit,
    /// How far beyond the trusted range: 1 is its end, larger is farther. Reasons are ordered by it.
    pub strength: f64,
    /// Where: from the first to the last pose that deviates, with rows and stamps of the user's file.
    #[serde(flatten)]
    pub place: Place,
    /// All of it in words, such as `sideways speed 1.0 m/s to the left (trusted: at most 0.11 m/s)`.
    pub sentence: String,
}

/// What can deviate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ReasonKind {
    /// Speed or turn rate.
    Velocity,
    /// Its change.
    Acceleration,
    /// Speed or turn rate is rougher.
    Noise,
    /// Speed or turn rate is smoother.
    Smooth,
    /// The axis does not move as the others say.
    Coupling,
    /// The body moves in another direction than it points.
    Direction,
    /// The path runs backwards.
    Backwards,
    /// A single step goes elsewhere.
    Jump,
    /// Position, attitude or both are repeated.
    Repeats,
    /// Poses lie on straight lines between others.
    Interpolated,
    /// A coordinate or an angle does not change while the body moves.
    Frozen,
    /// Positions are rounded.
    Grid,
    /// Position behind (positive) or ahead of attitude.
    TimeOffset,
    /// The position is that of another point of the body, along the axis.
    LeverArm,
    /// The attitude is turned about the axis.
    Mounting,
    /// Positions or turns are in another unit.
    Scale,
}

/// Of what a reason speaks. Where the body's axes are not known to be forward, left and up, these are its x, y and z,
/// and roll, pitch and yaw the turns about them ([`super::JudgedLog::named_axes`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ReasonAxis {
    /// Along x.
    Forward,
    /// Along y.
    Left,
    /// Along z.
    Up,
    /// About x.
    Roll,
    /// About y.
    Pitch,
    /// About z.
    Yaw,
    /// The position as a whole.
    Position,
    /// The attitude as a whole.
    Attitude,
    /// Position and attitude.
    Pose,
}

impl From<Axis> for ReasonAxis {
    fn from(axis: Axis) -> Self {
        match axis {
            Axis::Forward => Self::Forward,
            Axis::Left => Self::Left,
            Axis::Up => Self::Up,
            Axis::Roll => Self::Roll,
            Axis::Pitch => Self::Pitch,
            Axis::Yaw => Self::Yaw,
        }
    }
}
