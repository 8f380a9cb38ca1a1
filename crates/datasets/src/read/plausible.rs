//! What no pose source does: remarks on rates, speeds and attitudes of a log that could be read.

use std::f64::consts::PI;
use std::ops::Range;

use dose3_lie::Vector;

use crate::{Frame, RateSource, ReadOption, Remark, RemarkKind, Trajectory};

/// Rates of pose sources, hertz: a slow scan matcher and a fast IMU integration.
const HERTZ: std::ops::RangeInclusive<f64> = 0.2..=2000.0;
/// Typical speed beyond which the unit of time or length is wrong, m/s: an airliner flies at 250.
const FASTEST: f64 = 350.0;
/// Typical turning beyond which the unit of time or angle is wrong, rad/s: three turns a second.
const FASTEST_TURN: f64 = 6.0 * PI;
/// Typical tilt of a vehicle beyond which its angles or its frame are wrong, radians.
const STEEPEST: f64 = PI / 4.0;
/// Rotations that differ by less are the same, radians.
const SAME: f64 = 1e-9;
/// Poses that a judgement about turning needs.
const FEWEST: usize = 8;

/// Adds what looks wrong to the report.
pub(crate) fn remark(log: &mut Trajectory, stretches: &[Range<usize>]) {
    let mut remarks = Vec::new();
    if log.rate.source == RateSource::Stamps && !HERTZ.contains(&log.rate.hertz) {
        let text = format!(
            "{} Hz is no rate of a pose source: are the stamps in another unit, or an index?",
            significant(log.rate.hertz)
        );
        remarks.push(Remark::new(RemarkKind::ImplausibleRate, text).option(ReadOption::StampUnit));
    }
    let (mut speeds, mut turns, mut moved, mut turned) = (Vec::new(), Vec::new(), 0.0, 0.0_f64);
    for range in stretches {
        for index in range.start + 1..range.end {
            let seconds = (log.stamps[index] - log.stamps[index - 1]) as f64 * 1e-9;
            let (before, after) = (&log.poses[index - 1], &log.poses[index]);
            let step = (after.translation - before.translation).norm();
            moved += step;
            speeds.push(step / seconds);
            // The sine of half the angle, from the Frobenius norm of the difference.
            let half = (after.rotation.matrix() - before.rotation.matrix()).norm() / 8.0_f64.sqrt();
            let angle = 2.0 * half.min(1.0).asin();
            turned = turned.max(angle);
            turns.push(angle / seconds);
        }
    }
    let (speed, turn) = (median(&mut speeds), median(&mut turns));
    let timed = log.rate.source != RateSource::Unknown;
    if timed && speed > FASTEST {
        let text = format!(
            "the typical speed is {} m/s: are positions or stamps in another unit?",
            significant(speed)
        );
        let option = if HERTZ.contains(&log.rate.hertz) {
            ReadOption::Unit
        } else {
            ReadOption::StampUnit
        };
        remarks.push(Remark::new(RemarkKind::ImplausibleSpeed, text).option(option));
    }
    if timed && turn > FASTEST_TURN {
        let text = format!(
            "the typical turning is {} rad/s: are angles in degrees, quaternions in another order, or stamps in another unit?",
            significant(turn)
        );
        remarks.push(Remark::new(RemarkKind::ImplausibleTurning, text).option(ReadOption::Columns));
    }
    if log.len() >= FEWEST && moved > 0.0 && turned < SAME {
        let text =
            "the orientation never changes while the position does: positions without orientation?";
        remarks.push(Remark::new(RemarkKind::ConstantOrientation, text));
    }
    if let Some(tilt) = tilt(log)
        && tilt > STEEPEST
    {
        let text = format!(
            "the vehicle is typically tilted by {:.0} degrees: are its angles in degrees, not radians, or is its frame another one?",
            tilt.to_degrees()
        );
        remarks.push(Remark::new(RemarkKind::ImplausibleAttitude, text).option(ReadOption::Frame));
    }
    log.report.remarks.append(&mut remarks);
}

/// Typical angle between the up axes of a vehicle and of its world, where both are known.
fn tilt(log: &Trajectory) -> Option<f64> {
    let up = match log.frame {
        Frame::BodyFrd | Frame::BodyFlu => Vector::z(),
        _ => return None,
    };
    let mut tilts: Vec<f64> = log
        .poses
        .iter()
        .map(|pose| angle_between(&(pose.rotation * up), &up))
        .collect();
    Some(median(&mut tilts))
}

fn angle_between(a: &Vector, b: &Vector) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Three digits or so.
fn significant(value: f64) -> String {
    if value >= 100.0 {
        format!("{value:.0}")
    } else if value >= 1.0 {
        format!("{value:.1}")
    } else {
        format!("{value:.2e}")
    }
}
