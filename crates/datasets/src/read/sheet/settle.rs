//! What a layout leaves open, settled by the numbers: the unit of stamps and of angles, the order of quaternions.

use dose3_lie::Rotation as LieRotation;

use super::sample::Sample;
use crate::read::collect::{Collector, euler_rotation};
use crate::read::guess::{self, DECIDED, Stamps};
use crate::read::layout::{Layout, Order, Rotation, Stamp};
use crate::read::order;
use crate::{Format, LoadOptions, ReadOption, Remark, RemarkKind, StampUnit};

/// Two turns: larger angles are degrees.
const LARGEST_RADIANS: f64 = 4.0 * std::f64::consts::PI;

/// Settles what the layout leaves open, from the numbers.
pub(crate) fn settle(
    layout: &mut Layout,
    sample: &Sample,
    options: &LoadOptions,
    collector: &mut Collector<'_>,
) -> Clock {
    let clock = stamp_unit(layout, sample, options, collector);
    decide_rotation(layout, sample, collector);
    collector.report.remarks.append(&mut layout.remarks);
    clock
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

fn stamp_unit(
    layout: &mut Layout,
    sample: &Sample,
    options: &LoadOptions,
    collector: &mut Collector<'_>,
) -> Clock {
    let Stamp::Column(column, told) = layout.stamp else {
        return match layout.stamp {
            Stamp::Index(_) => Clock::Index,
            Stamp::Pair(..) if options.rate.is_none() => Clock::Unit(StampUnit::Nanoseconds),
            _ => Clock::Rows,
        };
    };
    let habit = match layout.format {
        Format::Euroc => StampUnit::Nanoseconds,
        _ => StampUnit::Seconds,
    };
    let found = guess::stamps(&sample.stamps, sample.whole);
    if options.rate.is_some() {
        return if found == Stamps::Index {
            layout.stamp = Stamp::Index(column);
            Clock::Index
        } else {
            Clock::Rows
        };
    }
    if sample.dates {
        let text = "stamps are dates; those without a time zone are taken as UTC";
        let remark = Remark::new(RemarkKind::StampUnit, text);
        collector.report.remarks.push(remark);
        return Clock::Unit(StampUnit::Seconds);
    }
    if let Some(unit) = options.stamp_unit {
        return Clock::Unit(unit);
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
        return Clock::Unit(unit);
    }
    match found {
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
            Clock::Unit(habit)
        }
        Stamps::Unit(unit, reason) => {
            if unit != habit {
                remark(
                    RemarkKind::StampUnit,
                    format!("stamps are taken as {unit}: {reason}"),
                    ReadOption::StampUnit,
                );
            }
            Clock::Unit(unit)
        }
        Stamps::Index => {
            let text = "the stamps look like an index (0, 1, 2, ...): taken as seconds, which makes 1 Hz; say the rate";
            remark(
                RemarkKind::StampsAreAnIndex,
                text.to_owned(),
                ReadOption::Rate,
            );
            Clock::Unit(StampUnit::Seconds)
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
            Clock::Unit(StampUnit::Seconds)
        }
    }
}

/// Lets the data decide what the file leaves open about its rotations.
fn decide_rotation(layout: &mut Layout, sample: &Sample, collector: &mut Collector<'_>) {
    match layout.rotation {
        Rotation::Quaternion(columns) if layout.order != Order::Given => {
            let (columns, remark) =
                order::quaternion(layout, columns, &sample.positions, &sample.rotations);
            layout.rotation = Rotation::Quaternion(columns);
            collector.report.remarks.extend(remark);
        }
        Rotation::Angles(columns, degrees) => {
            let (degrees, remark) = angle_unit(sample, degrees);
            layout.rotation = Rotation::Angles(columns, Some(degrees));
            collector.report.remarks.push(remark);
        }
        _ => {}
    }
}

/// Whether angles are degrees, and the remark that says why.
fn angle_unit(sample: &Sample, told: Option<bool>) -> (bool, Remark) {
    let rotations = |factor: f64| -> Vec<LieRotation> {
        let angles = sample.rotations.iter();
        angles
            .map(|[r, p, y, _]| euler_rotation(r * factor, p * factor, y * factor))
            .collect()
    };
    let largest = sample
        .rotations
        .iter()
        .flat_map(|row| &row[..3])
        .fold(0.0_f64, |a, b| a.max(b.abs()));
    let (degrees, why) = match told {
        Some(degrees) => (degrees, "as the header says".to_owned()),
        None if largest > LARGEST_RADIANS => (true, format!("they reach {largest:.1}")),
        None => {
            let degrees = rotations(std::f64::consts::PI / 180.0);
            let ratio = guess::preference(&sample.positions, &rotations(1.0), &degrees);
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
    let text =
        format!("roll, pitch and yaw are taken as {unit} ({why}), as Rz(yaw) Ry(pitch) Rx(roll)");
    (
        degrees,
        Remark::new(RemarkKind::Angles, text).option(ReadOption::Columns),
    )
}
