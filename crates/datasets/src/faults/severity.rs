//! Severities: their units, ranges, and how they are written and made stronger.

use std::f64::consts::PI;
use std::ops::RangeInclusive;

use super::{Axis, Fault};
use crate::Error;

/// What a severity's number is.
#[derive(Clone, Copy)]
pub(super) enum Unit {
    Metres,
    Seconds,
    Share,
    /// Radians; written in degrees.
    Angle,
    /// Radians a second; written in degrees.
    AngleRate,
    MetresPerSecond,
    PerSecond,
    /// A factor on lengths.
    Scale,
    /// A factor on rates.
    Rate,
    /// A factor on rates that cannot make them faster.
    Thinning,
}

impl Unit {
    fn suffix(self) -> &'static str {
        match self {
            Self::Metres => "m",
            Self::Seconds => "s",
            Self::Share => "",
            Self::Angle => "deg",
            Self::AngleRate => "deg/s",
            Self::MetresPerSecond => "m/s",
            Self::PerSecond => "/s",
            Self::Scale | Self::Rate | Self::Thinning => "x",
        }
    }

    fn allowed(self) -> (RangeInclusive<f64>, &'static str) {
        match self {
            Self::Metres
            | Self::Seconds
            | Self::AngleRate
            | Self::MetresPerSecond
            | Self::PerSecond => (0.0..=1e4, "between 0 and 10000"),
            Self::Angle => (0.0..=PI, "between 0 and 180 degrees"),
            Self::Share => (0.0..=0.95, "between 0 and 0.95"),
            Self::Scale => (1e-3..=1e3, "between 0.001 and 1000"),
            Self::Rate => (0.05..=20.0, "between 0.05 and 20"),
            Self::Thinning => (1.0..=20.0, "between 1 and 20"),
        }
    }

    /// The number with its unit, such that [`Self::read`] gives it back to the last bit.
    fn write(self, value: f64) -> String {
        if matches!(self, Self::Angle | Self::AngleRate) {
            let degrees = (value.to_degrees() * 1e9).round() / 1e9;
            if degrees.to_radians() != value {
                return format!("{value:?}{}", self.suffix().replace("deg", "rad"));
            }
            return format!("{degrees:?}{}", self.suffix());
        }
        format!("{value:?}{}", self.suffix())
    }

    /// The number to four decimals with its unit.
    fn write_short(self, value: f64) -> String {
        let value = match self {
            Self::Angle | Self::AngleRate => value.to_degrees(),
            _ => value,
        };
        format!("{}{}", (value * 1e4).round() / 1e4, self.suffix())
    }

    fn read(self, text: &str) -> Option<f64> {
        if let Some(number) = text.strip_suffix(self.suffix()) {
            let number: f64 = number.parse().ok()?;
            return Some(match self {
                Self::Angle | Self::AngleRate => number.to_radians(),
                _ => number,
            });
        }
        let radians = text.strip_suffix(&self.suffix().replace("deg", "rad"))?;
        radians.parse().ok()
    }

    /// A severity `factor` times as far from none.
    fn stronger(self, value: f64, factor: f64) -> f64 {
        match self {
            Self::Scale | Self::Rate | Self::Thinning if value < 1.0 => {
                1.0 / (1.0 + (1.0 / value - 1.0) * factor)
            }
            Self::Scale | Self::Rate | Self::Thinning => 1.0 + (value - 1.0) * factor,
            _ => value * factor,
        }
    }
}

impl Fault {
    /// The severity with its unit, angles in degrees; empty where there is none. An axis comes first.
    pub fn severity(&self) -> String {
        self.severity_with(Unit::write)
    }

    /// Name and severity in at most four decimals: for tables. [`Fault`]'s `Display` writes every digit.
    ///
    /// ```
    /// use dose3_datasets::faults::Fault;
    ///
    /// let third = Fault::Freeze { seconds: 1.0 / 3.0 };
    /// assert_eq!(third.label(), "freeze:0.3333s");
    /// assert_eq!(third.to_string(), "freeze:0.3333333333333333s");
    /// ```
    pub fn label(&self) -> String {
        let severity = self.severity_with(Unit::write_short);
        if severity.is_empty() {
            return self.name().to_owned();
        }
        format!("{}:{severity}", self.name())
    }

