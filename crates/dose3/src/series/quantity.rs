//! What is drawn and compared of single poses: plain quantities in SI units.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// An axis of the motion: along or about the body's axes. Where the body's axes are not known to be forward, left and
/// up, these are its own x, y and z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
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
}

/// A part of a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// Where the body is.
    Position,
    /// How it is turned.
    Attitude,
}

/// A number that every pose of a log has, of the step that leads to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
#[non_exhaustive]
pub enum Quantity {
    /// Speed along a body axis (m/s) or turn rate about it (rad/s), seen from half-way through the turn.
    Velocity(Axis),
    /// Its change: m/s^2, rad/s^2.
    Acceleration(Axis),
    /// How rough it is: root mean square over 11 steps of its second difference, over the square root of 6, so that
    /// white noise of the velocity is measured as it is; m/s, rad/s.
    Noise(Axis),
    /// How far it is from what the other axes say, by the detector's linear prediction; m/s, rad/s. Only of detectors
    /// with the statistic `lin`.
    Unexplained(Axis),
    /// Speed in any direction, m/s.
    Speed,
    /// Turn rate about any axis, rad/s.
    Turning,
    /// Direction of the motion against where the body points, positive to the left, rad; only where it moves at
    /// 0.5 m/s or more.
    Sideslip,
    /// The same upward.
    Climb,
    /// How far the step goes from the steps around it, the running median of seven: m, rad.
    Jump(Part),
    /// How long it has been the same to the last digit (a nanometre, a nanoradian), s.
    Repeats(Part),
    /// How long all steps have been equal, s: poses on a straight line between two others.
    Steady,
    /// How long a coordinate of the position in the world (forward, left, up by the convention of the body's axes) has
    /// been the same, or the body has not turned about an axis, while it moved, s.
    Frozen(Axis),
}

/// What a quantity is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Unit {
    /// Metres.
    #[serde(rename = "m")]
    Metre,
    /// Seconds.
    #[serde(rename = "s")]
    Second,
    /// Radians.
    #[serde(rename = "rad")]
    Radian,
    /// Metres a second.
    #[serde(rename = "m/s")]
    MetrePerSecond,
    /// Radians a second.
    #[serde(rename = "rad/s")]
    RadianPerSecond,
    /// Metres a second squared.
    #[serde(rename = "m/s^2")]
    MetrePerSecondSquared,
    /// Radians a second squared.
    #[serde(rename = "rad/s^2")]
    RadianPerSecondSquared,
    /// A share or a factor.
    #[serde(rename = "1")]
    One,
}

impl Axis {
    /// All, translation first.
    pub const ALL: [Self; 6] = [
        Self::Forward,
        Self::Left,
        Self::Up,
        Self::Roll,
        Self::Pitch,
        Self::Yaw,
    ];

    /// Whether it is a turn.
    #[must_use]
    pub fn is_turn(self) -> bool {
        matches!(self, Self::Roll | Self::Pitch | Self::Yaw)
    }

    /// Its name in files: `forward`, `yaw`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Left => "left",
            Self::Up => "up",
            Self::Roll => "roll",
            Self::Pitch => "pitch",
            Self::Yaw => "yaw",
        }
    }
}

impl Quantity {
    /// All, in the order of columns.
    pub fn all() -> impl Iterator<Item = Self> {
        let of_axes = [
            Self::Velocity,
            Self::Acceleration,
            Self::Noise,
            Self::Unexplained,
        ];
        let single = [
            Self::Speed,
            Self::Turning,
            Self::Sideslip,
            Self::Climb,
            Self::Jump(Part::Position),
            Self::Jump(Part::Attitude),
            Self::Repeats(Part::Position),
            Self::Repeats(Part::Attitude),
            Self::Steady,
        ];
        let of_axes = of_axes
            .into_iter()
            .flat_map(|quantity| Axis::ALL.map(quantity));
        of_axes.chain(single).chain(Axis::ALL.map(Self::Frozen))
    }

    /// Whether windows are compared by its running median over seven poses, so that single poses, which are jumps and
    /// noise, do not count.
    pub(crate) fn is_smoothed(self) -> bool {
        matches!(
            self,
            Self::Velocity(_)
                | Self::Unexplained(_)
                | Self::Speed
                | Self::Turning
                | Self::Sideslip
                | Self::Climb
        )
    }

    /// The axis that it is of.
    #[must_use]
    pub fn axis(self) -> Option<Axis> {
        match self {
            Self::Velocity(axis)
            | Self::Acceleration(axis)
            | Self::Noise(axis)
            | Self::Unexplained(axis)
            | Self::Frozen(axis) => Some(axis),
            _ => None,
        }
    }

    /// What it is measured in.
    #[must_use]
    pub fn unit(self) -> Unit {
        let turn = self.axis().is_some_and(Axis::is_turn);
        match self {
            Self::Velocity(_) | Self::Noise(_) | Self::Unexplained(_) if turn => {
                Unit::RadianPerSecond
            }
            Self::Acceleration(_) if turn => Unit::RadianPerSecondSquared,
            Self::Velocity(_) | Self::Noise(_) | Self::Unexplained(_) | Self::Speed => {
                Unit::MetrePerSecond
            }
            Self::Acceleration(_) => Unit::MetrePerSecondSquared,
            Self::Turning => Unit::RadianPerSecond,
            Self::Jump(Part::Position) => Unit::Metre,
            Self::Sideslip | Self::Climb | Self::Jump(Part::Attitude) => Unit::Radian,
            Self::Repeats(_) | Self::Steady | Self::Frozen(_) => Unit::Second,
        }
    }

