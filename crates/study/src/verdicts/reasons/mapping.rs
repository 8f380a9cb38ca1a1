//! Which sentences name a fault: fixed before any was measured.
//!
//! A sentence names a fault where its kind is one of those in which the fault consists or that it must show, and its
//! axis is one that the fault acts on. What a fault shares with sound motion (a car that is 5 % faster) has no kind of
//! its own: its speed is named.

use dose3::report::{Reason, ReasonAxis, ReasonKind};
use dose3_datasets::faults::{Axis, Fault};

use ReasonAxis::{Attitude, Forward, Left, Pitch, Pose, Position, Roll, Up, Yaw};
use ReasonKind::{
    Acceleration, Backwards, Coupling, Direction, Frozen, Grid, Interpolated, Jump, LeverArm,
    Mounting, Noise, Repeats, Smooth, TimeOffset, Velocity,
};

/// Along all axes.
const ALONG: &[ReasonAxis] = &[Forward, Left, Up, Position];
/// In the plane.
const PLANE: &[ReasonAxis] = &[Forward, Left, Position];
/// In the direction of travel.
const AHEAD: &[ReasonAxis] = &[Forward, Position];
/// About all axes.
const ABOUT: &[ReasonAxis] = &[Roll, Pitch, Yaw, Attitude];
const ANY: &[ReasonAxis] = &[
    Forward, Left, Up, Roll, Pitch, Yaw, Position, Attitude, Pose,
];

type Names = (&'static [ReasonKind], &'static [ReasonAxis]);

