//! What is found, in units and words to act on.

use super::piece::{Axis, Kind};
use super::units;
use serde::{Deserialize, Serialize};

/// How the position of a log belongs to its attitude, compared with the trusted logs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CalibrationFinding {
    /// The cause that explains the difference best.
    pub kind: Kind,
    /// Along or about which axis; forward for an offset in time, where it says nothing.
    pub axis: Axis,
    /// This log less the trusted ones, in `unit`. Positive: position behind attitude; position ahead, to the left,
    /// above; attitude pitched nose down, yawed to the left. Of another unit of length or angle: how many times as large
    /// its numbers make the log, with no error and nothing of the trusted logs beside it.
    pub value: f64,
    /// Of `value`, its standard error, median and spread.
    pub unit: Unit,
    /// Standard error of `value` within this log; for an offset in time with the spread of the trusted logs in it.
    pub standard_error: f64,
    /// What the trusted logs show by the same measure.
    pub trusted_median: f64,
    /// By how much trusted logs differ in it from each other.
    pub trusted_spread: f64,
    /// The largest of the 14 differences of a coefficient, in standard deviations.
    pub z: f64,
    /// Chance of such a z in a log like the trusted ones.
    pub chance: f64,
    /// Whether the log is called wrongly calibrated: a chance of at most the share of alpha asked for, where the
    /// trusted logs allow a call.
    pub called: bool,
    /// How many trusted pieces would be called at this share by those of the other groups.
    pub measured: MeasuredAlarms,
}

/// Alarms among the trusted logs themselves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MeasuredAlarms {
    /// Trusted pieces that would be called by those of the other groups.
    pub called: usize,
    /// Trusted pieces, those of groups that are unlike the others aside.
    pub pieces: usize,
    /// The groups that they are of.
    pub groups: usize,
}

/// Unit of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Unit {
    /// Seconds.
    #[serde(rename = "s")]
    Second,
    /// Metres.
    #[serde(rename = "m")]
    Metre,
    /// Radians.
    #[serde(rename = "rad")]
    Radian,
    /// None: how many times as large.
    #[serde(rename = "times")]
    Factor,
}

impl CalibrationFinding {
    /// In plain words, such as `position about 0.1 s behind attitude`. `named_axes`: whether the body's axes are known
    /// to be forward, left and up; else they are called x, y and z.
    #[must_use]
    pub fn sentence(&self, named_axes: bool) -> String {
        let size = self.value.abs();
        let positive = self.value > 0.0;
        let axis = ['x', 'y', 'z'][self.axis as usize];
        match self.kind {
            Kind::TimeOffset => {
                let side = if positive { "behind" } else { "ahead of" };
                format!("position about {} s {side} attitude", two_digits(size))
            }
            Kind::LeverArm => {
                let metres = two_digits(size);
                if !named_axes {
                    let sign = if positive { '+' } else { '-' };
                    return format!(
                        "position about {metres} m along {sign}{axis} from the point of the body that the trusted logs report"
                    );
                }
                let side = match (self.axis, positive) {
                    (Axis::Forward, true) => "ahead of",
                    (Axis::Forward, false) => "behind",
                    (Axis::Left, true) => "left of",
                    (Axis::Left, false) => "right of",
                    (Axis::Up, true) => "above",
                    (Axis::Up, false) => "below",
                };
                format!(
                    "position about {metres} m {side} the point of the body that the trusted logs report"
                )
            }
            Kind::Length | Kind::Turn => {
                let what = match self.kind {
                    Kind::Length => "positions",
                    _ => "turns",
                };
                let (own, trusted) =
                    units::named(self.kind, self.value).unwrap_or(("one unit", "another"));
                format!(
                    "{what} look {} times as large as in the trusted logs, as {own} beside {trusted} would",
                    three_digits(self.value)
                )
            }
            Kind::Mounting => {
                let degrees = two_digits(size.to_degrees());
                if !named_axes {
                    let sign = if positive { '+' } else { '-' };
                    return format!("attitude about {degrees} degrees off about {sign}{axis}");
                }
                let (turn, side) = match (self.axis, positive) {
                    (Axis::Forward, true) => ("roll", "to the right"),
                    (Axis::Forward, false) => ("roll", "to the left"),
                    (Axis::Left, true) => ("pitch", "nose down"),
                    (Axis::Left, false) => ("pitch", "nose up"),
                    (Axis::Up, true) => ("yaw", "to the left"),
                    (Axis::Up, false) => ("yaw", "to the right"),
                };
                format!("{turn} about {degrees} degrees off, {side}")
            }
        }
    }
}

/// A positive number to three digits.
fn three_digits(value: f64) -> String {
    let places = (2.0 - value.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.places$}")
}

/// A positive number to two digits.
fn two_digits(value: f64) -> String {
    if value < 1e-6 {
        return "0".to_owned();
    }
    let places = (1.0 - value.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.places$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences() {
        let finding = |kind, axis, value: f64| CalibrationFinding {
            kind,
            axis,
            value,
            unit: Unit::Second,
            standard_error: 0.0,
            trusted_median: 0.0,
            trusted_spread: 0.0,
            z: 9.0,
            chance: 1e-6,
            called: true,
            measured: MeasuredAlarms {
                called: 0,
                pieces: 9,
                groups: 5,
            },
        };
        let late = finding(Kind::TimeOffset, Axis::Forward, 0.1004);
        assert_eq!(late.sentence(true), "position about 0.10 s behind attitude");
        let lever = finding(Kind::LeverArm, Axis::Up, -1.26);
        assert!(
            lever
                .sentence(true)
                .starts_with("position about 1.3 m below")
        );
        assert!(
            lever
                .sentence(false)
                .starts_with("position about 1.3 m along -z")
        );
        let pitch = finding(Kind::Mounting, Axis::Left, 1.4_f64.to_radians());
        assert_eq!(
            pitch.sentence(true),
            "pitch about 1.4 degrees off, nose down"
        );
        assert_eq!(two_digits(0.0), "0");
        assert_eq!(two_digits(123.4), "123");
    }
}
