//! The strongest of what may be said, without saying one thing twice.

use super::candidate::Candidate;
use crate::report::{ReasonAxis, ReasonKind};

/// Poses beside a jump or a repetition that show it too: noise looks at five neighbours.
const BESIDE: usize = 8;

/// Beside a certain reason (a repeated pose) one that is this strong is worth saying; beside another one this share of
/// its strength.
const BESIDE_CERTAIN: f64 = 2.0;
const WORTH_SAYING: f64 = 0.35;

/// At most `most`, the strongest first.
pub(super) fn strongest(mut found: Vec<Candidate>, most: usize) -> Vec<Candidate> {
    found.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    let least = found.first().map_or(0.0, |first| {
        (WORTH_SAYING * first.strength).min(BESIDE_CERTAIN)
    });
    let separated = calibration_is_separate(&found);
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in found {
        let worth = candidate.strength >= least && (separated || !candidate.is_calibration());
        if worth && kept.len() < most && !kept.iter().any(|said| explains(said, &candidate)) {
            kept.push(candidate);
        }
    }
    kept
}

/// A delay, a lever arm or a mounting is a cause only where nothing simpler is wrong: noise, jumps, repetitions and
/// another speed (or unit) move the regressions that it is read from.
fn calibration_is_separate(found: &[Candidate]) -> bool {
    let simpler = |c: &Candidate| match c.kind {
        ReasonKind::Noise
        | ReasonKind::Jump
        | ReasonKind::Repeats
        | ReasonKind::Interpolated
        | ReasonKind::Grid
        | ReasonKind::Backwards => true,
        ReasonKind::Velocity => matches!(c.axis, ReasonAxis::Forward | ReasonAxis::Position),
        _ => false,
    };
    !found.iter().any(|c| simpler(c) && c.strength > SIMPLER)
}

/// From this strength on something simpler is wrong: 1.5 times as far out as trusted.
const SIMPLER: f64 = 1.4;

/// Whether `other` follows from what was `said`.
fn explains(said: &Candidate, other: &Candidate) -> bool {
    use ReasonKind::{
        Acceleration, Backwards, Coupling, Direction, Frozen, Grid, Interpolated, Jump, LeverArm,
        Mounting, Noise, Repeats, Smooth, TimeOffset, Velocity,
    };
    let near = other.peak.is_some_and(|peak| {
        (said.poses.start.saturating_sub(BESIDE)..said.poses.end + BESIDE).contains(&peak)
    });
    let family = shares_part(said.axis, other.axis);
    match (said.kind, other.kind) {
        // One thing in two quantities.
        (a, b) if a == b && said.axis == other.axis => true,
        (Noise, Noise) | (Smooth, Smooth) | (Acceleration, Acceleration) | (Coupling, Coupling) => {
            family
        }
        (Velocity, Direction) | (Direction, Velocity) => {
            said.axis == other.axis || other.axis == ReasonAxis::Position
        }
        (Velocity, Velocity) => {
            let whole = |axis| matches!(axis, ReasonAxis::Position | ReasonAxis::Attitude);
            family && (whole(other.axis) || whole(said.axis))
        }
        (Velocity | Direction | Backwards, Acceleration | Coupling) => family,
        (Backwards, Velocity | Direction | Smooth) => family,
        (Noise, Acceleration | Coupling | Jump) => family,
        (Noise, Velocity | Direction) => family && other.peak.is_some(),
        (Repeats | Interpolated, Frozen | Smooth | Interpolated | Repeats | Coupling) => true,
        (Frozen, Smooth) => family,
        (Grid, Noise | Jump | Acceleration | Frozen | Repeats | Velocity | Direction) => {
            family && other.axis != ReasonAxis::Pose
        }
        (Repeats | Interpolated, _) => near,
        (Jump, Noise | Acceleration | Velocity | Direction | Coupling) => near,
        (TimeOffset | LeverArm | Mounting, TimeOffset | LeverArm | Mounting | Coupling) => true,
        _ => false,
    }
}

/// Whether both are of the position, or both of the attitude.
fn shares_part(a: ReasonAxis, b: ReasonAxis) -> bool {
    let turn = |axis: ReasonAxis| match axis {
        ReasonAxis::Roll | ReasonAxis::Pitch | ReasonAxis::Yaw | ReasonAxis::Attitude => Some(true),
        ReasonAxis::Forward | ReasonAxis::Left | ReasonAxis::Up | ReasonAxis::Position => {
            Some(false)
        }
        ReasonAxis::Pose => None,
    };
    match (turn(a), turn(b)) {
        (Some(a), Some(b)) => a == b,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::series::Unit;

    fn candidate(
        kind: ReasonKind,
        axis: ReasonAxis,
        strength: f64,
        peak: Option<usize>,
    ) -> Candidate {
        Candidate {
            kind,
            axis,
            amount: 1.0,
            trusted: None,
            unit: Unit::One,
            strength,
            poses: 100..110,
            peak,
            sentence: String::new(),
        }
    }

    #[test]
    fn what_follows_from_a_repetition_is_not_said_and_the_rest_is() {
        let kinds = |found| -> Vec<ReasonKind> {
            strongest(found, 3).into_iter().map(|c| c.kind).collect()
        };
        let found = vec![
            candidate(ReasonKind::Jump, ReasonAxis::Position, 4.0, Some(111)),
            candidate(ReasonKind::Repeats, ReasonAxis::Pose, 10.0, None),
            candidate(ReasonKind::Direction, ReasonAxis::Left, 2.0, Some(300)),
            candidate(ReasonKind::Velocity, ReasonAxis::Left, 1.5, Some(300)),
        ];
        assert_eq!(kinds(found), [ReasonKind::Repeats, ReasonKind::Direction]);
        let found = vec![
            candidate(ReasonKind::Noise, ReasonAxis::Roll, 3.0, None),
            candidate(ReasonKind::Noise, ReasonAxis::Pitch, 2.9, None),
            candidate(ReasonKind::Noise, ReasonAxis::Left, 2.0, None),
        ];
        assert_eq!(strongest(found, 3).len(), 2);
    }
}
