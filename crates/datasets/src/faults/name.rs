//! Names of faults with their severities, like `jump:1.0m`.

use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

use super::{Axis, Fault};
use crate::Error;

/// Every kind, with a severity as an example of how it is written.
const EXAMPLES: [Fault; 39] = [
    Fault::Jump { metres: 1.0 },
    Fault::Freeze { seconds: 2.0 },
    Fault::Drop { share: 0.1 },
    Fault::JitterPosition { metres: 0.02 },
    Fault::JitterRotation {
        radians: 0.3 * DEGREE,
    },
    Fault::DriftYaw {
        radians_per_second: 0.5 * DEGREE,
    },
    Fault::DriftPosition {
        metres_per_second: 0.3,
    },
    Fault::DriftScale { per_second: 0.01 },
    Fault::Scale { factor: 1.2 },
    Fault::Reversal,
    Fault::TimeWarp { depth: 0.3 },
    Fault::Mounting {
        radians: 5.0 * DEGREE,
    },
    Fault::RollPitchSwap,
    Fault::Handedness { axis: Axis::Left },
    Fault::MirroredPositions { axis: Axis::Up },
    Fault::DegreesForRadians,
    Fault::Slip {
        metres_per_second: 0.3,
    },
    Fault::Rate { factor: 2.0 },
    Fault::PositionLate { seconds: 0.1 },
    Fault::AttitudeLate { seconds: 0.1 },
    Fault::LeverArm {
        axis: Axis::Forward,
        metres: 0.5,
    },
    Fault::Extrinsic {
        axis: Axis::Up,
        radians: DEGREE,
    },
    Fault::Smooth { seconds: 0.5 },
    Fault::SmoothPosition { seconds: 0.5 },
    Fault::BridgedGap { seconds: 1.0 },
    Fault::Quantised { metres: 0.01 },
    Fault::SinglePrecision,
    Fault::FrozenHeight,
    Fault::Level,
    Fault::HeadingFromCourse,
    Fault::Stale { share: 0.2 },
    Fault::Interpolated { factor: 2.0 },
    Fault::Closure {
        metres: 1.0,
        seconds: 2.0,
    },
    Fault::Stall { seconds: 1.0 },
    Fault::Burst { seconds: 1.0 },
    Fault::StampJitter { seconds: 0.1 },
    Fault::Doubled { share: 0.2 },
    Fault::Uneven { depth: 0.5 },
    Fault::Thinned { factor: 2.0 },
];
const DEGREE: f64 = PI / 180.0;

impl Fault {
    /// The name without the severity.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Jump { .. } => "jump",
            Self::Freeze { .. } => "freeze",
            Self::Drop { .. } => "drop",
            Self::JitterPosition { .. } => "jitter-position",
            Self::JitterRotation { .. } => "jitter-rotation",
            Self::DriftYaw { .. } => "drift-yaw",
            Self::DriftPosition { .. } => "drift-position",
            Self::DriftScale { .. } => "drift-scale",
            Self::Scale { .. } => "scale",
            Self::Reversal => "reversal",
            Self::TimeWarp { .. } => "time-warp",
            Self::Mounting { .. } => "mounting",
            Self::RollPitchSwap => "roll-pitch-swap",
            Self::Handedness { .. } => "handedness",
            Self::MirroredPositions { .. } => "mirrored-positions",
            Self::DegreesForRadians => "degrees-for-radians",
            Self::Slip { .. } => "slip",
            Self::Rate { .. } => "rate",
            Self::PositionLate { .. } => "position-late",
            Self::AttitudeLate { .. } => "attitude-late",
            Self::LeverArm { .. } => "lever-arm",
            Self::Extrinsic { .. } => "extrinsic",
            Self::Smooth { .. } => "smooth",
            Self::SmoothPosition { .. } => "smooth-position",
            Self::BridgedGap { .. } => "bridged-gap",
            Self::Quantised { .. } => "quantised",
            Self::SinglePrecision => "single-precision",
            Self::FrozenHeight => "frozen-height",
            Self::Level => "level",
            Self::HeadingFromCourse => "heading-from-course",
            Self::Stale { .. } => "stale",
            Self::Interpolated { .. } => "interpolated",
            Self::Closure { .. } => "closure",
            Self::Stall { .. } => "stall",
            Self::Burst { .. } => "burst",
            Self::StampJitter { .. } => "stamp-jitter",
            Self::Doubled { .. } => "doubled",
            Self::Uneven { .. } => "uneven",
            Self::Thinned { .. } => "thinned",
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = self.severity();
        if severity.is_empty() {
            f.pad(self.name())
        } else {
            f.pad(&format!("{}:{severity}", self.name()))
        }
    }
}

impl FromStr for Fault {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let (name, severity) = match text.split_once(':') {
            Some((name, severity)) => (name, Some(severity)),
            None => (text, None),
        };
        let example = EXAMPLES.iter().find(|fault| fault.name() == name);
        let fault = example.and_then(|fault| fault.with_severity(severity));
        let fault = fault.ok_or_else(|| Error::UnknownName {
            what: "fault",
            found: text.to_owned(),
            expected: EXAMPLES.map(|fault| fault.to_string()).join(", "),
        })?;
        fault.check()?;
        Ok(fault)
    }
}

impl Axis {
    /// All axes.
    pub const ALL: [Self; 3] = [Self::Forward, Self::Left, Self::Up];

    /// The name used on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Left => "left",
            Self::Up => "up",
        }
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Axis {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL
            .into_iter()
            .find(|axis| axis.name() == text)
            .ok_or_else(|| Error::UnknownName {
                what: "axis",
                found: text.to_owned(),
                expected: Self::ALL.map(Self::name).join(", "),
            })
    }
}
