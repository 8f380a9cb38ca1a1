//! The pose of one row.

use std::path::Path;

use dose3_lie::{Matrix, Pose, Vector, so3};

use super::plain::Numbers;
use super::settle::{Clock, Turn, heading_rotation};
use crate::error::Place;
use crate::read::collect::{Collector, euler_rotation, pose};
use crate::read::layout::{Layout, Rotation, Stamp};
use crate::read::numbers::float;
use crate::read::table::{LARGEST_COORDINATE, Row, check_coordinate, is_no_value};
use crate::{Error, Format, LostKind, ReadOption, StampUnit};

/// Largest deviation of the last row of a 4x4 matrix from (0, 0, 0, 1).
const LAST_ROW_TOLERANCE: f64 = 1e-6;
/// Below this norm a quaternion or a matrix was never filled in.
const ZERO: f64 = 1e-6;

/// When a row was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Time {
    /// It does not say.
    Missing,
    /// Nanoseconds.
    At(i64),
    /// At the place of its frame number.
    Index(usize),
    /// After the row before.
    Row,
}

/// The pose of a row of plain numbers; `None` where anything about it is unusual, which [`parse_row`] then says.
pub(super) fn plain_row(
    path: &Path,
    numbers: &Numbers<'_>,
    layout: &Layout,
    clock: Clock,
    collector: &mut Collector<'_>,
) -> Option<(Time, Pose)> {
    let count = numbers.len();
    if count < layout.columns || count > layout.columns && !layout.more {
        return None;
    }
    let time = match (clock, layout.stamp) {
        (Clock::Rows, _) | (_, Stamp::None) | (Clock::Index, Stamp::Pair(..)) => Time::Row,
        (Clock::Index, Stamp::Index(column) | Stamp::Column(column, _)) => {
            Time::Index(numbers.get(column)?.max(0.0) as usize)
        }
        (Clock::Unit(_), Stamp::Pair(seconds, part, unit)) => {
            let whole = numbers.stamp(seconds, StampUnit::Seconds.shift())?;
            Time::At(whole.saturating_add(numbers.stamp(part, unit.shift())?))
        }
        (Clock::Unit(unit), Stamp::Column(column, _) | Stamp::Index(column)) => {
            Time::At(numbers.stamp(column, unit.shift())?)
        }
    };
    let mut translation = [0.0; 3];
    for (column, value) in layout.axes().iter().zip(&mut translation) {
        *value = numbers.get(*column)? * layout.metres;
        if value.abs() > LARGEST_COORDINATE {
            return None;
        }
    }
    if let Some(last) = layout.last_row {
        let [a, b, c, d] = last.map(|column| numbers.get(column));
        if !is_last_row([a?, b?, c?, d?]) {
            return None;
        }
    }
    let columns = layout.rotation.columns();
    let mut values = [0.0; 9];
    for (column, value) in columns.iter().zip(&mut values) {
        *value = numbers.get(*column)?;
    }
    if is_zero(&values, &layout.rotation) {
        return None;
    }
    // The place is for a fault, which the general way finds again with the right one.
    let rotation = rotation(path, Place::File, &values, &layout.rotation, collector).ok()?;
    Some((time, pose(rotation, translation)))
}

/// True for numbers of a quaternion or a matrix that were never filled in.
fn is_zero(values: &[f64; 9], rotation: &Rotation) -> bool {
    let may_be_zero = !matches!(rotation, Rotation::Quaternion(_) | Rotation::Matrix(_));
    !may_be_zero && values.iter().all(|value| value.abs() < ZERO)
}