/// Kinds and axes, of which one each names the fault. `forward`: whether the body has a forward axis, so that faults
/// in a random direction are in the plane.
fn names(fault: &Fault, forward: bool) -> Vec<Names> {
    let plane = if forward { PLANE } else { ALONG };
    match fault {
        Fault::Jump { .. } => vec![(&[Jump, Acceleration, Velocity], plane)],
        Fault::Freeze { .. } | Fault::Stale { .. } => {
            vec![(&[Repeats], &[Pose, Position, Attitude])]
        }
        // Without stamps a lost pose is a step twice as long.
        Fault::Drop { .. } => vec![(
            &[Jump, Noise, Acceleration, Velocity],
            if forward { AHEAD } else { ALONG },
        )],
        Fault::JitterPosition { .. } => vec![(&[Noise], ALONG)],
        Fault::JitterRotation { .. } => vec![(&[Noise], ABOUT)],
        Fault::DriftYaw { .. } => vec![(&[Velocity, Coupling, Noise], &[Yaw])],
        Fault::DriftPosition { .. } => vec![(
            &[Velocity, Direction, Coupling],
            if forward { ALONG } else { ANY },
        )],
        Fault::DriftScale { .. } | Fault::Scale { .. } => {
            vec![(
                &[Velocity, Acceleration],
                if forward { AHEAD } else { ALONG },
            )]
        }
        Fault::TimeWarp { .. } => {
            vec![(&[Velocity, Acceleration], if forward { AHEAD } else { ANY })]
        }
        Fault::Mounting { .. } => vec![
            (&[Direction], &[Left]),
            (&[Mounting, Velocity], &[Yaw]),
            (&[Jump], &[Attitude]),
        ],
        Fault::Slip { .. } => vec![(&[Velocity, Direction, Coupling], &[Left])],
        Fault::Rate { factor } if *factor < 1.0 => vec![(&[Repeats], &[Pose, Position, Attitude])],
        Fault::Rate { .. } => vec![(
            &[Velocity, Acceleration, Jump],
            if forward { AHEAD } else { ANY },
        )],
        Fault::Reversal => vec![
            (&[Backwards, Velocity], &[Forward]),
            (&[Direction], &[Left]),
        ],
        Fault::RollPitchSwap => vec![
            (&[Velocity, Noise, Coupling, Mounting], &[Roll, Pitch]),
            (&[Jump], &[Attitude]),
            (&[Direction], &[Up]),
        ],
        Fault::Handedness { axis } => vec![(
            &[
                Coupling, Direction, Velocity, TimeOffset, LeverArm, Mounting,
            ],
            match axis {
                Axis::Up => &[Up, Pitch, Roll, Pose],
                _ => &[Left, Roll, Yaw, Pose],
            },
        )],
        Fault::MirroredPositions { axis } => vec![
            (&[Backwards], &[Forward]),
            (
                &[Coupling, Direction, Velocity, Mounting],
                match axis {
                    Axis::Up => &[Up, Pitch],
                    _ => &[Left, Yaw],
                },
            ),
        ],
        Fault::DegreesForRadians => vec![
            (&[Velocity, Smooth, Frozen], ABOUT),
            (&[Jump], &[Attitude]),
            (&[Direction], &[Left, Up]),
            (&[Backwards], &[Forward]),
        ],
        Fault::PositionLate { .. } | Fault::AttitudeLate { .. } => {
            vec![
                (&[TimeOffset], &[Pose]),
                (&[Coupling, Direction], &[Left, Up]),
            ]
        }
        Fault::LeverArm { axis, .. } => match axis {
            Axis::Forward => vec![
                (&[LeverArm], &[Forward]),
                (&[Coupling, Direction, Velocity], &[Left, Up]),
            ],
            Axis::Left => vec![
                (&[LeverArm], &[Left]),
                (&[Coupling, Direction, Velocity], &[Forward, Up]),
            ],
            Axis::Up => vec![
                (&[LeverArm], &[Up]),
                (&[Coupling, Direction, Velocity], &[Forward, Left]),
            ],
        },
        Fault::Extrinsic { axis, .. } => match axis {
            Axis::Forward => vec![(&[Mounting, Coupling, Velocity], &[Roll, Pitch, Yaw])],
            Axis::Left => vec![
                (&[Mounting, Coupling, Velocity], &[Pitch]),
                (&[Direction, Velocity], &[Up]),
            ],
            Axis::Up => vec![
                (&[Mounting, Coupling, Velocity], &[Yaw]),
                (&[Direction, Velocity], &[Left]),
            ],
        },
        Fault::Smooth { .. } => vec![(&[Smooth], ANY)],
        Fault::SmoothPosition { .. } => vec![(&[Smooth], ALONG)],
        Fault::BridgedGap { .. } | Fault::Interpolated { .. } => vec![(&[Interpolated], &[Pose])],
        Fault::Quantised { .. } | Fault::SinglePrecision => vec![(&[Grid, Noise], ALONG)],
        Fault::FrozenHeight => vec![(&[Frozen], &[Up])],
        Fault::Level => vec![(&[Frozen], &[Roll, Pitch])],
        Fault::HeadingFromCourse => vec![
            (&[Noise, Velocity, Acceleration, Coupling], &[Yaw]),
            (&[Jump], &[Attitude]),
            (&[Direction], &[Left]),
        ],
        Fault::Closure { .. } => {
            vec![(&[Jump, Velocity, Direction, Coupling, Acceleration], plane)]
        }
        Fault::Stall { .. }
        | Fault::Burst { .. }
        | Fault::StampJitter { .. }
        | Fault::Doubled { .. }
        | Fault::Uneven { .. }
        | Fault::Thinned { .. } => Vec::new(),
    }
}

/// Whether a reason names the fault.
pub fn named(fault: &Fault, reason: &Reason, forward: bool) -> bool {
    let said = |(kinds, axes): &Names| kinds.contains(&reason.kind) && axes.contains(&reason.axis);
    names(fault, forward).iter().any(said)
}

/// The mapping of a fault as text, for the table.
pub fn text(fault: &Fault) -> String {
    let list = |names: &[String]| names.join(", ");
    let part = |(kinds, axes): &Names| {
        let kinds: Vec<String> = kinds
            .iter()
            .map(|k| format!("{k:?}").to_lowercase())
            .collect();
        let axes: Vec<String> = axes
            .iter()
            .map(|a| format!("{a:?}").to_lowercase())
            .collect();
        let axes = if axes.len() == ANY.len() {
            "any".to_owned()
        } else {
            list(&axes)
        };
        format!("{} of {axes}", list(&kinds))
    };
    let all: Vec<String> = names(fault, true).iter().map(part).collect();
    all.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_of_the_lists_of_motion_has_names() {
        for (.., fault) in Fault::suite().into_iter().chain(Fault::couplings()) {
            assert!(!names(&fault, true).is_empty(), "{fault}");
            assert!(!text(&fault).is_empty());
        }
    }
}
