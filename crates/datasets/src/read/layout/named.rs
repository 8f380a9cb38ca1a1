//! Layouts from the names of columns.

use super::{Layout, Order, Rotation, Stamp};
use crate::read::columns::{Name, Role, length_unit, stamp_unit};
use crate::read::table::Separator;
use crate::{Format, ReadOption, Remark, RemarkKind, StampUnit};

impl Layout {
    /// The layout that named columns make; what is missing otherwise.
    pub(super) fn from_roles(
        roles: &[(Role, usize)],
        names: &[Name],
        separator: Separator,
        width: usize,
    ) -> Result<Self, String> {
        let find = |role: Role| {
            roles
                .iter()
                .find(|(known, _)| *known == role)
                .map(|(_, column)| *column)
        };
        let all = |make: fn(usize) -> Role, count: usize| {
            (0..count)
                .map(|index| find(make(index)))
                .collect::<Option<Vec<usize>>>()
        };
        let unit = |column: usize| names.get(column).and_then(|name| name.unit.as_deref());
        let planar = find(Role::Position(2)).is_none();
        let yaw = yaw_alone(roles, names).filter(|_| planar);
        let position = match (all(Role::Position, 3), all(Role::Position, 2)) {
            (Some(position), _) => position,
            (None, Some(position)) if yaw.is_some() => position,
            _ => return Err("no columns for the position x, y, z".to_owned()),
        };
        let metres = |column: &usize| unit(*column).and_then(length_unit).unwrap_or(1.0);
        let lengths: Vec<f64> = position.iter().map(metres).collect();
        if lengths.iter().any(|length| *length != lengths[0]) {
            return Err("positions in several units".to_owned());
        }
        let (quaternion, matrix, angles, vector) = (
            all(Role::Quaternion, 4),
            all(Role::Matrix, 9),
            all(Role::Angle, 3),
            all(Role::Vector, 3),
        );
        let degrees = |column: &usize| {
            let unit = unit(*column)?;
            if unit.starts_with("deg") || unit == "\u{b0}" {
                Some(true)
            } else if unit.starts_with("rad") {
                Some(false)
            } else {
                None
            }
        };
        let rotation = if let Some(yaw) = yaw {
            Rotation::Yaw([yaw], degrees(&yaw), false)
        } else if let Some(columns) = quaternion {
            Rotation::Quaternion([columns[0], columns[1], columns[2], columns[3]])
        } else if let Some(columns) = matrix {
            Rotation::Matrix(std::array::from_fn(|index| columns[index]))
        } else if let Some(columns) = angles {
            let mut told: Vec<bool> = columns.iter().filter_map(degrees).collect();
            told.dedup();
            if told.len() > 1 {
                return Err("angles in several units".to_owned());
            }
            Rotation::Angles([columns[0], columns[1], columns[2]], told.pop())
        } else if let Some(columns) = vector {
            Rotation::Vector([columns[0], columns[1], columns[2]])
        } else {
            return Err(
                "positions without a rotation (a quaternion, roll, pitch and yaw, or a matrix)"
                    .to_owned(),
            );
        };
        let part = |unit| Some((find(Role::Part(unit))?, unit));
        let part = StampUnit::ALL.into_iter().rev().find_map(part);
        let stamp = match (find(Role::Stamp), find(Role::Seconds), part) {
            (Some(column), None, _) | (Some(column), _, None) => {
                Stamp::Column(column, unit(column).and_then(stamp_unit))
            }
            (_, Some(seconds), Some((part, unit))) => Stamp::Pair(seconds, part, unit),
            (None, Some(seconds), None) => Stamp::Column(seconds, Some(StampUnit::Seconds)),
            (None, None, Some((part, unit))) => Stamp::Column(part, Some(unit)),
            (None, None, None) => Stamp::None,
        };
        let mut used: Vec<usize> = position.clone();
        used.extend(rotation.columns());
        match stamp {
            Stamp::Column(column, _) | Stamp::Index(column) => used.push(column),
            Stamp::Pair(a, b, _) => used.extend([a, b]),
            Stamp::None => {}
        }
        let columns = used.iter().max().map_or(0, |column| column + 1);
        if columns > width && width > 0 {
            return Err(format!(
                "{width} fields a line where the header names column {columns}"
            ));
        }
        let tum = separator == Separator::Blanks
            && matches!(stamp, Stamp::Column(0, _))
            && position == [1, 2, 3]
            && matches!(rotation, Rotation::Quaternion(_));
        let euroc = separator == Separator::Character(',')
            && names.iter().any(|name| name.plain == "q_rs_w");
        Ok(Self {
            format: if euroc {
                Format::Euroc
            } else if tum {
                Format::Tum
            } else {
                Format::Csv
            },
            separator,
            columns,
            more: true,
            stamp,
            position: [
                position[0],
                position[1],
                *position.get(2).unwrap_or(&position[1]),
            ],
            rotation,
            order: Order::Header,
            metres: lengths[0],
            shared: false,
            last_row: None,
            names: names.iter().map(|name| name.text.clone()).collect(),
            header_line: None,
            remarks: yaw.map(|_| plane()).into_iter().collect(),
        })
    }