/// The rotation of the numbers in its columns.
fn rotation(
    path: &Path,
    place: Place,
    values: &[f64; 9],
    kind: &Rotation,
    collector: &mut Collector<'_>,
) -> Result<dose3_lie::Rotation, Error> {
    Ok(match kind {
        Rotation::Quaternion(_) => {
            let [w, x, y, z, ..] = *values;
            collector.quaternion(place, w, x, y, z)?
        }
        Rotation::Matrix(_) => collector.rotation(path, place, &Matrix::from_row_slice(values))?,
        Rotation::Angles(_, degrees) => {
            turned(euler_rotation, [values[0], values[1], values[2]], *degrees)
        }
        Rotation::Heading(_, degrees) => {
            let angles = [values[0], values[1], values[2]];
            turned(heading_rotation, angles, Some(*degrees))
        }
        Rotation::Yaw(_, degrees, clockwise) => {
            let turn: Turn = if *clockwise {
                heading_rotation
            } else {
                euler_rotation
            };
            turned(turn, [0.0, 0.0, values[0]], *degrees)
        }
        Rotation::Vector(_) => so3::exp(&Vector::new(values[0], values[1], values[2])),
    })
}

fn turned(turn: Turn, angles: [f64; 3], degrees: Option<bool>) -> dose3_lie::Rotation {
    let factor = match degrees {
        Some(true) => std::f64::consts::PI / 180.0,
        _ => 1.0,
    };
    let [roll, pitch, yaw] = angles.map(|angle| angle * factor);
    turn(roll, pitch, yaw)
}

/// When a row was, and its pose, or how the row says that there is none.
pub(super) fn parse_row(
    path: &Path,
    row: &Row<'_, '_>,
    layout: &Layout,
    clock: Clock,
    collector: &mut Collector<'_>,
) -> Result<(Time, Result<Pose, LostKind>), Error> {
    if row.len() < layout.columns || row.len() > layout.columns && !layout.more {
        return Err(wrong_length(row, layout));
    }
    let time = match (clock, layout.stamp) {
        (Clock::Rows, _) | (_, Stamp::None) | (Clock::Index, Stamp::Pair(..)) => Time::Row,
        (Clock::Index, Stamp::Index(column) | Stamp::Column(column, _)) => {
            Time::Index(row.number(column, "the frame number")?.max(0.0) as usize)
        }
        (Clock::Unit(_), Stamp::Pair(seconds, part, unit)) => {
            let whole = row.stamp(seconds, StampUnit::Seconds)?;
            Time::At(whole.saturating_add(row.stamp(part, unit)?))
        }
        (Clock::Unit(unit), Stamp::Column(column, _) | Stamp::Index(column)) => {
            match row.stamp(column, unit) {
                Ok(stamp) => Time::At(stamp),
                Err(_) if is_no_value(row.field(column, "the stamp")?) => Time::Missing,
                Err(fault) => return Err(fault),
            }
        }
    };
    let found = read_pose(path, row, layout, collector)?;
    Ok((time, found))
}

fn wrong_length(row: &Row<'_, '_>, layout: &Layout) -> Error {
    let at_least = if layout.more { "at least " } else { "" };
    let hint = match layout.format {
        Format::Kitti => {
            "a KITTI line is the row-major 3x4 matrix of a pose; another format can be chosen"
        }
        Format::Tum => {
            "a TUM line is `timestamp tx ty tz qx qy qz qw`; another format can be chosen"
        }
        Format::Euroc => {
            "a EuRoC line is `timestamp,px,py,pz,qw,qx,qy,qz,...`; another format can be chosen"
        }
        _ => "the line is cut off or two lines ran together",
    };
    row.wrong_length(format!("{at_least}{} numbers", layout.columns), hint)
        .option(ReadOption::Format)
}

