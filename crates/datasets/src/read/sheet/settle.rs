//! What a layout leaves open, settled by the numbers: the unit of stamps and of angles, the order of quaternions.

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use dose3_lie::Rotation as LieRotation;

use super::arrangement;
use super::sample::Sample;
use crate::error::Place;
use crate::read::collect::{Collector, euler_rotation};
use crate::read::columns::is_heading;
use crate::read::guess::{self, DECIDED, Stamps};
use crate::read::layout::{Layout, Order, Rotation, Stamp};
use crate::read::order;
use crate::{Error, Format, LoadOptions, ReadOption, Remark, RemarkKind, StampUnit};

/// Two turns: larger angles are degrees.
const LARGEST_RADIANS: f64 = 4.0 * std::f64::consts::PI;

/// Settles what the layout leaves open, from the numbers.
///
/// # Errors
/// Numbers that say that they are something else.
pub(crate) fn settle(
    path: &Path,
    layout: &mut Layout,
    sample: &Sample,
    options: &LoadOptions,
    collector: &mut Collector<'_>,
) -> Result<Clock, Error> {
    let Some(clock) = stamp_unit(layout, sample, options, collector) else {
        let found =
            "numbers of the size of dates in steps of 100 ns, as Windows and .NET count them";
        let hint = "multiply them by 100 and take off the nanoseconds up to 1970, or say the rate";
        let fault = Error::input(path, Place::File, "stamps since 1970", found, hint);
        return Err(fault.option(ReadOption::Rate));
    };
    decide_rotation(path, layout, sample, collector)?;
    collector.report.remarks.append(&mut layout.remarks);
    Ok(clock)
}

/// What a stamp is in this file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Clock {
    Unit(StampUnit),
    /// Frame numbers, each a step of the rate.
    Index,
    /// None, or none that is used.
    Rows,
}

/// What the stamps are; `None` where they are of a kind that is not read.
fn stamp_unit(
    layout: &mut Layout,
    sample: &Sample,
    options: &LoadOptions,
    collector: &mut Collector<'_>,
) -> Option<Clock> {
    let Stamp::Column(column, told) = layout.stamp else {
        return Some(match layout.stamp {
            Stamp::Index(_) => Clock::Index,
            Stamp::Pair(..) if options.rate.is_none() => Clock::Unit(StampUnit::Nanoseconds),
            _ => Clock::Rows,
        });
    };
    let habit = match layout.format {
        Format::Euroc => StampUnit::Nanoseconds,
        _ => StampUnit::Seconds,
    };
    let found = guess::stamps(&sample.stamps, sample.whole);
    if options.rate.is_some() {
        return Some(if found == Stamps::Index {
            layout.stamp = Stamp::Index(column);
            Clock::Index
        } else {
            Clock::Rows
        });
    }
    if sample.dates {
        let text = "stamps are dates; those without a time zone are taken as UTC";
        let remark = Remark::new(RemarkKind::StampUnit, text);
        collector.report.remarks.push(remark);
        return Some(Clock::Unit(StampUnit::Seconds));
    }
    if let Some(unit) = options.stamp_unit {
        return Some(Clock::Unit(unit));
    }
    let mut remark = |kind, text: String, option| {
        collector
            .report
            .remarks
            .push(Remark::new(kind, text).option(option));
    };
    if let Some(unit) = told {
        if unit != habit {
            remark(
                RemarkKind::StampUnit,
                format!("stamps are {unit}, as the header says"),
                ReadOption::StampUnit,
            );
        }
        return Some(Clock::Unit(unit));
    }
    let unit = match found {
        Stamps::Ticks => return None,
        // The header of EuRoC stands for nanoseconds, and clocks that count from the start of a machine are no dates.
        Stamps::Unit(unit, _)
            if layout.format == Format::Euroc
                && layout.order == Order::Header
                && unit != habit
                && guess::makes_a_rate(&sample.stamps, habit) =>
        {
            remark(
                RemarkKind::StampUnit,
                format!(
                    "stamps are taken as {habit}, as EuRoC has them; as {unit} they would be dates"
                ),
                ReadOption::StampUnit,
            );
            habit
        }
        Stamps::Unit(unit, reason) => {
            if unit != habit {
                remark(
                    RemarkKind::StampUnit,
                    format!("stamps are taken as {unit}: {reason}"),
                    ReadOption::StampUnit,
                );
            }
            unit
        }
        Stamps::Index => {
            let text = "the stamps look like an index (0, 1, 2, ...): taken as seconds, which makes 1 Hz; say the rate";
            remark(
                RemarkKind::StampsAreAnIndex,
                text.to_owned(),
                ReadOption::Rate,
            );
            StampUnit::Seconds
        }
        Stamps::Seconds => {
            if habit != StampUnit::Seconds {
                let text = "stamps are taken as seconds: their size is not that of nanoseconds";
                remark(
                    RemarkKind::StampUnit,
                    text.to_owned(),
                    ReadOption::StampUnit,
                );
            }
            StampUnit::Seconds
        }
    };
    Some(Clock::Unit(unit))
}