    /// In words: `sideways speed`, `roll rate`, `upward acceleration`; with `named_axes` false `speed along y`.
    #[must_use]
    pub fn label(self, named_axes: bool) -> String {
        let letter = |axis: Axis| ["x", "y", "z"][axis as usize % 3];
        let speed = |axis: Axis| match (axis, named_axes) {
            (Axis::Forward, true) => "forward speed".to_owned(),
            (Axis::Left, true) => "sideways speed".to_owned(),
            (Axis::Up, true) => "vertical speed".to_owned(),
            (axis, true) => format!("{} rate", axis.name()),
            (axis, false) if axis.is_turn() => format!("turn rate about {}", letter(axis)),
            (axis, false) => format!("speed along {}", letter(axis)),
        };
        match self {
            Self::Velocity(axis) => speed(axis),
            Self::Acceleration(axis) => match (axis, named_axes) {
                (Axis::Forward, true) => "forward acceleration".to_owned(),
                (Axis::Left, true) => "sideways acceleration".to_owned(),
                (Axis::Up, true) => "vertical acceleration".to_owned(),
                (axis, true) => format!("{} acceleration", axis.name()),
                (axis, false) if axis.is_turn() => {
                    format!("angular acceleration about {}", letter(axis))
                }
                (axis, false) => format!("acceleration along {}", letter(axis)),
            },
            Self::Noise(axis) => format!("{} noise", speed(axis)),
            Self::Unexplained(axis) => {
                format!("{} that the other axes do not explain", speed(axis))
            }
            Self::Speed => "speed".to_owned(),
            Self::Turning => "turn rate".to_owned(),
            Self::Sideslip if named_axes => "sideslip".to_owned(),
            Self::Sideslip => "direction of motion in the x-y plane".to_owned(),
            Self::Climb if named_axes => "climb against the nose".to_owned(),
            Self::Climb => "direction of motion towards z".to_owned(),
            Self::Jump(Part::Position) => "jump of position".to_owned(),
            Self::Jump(Part::Attitude) => "jump of attitude".to_owned(),
            Self::Repeats(Part::Position) => "time without change of position".to_owned(),
            Self::Repeats(Part::Attitude) => "time without change of attitude".to_owned(),
            Self::Steady => "time of equal steps".to_owned(),
            Self::Frozen(axis) => match (axis, named_axes) {
                (Axis::Up, true) => "time without change of height".to_owned(),
                (axis, true) if axis.is_turn() => {
                    format!("time without change of {}", axis.name())
                }
                (axis, _) if axis.is_turn() => {
                    format!("time without change of the angle about {}", letter(axis))
                }
                (axis, _) => format!("time without change of the {} coordinate", letter(axis)),
            },
        }
    }
}

impl Unit {
    /// As it is written: `m/s`.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Second => "s",
            Self::Radian => "rad",
            Self::MetrePerSecond => "m/s",
            Self::RadianPerSecond => "rad/s",
            Self::MetrePerSecondSquared => "m/s^2",
            Self::RadianPerSecondSquared => "rad/s^2",
            Self::One => "1",
        }
    }

    /// The unit that people read, and how many of it one of this are: degrees for radians.
    #[must_use]
    pub fn readable(self) -> (&'static str, f64) {
        let degrees = 1_f64.to_degrees();
        match self {
            Self::Radian => ("degrees", degrees),
            Self::RadianPerSecond => ("deg/s", degrees),
            Self::RadianPerSecondSquared => ("deg/s^2", degrees),
            Self::One => ("", 1.0),
            other => (other.symbol(), 1.0),
        }
    }
}

impl fmt::Display for Quantity {
    /// The name in files: `velocity.forward`, `repeats.position`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, of) = match self {
            Self::Velocity(axis) => ("velocity", axis.name()),
            Self::Acceleration(axis) => ("acceleration", axis.name()),
            Self::Noise(axis) => ("noise", axis.name()),
            Self::Unexplained(axis) => ("unexplained", axis.name()),
            Self::Frozen(axis) => ("frozen", axis.name()),
            Self::Jump(Part::Position) => ("jump", "position"),
            Self::Jump(Part::Attitude) => ("jump", "attitude"),
            Self::Repeats(Part::Position) => ("repeats", "position"),
            Self::Repeats(Part::Attitude) => ("repeats", "attitude"),
            Self::Speed => return f.pad("speed"),
            Self::Turning => return f.pad("turning"),
            Self::Sideslip => return f.pad("sideslip"),
            Self::Climb => return f.pad("climb"),
            Self::Steady => return f.pad("steady"),
        };
        f.pad(&format!("{name}.{of}"))
    }
}

impl FromStr for Quantity {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::all().find(|quantity| quantity.to_string() == text);
        found.ok_or_else(|| format!("no quantity is named {text:?}"))
    }
}

impl TryFrom<String> for Quantity {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Quantity> for String {
    fn from(quantity: Quantity) -> Self {
        quantity.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn names_are_read_back_and_labels_differ() {
        let all: Vec<Quantity> = Quantity::all().collect();
        for named in [true, false] {
            let labels: HashSet<String> = all.iter().map(|q| q.label(named)).collect();
            assert_eq!(labels.len(), all.len());
        }
        for quantity in all {
            assert_eq!(quantity.to_string().parse(), Ok(quantity));
        }
        assert!("velocity.sideways".parse::<Quantity>().is_err());
        assert_eq!(Quantity::Velocity(Axis::Left).label(true), "sideways speed");
        assert_eq!(
            Quantity::Noise(Axis::Roll).label(false),
            "turn rate about x noise"
        );
    }
}