    /// Says which columns a header named, where that is not the habit of the format.
    pub(super) fn name_columns(&mut self, names: &[Name]) {
        let name = |column: usize| names.get(column).map_or("?", |name| name.text.as_str());
        let rotation: Vec<&str> = match &self.rotation {
            Rotation::Quaternion(columns) => columns.iter().map(|column| name(*column)).collect(),
            Rotation::Matrix(columns) => vec![name(columns[0]), "...", name(columns[8])],
            Rotation::Angles(columns, _)
            | Rotation::Heading(columns, _)
            | Rotation::Vector(columns) => columns.iter().map(|column| name(*column)).collect(),
            Rotation::Yaw([column], ..) => vec![name(*column)],
        };
        if let Rotation::Angles(columns, _) = self.rotation
            && names
                .get(columns[2])
                .is_some_and(|name| !name.plain.contains("yaw"))
        {
            let text = format!(
                "the column `{}` is taken as yaw, counter-clockwise about the third axis",
                name(columns[2])
            );
            self.remarks
                .push(Remark::new(RemarkKind::Angles, text).option(ReadOption::Columns));
        }
        if self.metres != 1.0 {
            let unit = names
                .get(self.position[0])
                .and_then(|name| name.unit.as_deref());
            let text = format!(
                "positions are in {}, as the header says: read as metres",
                unit.unwrap_or("?")
            );
            self.remarks
                .push(Remark::new(RemarkKind::LengthUnit, text).option(ReadOption::Unit));
        }
        if self.format != Format::Csv {
            return;
        }
        let stamp = match self.stamp {
            Stamp::None => "no stamp".to_owned(),
            Stamp::Column(column, _) | Stamp::Index(column) => {
                format!("stamp from `{}`", name(column))
            }
            Stamp::Pair(a, b, _) => format!("stamp from `{}` and `{}`", name(a), name(b)),
        };
        let position: Vec<&str> = self.axes().iter().map(|column| name(*column)).collect();
        let text = format!(
            "columns by the header: {stamp}, position from `{}`, rotation from `{}`",
            position.join(" "),
            rotation.join(" ")
        );
        self.remarks
            .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns));
    }
}

/// Names of what may be a height or a depth.
const HEIGHTS: [&str; 8] = ["z", "alt", "hgt", "elev", "depth", "up", "down", "h"];

fn plane() -> Remark {
    let text = "a body in the plane: z, roll and pitch are zero";
    Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns)
}

/// The column of the yaw where it is the only angle and no other rotation is there; `theta` and `phi` are one then.
fn yaw_alone(roles: &[(Role, usize)], names: &[Name]) -> Option<usize> {
    let mut rotations = roles
        .iter()
        .filter(|(role, _)| !role.is_time() && !matches!(role, Role::Position(_)));
    let (Some((Role::Angle(axis), column)), None) = (rotations.next(), rotations.next()) else {
        return None;
    };
    // A height under a name that is not known would be lost.
    let is_height = |name: &Name| {
        let last = name.plain.rsplit('_').next();
        last.is_some_and(|last| HEIGHTS.contains(&last))
    };
    if names.iter().any(is_height) {
        return None;
    }
    let named = |words: &[&str]| {
        let name = names.get(*column).map(|name| name.plain.as_str());
        name.is_some_and(|name| words.iter().any(|word| name.ends_with(word)))
    };
    (*axis == 2 || named(&["theta", "phi"])).then_some(*column)
}
