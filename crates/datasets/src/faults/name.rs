//! Names of faults with their severities, like `jump:1.0m`.

use std::fmt;
use std::str::FromStr;

use super::{Axis, Fault};
use crate::Error;

/// Every name, with a severity as it is written.
const EXAMPLES: &str = "jump:1.0m, freeze:2.0s, drop:0.1, jitter-position:0.02m, jitter-rotation:0.3deg, \
    drift-yaw:0.5deg/s, drift-position:0.3m/s, drift-scale:0.01/s, scale:1.2x, reversal, time-warp:0.3, \
    mounting:5.0deg, roll-pitch-swap, handedness:left, mirrored-positions:up, degrees-for-radians, slip:0.3m/s, \
    rate:2.0x";

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
        }
    }

    /// The severity with its unit, angles in degrees; empty where there is none.
    pub fn severity(&self) -> String {
        match *self {
            Self::Jump { metres } | Self::JitterPosition { metres } => format!("{metres:?}m"),
            Self::Freeze { seconds } => format!("{seconds:?}s"),
            Self::Drop { share: value } | Self::TimeWarp { depth: value } => format!("{value:?}"),
            Self::JitterRotation { radians } | Self::Mounting { radians } => angle(radians),
            Self::DriftYaw { radians_per_second } => format!("{}/s", angle(radians_per_second)),
            Self::DriftPosition { metres_per_second } | Self::Slip { metres_per_second } => {
                format!("{metres_per_second:?}m/s")
            }
            Self::DriftScale { per_second } => format!("{per_second:?}/s"),
            Self::Scale { factor } | Self::Rate { factor } => format!("{factor:?}x"),
            Self::Handedness { axis } | Self::MirroredPositions { axis } => axis.name().to_owned(),
            Self::Reversal | Self::RollPitchSwap | Self::DegreesForRadians => String::new(),
        }
    }
}

/// Degrees where they give the angle back to the last bit, else radians.
fn angle(radians: f64) -> String {
    let degrees = (radians.to_degrees() * 1e9).round() / 1e9;
    if degrees.to_radians() == radians {
        format!("{degrees:?}deg")
    } else {
        format!("{radians:?}rad")
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
        let (name, severity) = text.split_once(':').unwrap_or((text, ""));
        let number = |unit: &str| -> Option<f64> { severity.strip_suffix(unit)?.parse().ok() };
        let angle = |unit: &str| -> Option<f64> {
            let angle = severity.strip_suffix(unit)?;
            match angle.strip_suffix("deg") {
                Some(degrees) => Some(degrees.parse::<f64>().ok()?.to_radians()),
                None => angle.strip_suffix("rad")?.parse().ok(),
            }
        };
        let alone = |fault: Self| severity.is_empty().then_some(fault);
        let fault = match name {
            "jump" => number("m").map(|metres| Self::Jump { metres }),
            "freeze" => number("s").map(|seconds| Self::Freeze { seconds }),
            "drop" => number("").map(|share| Self::Drop { share }),
            "jitter-position" => number("m").map(|metres| Self::JitterPosition { metres }),
            "jitter-rotation" => angle("").map(|radians| Self::JitterRotation { radians }),
            "drift-yaw" => {
                angle("/s").map(|radians_per_second| Self::DriftYaw { radians_per_second })
            }
            "drift-position" => {
                number("m/s").map(|metres_per_second| Self::DriftPosition { metres_per_second })
            }
            "drift-scale" => number("/s").map(|per_second| Self::DriftScale { per_second }),
            "scale" => number("x").map(|factor| Self::Scale { factor }),
            "reversal" => alone(Self::Reversal),
            "time-warp" => number("").map(|depth| Self::TimeWarp { depth }),
            "mounting" => angle("").map(|radians| Self::Mounting { radians }),
            "roll-pitch-swap" => alone(Self::RollPitchSwap),
            "handedness" => severity.parse().ok().map(|axis| Self::Handedness { axis }),
            "mirrored-positions" => {
                let axis = severity.parse().ok();
                axis.map(|axis| Self::MirroredPositions { axis })
            }
            "degrees-for-radians" => alone(Self::DegreesForRadians),
            "slip" => number("m/s").map(|metres_per_second| Self::Slip { metres_per_second }),
            "rate" => number("x").map(|factor| Self::Rate { factor }),
            _ => None,
        };
        let fault = fault.ok_or_else(|| Error::UnknownName {
            what: "fault",
            found: text.to_owned(),
            expected: EXAMPLES.to_owned(),
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
