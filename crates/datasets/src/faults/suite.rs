//! The faults that a detector is measured on.

use super::{Axis, Fault};

impl Fault {
    /// Name, severity (empty where there is none) and fault, from weak to strong within a name; the wrong rates are
    /// first the slower ones, then the faster ones.
    pub fn suite() -> Vec<(&'static str, String, Self)> {
        let mut faults = Vec::new();
        let mut add = |severities: &[f64], fault: fn(f64) -> Self| {
            faults.extend(severities.iter().map(|severity| fault(*severity)));
        };
        add(&[0.2, 0.5, 1.0, 3.0], |metres| Self::Jump { metres });
        add(&[0.5, 1.0, 2.0], |seconds| Self::Freeze { seconds });
        add(&[0.1, 0.3], |share| Self::Drop { share });
        add(&[0.01, 0.02, 0.05], |metres| Self::JitterPosition {
            metres,
        });
        add(&[0.1, 0.3, 1.0], |degrees| Self::JitterRotation {
            radians: degrees.to_radians(),
        });
        add(&[0.2, 0.5, 2.0], |degrees| Self::DriftYaw {
            radians_per_second: degrees.to_radians(),
        });
        add(&[0.1, 0.3, 1.0], |metres_per_second| Self::DriftPosition {
            metres_per_second,
        });
        add(&[0.005, 0.01, 0.02], |per_second| Self::DriftScale {
            per_second,
        });
        add(&[1.05, 1.2], |factor| Self::Scale { factor });
        add(&[0.1, 0.3], |depth| Self::TimeWarp { depth });
        add(&[2.0, 5.0, 10.0], |degrees| Self::Mounting {
            radians: degrees.to_radians(),
        });
        add(&[0.1, 0.3, 1.0], |metres_per_second| Self::Slip {
            metres_per_second,
        });
        add(&[0.8, 0.5, 1.25, 2.0], |factor| Self::Rate { factor });
        faults.extend([
            Self::Reversal,
            Self::RollPitchSwap,
            Self::Handedness { axis: Axis::Left },
            Self::Handedness { axis: Axis::Up },
            Self::MirroredPositions { axis: Axis::Left },
            Self::MirroredPositions { axis: Axis::Up },
            Self::DegreesForRadians,
        ]);
        named(faults)
    }

    /// Faults of how position and attitude belong together, and of what filters and files do to poses: name, severity
    /// and fault, from weak to strong within a name.
    pub fn couplings() -> Vec<(&'static str, String, Self)> {
        let mut faults = Vec::new();
        let mut add = |severities: &[f64], fault: &dyn Fn(f64) -> Self| {
            faults.extend(severities.iter().map(|severity| fault(*severity)));
        };
        add(&[0.02, 0.05, 0.1, 0.2], &|seconds| Self::PositionLate {
            seconds,
        });
        add(&[0.02, 0.05, 0.1, 0.2], &|seconds| Self::AttitudeLate {
            seconds,
        });
        for axis in Axis::ALL {
            add(&[0.1, 0.5, 1.0, 2.0], &|metres| Self::LeverArm {
                axis,
                metres,
            });
        }
        for axis in Axis::ALL {
            add(&[0.5, 1.0], &|degrees| Self::Extrinsic {
                axis,
                radians: degrees.to_radians(),
            });
        }
        add(&[0.3, 0.5, 1.0], &|seconds| Self::Smooth { seconds });
        add(&[0.3, 0.5, 1.0], &|seconds| Self::SmoothPosition {
            seconds,
        });
        add(&[0.5, 1.0, 2.0], &|seconds| Self::BridgedGap { seconds });
        add(&[0.001, 0.01, 0.25], &|metres| Self::Quantised { metres });
        add(&[0.1], &|per_minute| Self::DriftScale {
            per_second: per_minute / 60.0,
        });
        add(&[0.1, 0.3], &|share| Self::Stale { share });
        add(&[2.0, 5.0], &|factor| Self::Interpolated { factor });
        add(&[3.0, 2.0, 1.0], &|seconds| Self::Closure {
            metres: 1.0,
            seconds,
        });
        faults.extend([
            Self::SinglePrecision,
            Self::FrozenHeight,
            Self::Level,
            Self::HeadingFromCourse,
        ]);
        named(faults)
    }

    /// Faults that show in the stamps, of a log at the sensor's own rate: name, severity and fault, from weak to
    /// strong within a name.
    pub fn timing() -> Vec<(&'static str, String, Self)> {
        named(vec![
            Self::Drop { share: 0.05 },
            Self::Drop { share: 0.2 },
            Self::Stall { seconds: 0.5 },
            Self::Stall { seconds: 1.0 },
            Self::Stall { seconds: 2.0 },
            Self::Burst { seconds: 1.0 },
            Self::StampJitter { seconds: 0.02 },
            Self::StampJitter { seconds: 0.1 },
            Self::Doubled { share: 0.2 },
            Self::Uneven { depth: 0.2 },
            Self::Uneven { depth: 0.5 },
            Self::Thinned { factor: 2.0 },
        ])
    }
}

fn named(faults: Vec<Fault>) -> Vec<(&'static str, String, Fault)> {
    faults
        .into_iter()
        .map(|fault| (fault.name(), fault.severity(), fault))
        .collect()
}