/// Lets the data decide what the file leaves open about its rotations.
fn decide_rotation(
    path: &Path,
    layout: &mut Layout,
    sample: &Sample,
    collector: &mut Collector<'_>,
) -> Result<(), Error> {
    match layout.rotation {
        Rotation::Quaternion(columns) if layout.order != Order::Given => {
            let (columns, remark) =
                order::quaternion(layout, columns, &sample.positions, &sample.rotations);
            layout.rotation = Rotation::Quaternion(columns);
            collector.report.remarks.extend(remark);
        }
        Rotation::Angles(columns, told) => {
            if layout.order == Order::Habit
                && let Some(found) = arrangement::other(sample)
            {
                let wanted = "seven numbers: a stamp, position, roll, pitch, yaw";
                let found = format!("numbers that make an even motion only as a stamp, {found}");
                let hint = "say which columns hold the pose";
                let fault = Error::input(path, Place::File, wanted, found, hint);
                return Err(fault.option(ReadOption::Columns));
            }
            let (degrees, clockwise) = decide_angles(layout, columns[2], told, sample, collector);
            layout.rotation = match clockwise {
                true => Rotation::Heading(columns, degrees),
                false => Rotation::Angles(columns, Some(degrees)),
            };
        }
        Rotation::Yaw(column, told, _) => {
            let (degrees, clockwise) = decide_angles(layout, column[0], told, sample, collector);
            layout.rotation = Rotation::Yaw(column, Some(degrees), clockwise);
        }
        _ => {}
    }
    Ok(())
}

/// Whether angles are degrees, and whether the third of them, in this column, is clockwise from north; says so.
fn decide_angles(
    layout: &mut Layout,
    column: usize,
    told: Option<bool>,
    sample: &Sample,
    collector: &mut Collector<'_>,
) -> (bool, bool) {
    let (degrees, remark) = angle_unit(sample, told, euler_rotation);
    match clockwise(layout, column, (told, degrees), sample) {
        Some((degrees, remarks)) => {
            layout
                .remarks
                .retain(|remark| remark.kind != RemarkKind::Angles);
            layout.remarks.extend(remarks);
            (degrees, true)
        }
        None => {
            collector.report.remarks.push(remark);
            (degrees, false)
        }
    }
}

/// Where the third angle is called a heading and the body moves far more evenly if it is clockwise from north: whether
/// the angles are then degrees, and the remarks. `degrees`: as said, and as found for a yaw.
fn clockwise(
    layout: &Layout,
    column: usize,
    (told, degrees): (Option<bool>, bool),
    sample: &Sample,
) -> Option<(bool, [Remark; 2])> {
    let name = layout.names.get(column).filter(|name| is_heading(name))?;
    if layout.order == Order::Given {
        // Who names the column for yaw has said what it is.
        return None;
    }
    let yaw = turned(sample, degrees, euler_rotation);
    let (degrees, _) = angle_unit(sample, told, heading_rotation);
    let heading = turned(sample, degrees, heading_rotation);
    let ratio = guess::preference(&sample.positions, &yaw, &heading);
    if ratio * DECIDED >= 1.0 {
        return None;
    }
    let unit = if degrees { "degrees" } else { "radians" };
    let words = [
        format!("the angles are taken as {unit}"),
        format!(
            "the column `{name}` is taken as clockwise from north, positions as east, north, up (so the body moves {:.0} times more evenly along its own axes)",
            1.0 / ratio
        ),
    ];
    let remark = |words| Remark::new(RemarkKind::Angles, words).option(ReadOption::Columns);
    Some((degrees, words.map(remark)))
}

/// The rotation of a body with its nose up by `pitch` that heads `heading` clockwise from north, where x is east: radians.
pub(super) fn heading_rotation(roll: f64, pitch: f64, heading: f64) -> LieRotation {
    euler_rotation(roll, -pitch, FRAC_PI_2 - heading)
}

/// Makes a rotation of three angles in radians.
pub(super) type Turn = fn(f64, f64, f64) -> LieRotation;

fn turned(sample: &Sample, degrees: bool, turn: Turn) -> Vec<LieRotation> {
    let factor = if degrees { PI / 180.0 } else { 1.0 };
    let angles = sample.rotations.iter();
    angles
        .map(|[r, p, y, _]| turn(r * factor, p * factor, y * factor))
        .collect()
}

/// Whether angles are degrees, and the remark that says why.
fn angle_unit(sample: &Sample, told: Option<bool>, turn: Turn) -> (bool, Remark) {
    let largest = sample
        .rotations
        .iter()
        .flat_map(|row| &row[..3])
        .fold(0.0_f64, |a, b| a.max(b.abs()));
    let (degrees, why) = match told {
        Some(degrees) => (degrees, "as the header says".to_owned()),
        None if largest > LARGEST_RADIANS => (true, format!("they reach {largest:.1}")),
        None => {
            let [radians, degrees] = [false, true].map(|degrees| turned(sample, degrees, turn));
            let ratio = guess::preference(&sample.positions, &radians, &degrees);
            if ratio * DECIDED < 1.0 {
                (
                    true,
                    format!(
                        "so the body moves {:.0} times more evenly along its own axes than with radians",
                        1.0 / ratio
                    ),
                )
            } else if ratio > DECIDED {
                (
                    false,
                    format!(
                        "so the body moves {ratio:.0} times more evenly along its own axes than with degrees"
                    ),
                )
            } else {
                (false, "neither header nor motion tells".to_owned())
            }
        }
    };
    let unit = if degrees { "degrees" } else { "radians" };
    let text = format!("the angles are taken as {unit} ({why}), as Rz(yaw) Ry(pitch) Rx(roll)");
    (
        degrees,
        Remark::new(RemarkKind::Angles, text).option(ReadOption::Columns),
    )
}
