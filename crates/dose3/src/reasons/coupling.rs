//! Whether position and attitude of the stretch belong together: one late, apart or turned against the other.

use super::candidate::{Candidate, Stretch};
use crate::error::Result;
use crate::report::{ReasonAxis, ReasonKind};
use crate::series::Unit;
use dose3_datasets::{Frame, increments};
use dose3_ood::findings::calibration::{
    Axis, CalibrationPiece, CalibrationReference, Kind, Unit as CalibrationUnit,
};

/// A stretch is said to be calibrated differently at this chance or less.
const CHANCE: f64 = 0.01;

/// Regressions need more poses than these.
const REGRESSED: usize = 200;

/// What the calibration of the stretch says, where trusted logs hardly ever do so. `poses` of the log are looked at:
/// those of the stretch, and as many beside it as regressions need.
pub(super) fn candidate(
    stretch: &Stretch<'_>,
    frame: Frame,
    reference: &CalibrationReference,
) -> Result<Option<Candidate>> {
    let poses = match stretch.poses.len() > REGRESSED {
        true => stretch.poses.clone(),
        false => 0..stretch.all.len(),
    };
    let steps = increments(&stretch.all[poses.clone()], frame);
    let pieces = CalibrationPiece::of_stretch(&steps, stretch.hertz)?;
    let Some(found) = reference.judge(&pieces, CHANCE)? else {
        return Ok(None);
    };
    // A cause is named only where its size is clearly not zero.
    if found.chance > CHANCE || found.value.abs() < 2.0 * found.standard_error {
        return Ok(None);
    }
    let axis = match (found.kind, found.axis) {
        (Kind::TimeOffset, _) => ReasonAxis::Pose,
        (Kind::LeverArm, Axis::Forward) => ReasonAxis::Forward,
        (Kind::LeverArm, Axis::Left) => ReasonAxis::Left,
        (Kind::LeverArm, Axis::Up) => ReasonAxis::Up,
        (Kind::Mounting, Axis::Forward) => ReasonAxis::Roll,
        (Kind::Mounting, Axis::Left) => ReasonAxis::Pitch,
        (Kind::Mounting, Axis::Up) => ReasonAxis::Yaw,
        (Kind::Length, _) => ReasonAxis::Position,
        (Kind::Turn, _) => ReasonAxis::Attitude,
    };
    Ok(Some(Candidate {
        kind: match found.kind {
            Kind::TimeOffset => ReasonKind::TimeOffset,
            Kind::LeverArm => ReasonKind::LeverArm,
            Kind::Mounting => ReasonKind::Mounting,
            Kind::Length | Kind::Turn => ReasonKind::Scale,
        },
        axis,
        amount: found.value,
        trusted: Some([-2.0 * found.trusted_spread, 2.0 * found.trusted_spread]),
        unit: match found.unit {
            CalibrationUnit::Second => Unit::Second,
            CalibrationUnit::Metre => Unit::Metre,
            CalibrationUnit::Radian => Unit::Radian,
            CalibrationUnit::Factor => Unit::One,
        },
        strength: -found.chance.max(1e-12).log10() / 2.0,
        peak: None,
        sentence: found.sentence(stretch.named),
        poses: stretch.poses.clone(),
    }))
}