    /// The fault with its severity `factor` times as far from none; for a severity that multiplies (scale, rate), its
    /// excess over one, or that of its inverse. Faults without a number stay as they are.
    ///
    /// ```
    /// use dose3_datasets::faults::Fault;
    ///
    /// assert_eq!(Fault::Jump { metres: 0.5 }.stronger(2.0), Fault::Jump { metres: 1.0 });
    /// assert_eq!(Fault::Rate { factor: 0.5 }.stronger(3.0), Fault::Rate { factor: 0.25 });
    /// assert_eq!(Fault::Reversal.stronger(2.0), Fault::Reversal);
    /// ```
    #[must_use]
    pub fn stronger(mut self, factor: f64) -> Self {
        for (value, unit) in self.numbers() {
            *value = unit.stronger(*value, factor);
        }
        self
    }

    fn severity_with(&self, write: fn(Unit, f64) -> String) -> String {
        let mut fault = *self;
        let axis = fault.axis().map(|axis| axis.name().to_owned());
        let numbers = fault.numbers().into_iter();
        let parts: Vec<String> = axis
            .into_iter()
            .chain(numbers.map(|(value, unit)| write(unit, *value)))
            .collect();
        parts.join(":")
    }

    /// The fault with the severity that [`Self::severity`] writes like this.
    pub(super) fn with_severity(mut self, text: Option<&str>) -> Option<Self> {
        let mut parts = text.into_iter().flat_map(|text| text.split(':'));
        if let Some(axis) = self.axis() {
            *axis = parts.next()?.parse().ok()?;
        }
        for (value, unit) in self.numbers() {
            *value = unit.read(parts.next()?)?;
        }
        parts.next().is_none().then_some(self)
    }

    /// Refuses severities that are no numbers or beyond what a log can hold.
    pub(super) fn check(&self) -> Result<(), Error> {
        let mut fault = *self;
        for (value, unit) in fault.numbers() {
            let (allowed, expected) = unit.allowed();
            if !allowed.contains(value) {
                return Err(Error::Parameter {
                    what: "severity of the fault",
                    expected,
                    found: self.to_string(),
                });
            }
        }
        Ok(())
    }

    fn axis(&mut self) -> Option<&mut Axis> {
        match self {
            Self::Handedness { axis }
            | Self::MirroredPositions { axis }
            | Self::LeverArm { axis, .. }
            | Self::Extrinsic { axis, .. } => Some(axis),
            _ => None,
        }
    }

    fn numbers(&mut self) -> Vec<(&mut f64, Unit)> {
        match self {
            Self::Jump { metres }
            | Self::JitterPosition { metres }
            | Self::LeverArm { metres, .. }
            | Self::Quantised { metres } => vec![(metres, Unit::Metres)],
            Self::Freeze { seconds }
            | Self::PositionLate { seconds }
            | Self::AttitudeLate { seconds }
            | Self::Smooth { seconds }
            | Self::SmoothPosition { seconds }
            | Self::BridgedGap { seconds }
            | Self::Stall { seconds }
            | Self::Burst { seconds }
            | Self::StampJitter { seconds } => vec![(seconds, Unit::Seconds)],
            Self::Drop { share: value }
            | Self::Stale { share: value }
            | Self::Doubled { share: value }
            | Self::TimeWarp { depth: value }
            | Self::Uneven { depth: value } => vec![(value, Unit::Share)],
            Self::JitterRotation { radians }
            | Self::Mounting { radians }
            | Self::Extrinsic { radians, .. } => vec![(radians, Unit::Angle)],
            Self::DriftYaw { radians_per_second } => vec![(radians_per_second, Unit::AngleRate)],
            Self::DriftPosition { metres_per_second } | Self::Slip { metres_per_second } => {
                vec![(metres_per_second, Unit::MetresPerSecond)]
            }
            Self::DriftScale { per_second } => vec![(per_second, Unit::PerSecond)],
            Self::Closure { metres, seconds } => {
                vec![(metres, Unit::Metres), (seconds, Unit::Seconds)]
            }
            Self::Scale { factor } => vec![(factor, Unit::Scale)],
            Self::Rate { factor } => vec![(factor, Unit::Rate)],
            Self::Interpolated { factor } | Self::Thinned { factor } => {
                vec![(factor, Unit::Thinning)]
            }
            Self::Reversal
            | Self::RollPitchSwap
            | Self::Handedness { .. }
            | Self::MirroredPositions { .. }
            | Self::DegreesForRadians
            | Self::SinglePrecision
            | Self::FrozenHeight
            | Self::Level
            | Self::HeadingFromCourse => Vec::new(),
        }
    }
}