/// The pose of a row, or how the row says that there is none.
fn read_pose(
    path: &Path,
    row: &Row<'_, '_>,
    layout: &Layout,
    collector: &mut Collector<'_>,
) -> Result<Result<Pose, LostKind>, Error> {
    let names = Names(layout);
    let columns = layout.rotation.columns();
    let mut values = [0.0; 9];
    let mut lost = false;
    for (part, (column, value)) in columns.iter().zip(&mut values).enumerate() {
        match number(row, *column) {
            Some(found) => *value = found,
            None => match no_value(row, *column, &names.rotation(part)) {
                Some(fault) => return Err(fault),
                None => lost = true,
            },
        }
    }
    let mut translation = [0.0; 3];
    for (axis, (column, value)) in layout.axes().iter().zip(&mut translation).enumerate() {
        match number(row, *column) {
            Some(found) => {
                *value = found * layout.metres;
                check_coordinate(path, row.place(), *value)?;
            }
            None => match no_value(row, *column, &names.position(axis)) {
                Some(fault) => return Err(fault),
                None => lost = true,
            },
        }
    }
    if lost && collector.looks_for(LostKind::Nan) {
        return Ok(Err(LostKind::Nan));
    }
    if lost {
        let column = columns.iter().chain(layout.axes()).copied();
        for column in column {
            row.number(column, "the pose")?;
        }
    }
    if is_zero(&values, &layout.rotation) && collector.looks_for(LostKind::Zero) {
        return Ok(Err(LostKind::Zero));
    }
    if let Some(last) = layout.last_row {
        check_last_row(path, row, last)?;
    }
    let rotation = rotation(path, row.place(), &values, &layout.rotation, collector)?;
    Ok(Ok(pose(rotation, translation)))
}

/// The finite number in a column; `None` where there is something else.
pub(super) fn number(row: &Row<'_, '_>, column: usize) -> Option<f64> {
    let value = float(row.fields().get(column)?)?;
    value.is_finite().then_some(value)
}

/// The fault of a field that is neither a number nor a word for no value.
fn no_value(row: &Row<'_, '_>, column: usize, name: &str) -> Option<Error> {
    let field = row.fields().get(column)?;
    if is_no_value(field) {
        return None;
    }
    row.number(column, name).err()
}

fn check_last_row(path: &Path, row: &Row<'_, '_>, columns: [usize; 4]) -> Result<(), Error> {
    let mut found = [0.0; 4];
    for (column, value) in columns.into_iter().zip(&mut found) {
        *value = row.number(column, "the last row of the matrix")?;
    }
    if is_last_row(found) {
        return Ok(());
    }
    let [a, b, c, d] = found;
    Err(Error::input(
        path,
        row.place(),
        "0 0 0 1 as the last row of the matrix",
        format!("{a} {b} {c} {d}"),
        "is the matrix transposed?",
    ))
}

fn is_last_row(found: [f64; 4]) -> bool {
    let mut pairs = found.iter().zip([0.0, 0.0, 0.0, 1.0]);
    pairs.all(|(a, b)| (a - b).abs() <= LAST_ROW_TOLERANCE)
}

/// Names of columns for messages.
struct Names<'a>(&'a Layout);

impl Names<'_> {
    fn header(&self, column: usize) -> Option<String> {
        self.0.names.get(column).cloned()
    }

    fn position(&self, axis: usize) -> String {
        let usual = match self.0.rotation {
            Rotation::Matrix(_) => "the translation",
            _ => ["tx", "ty", "tz"][axis],
        };
        self.header(self.0.position[axis])
            .unwrap_or_else(|| usual.to_owned())
    }

    fn rotation(&self, part: usize) -> String {
        let (column, usual) = match &self.0.rotation {
            Rotation::Quaternion(columns) => (columns[part], ["qw", "qx", "qy", "qz"][part]),
            Rotation::Matrix(columns) => (columns[part], "the rotation"),
            Rotation::Angles(columns, _) | Rotation::Heading(columns, _) => {
                (columns[part], ["roll", "pitch", "yaw"][part])
            }
            Rotation::Yaw(column, ..) => (column[part], "yaw"),
            Rotation::Vector(columns) => (columns[part], "the rotation vector"),
        };
        self.header(column).unwrap_or_else(|| usual.to_owned())
    }
}
