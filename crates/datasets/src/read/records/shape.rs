//! Where records hold stamp, position and rotation.

use super::{Cell, List, Part};
use crate::read::columns::{Name, Role, by_header, is_heading, stamp_unit};
use crate::read::layout::choose;
use crate::{LoadOptions, StampUnit};

/// Records looked at for one with a pose.
const SAMPLE: usize = 40;
/// Positions of objects in the camera's frame, in the data sets of BOP, millimetres.
const BOP: &str = "camtm2c";
/// Deviation from 1 of the square of a quaternion's norm.
const UNIT_NORM: f64 = 0.04;

/// One column of the table.
#[derive(Debug, Clone)]
pub(super) struct Column {
    /// Its name in the header.
    pub header: String,
    /// The part of a record that it is of.
    pub name: String,
    /// Its place there.
    pub cell: usize,
}

/// How records become rows.
#[derive(Debug)]
pub(super) struct Shape {
    /// Stamp first, where there is one that is no pair.
    pub columns: Vec<Column>,
    /// Names of whole seconds and of what is more, in this unit.
    pub pair: Option<([String; 2], StampUnit)>,
    /// The numbers under which the records stand are stamps.
    pub keys: bool,
    header: bool,
    unit: Option<StampUnit>,
    /// What was taken, in words.
    pub words: String,
}

/// Why records have no shape.
pub(super) enum NoShape {
    /// They hold no pose; their names.
    Names(String),
    /// They hold several; says which, and what to do.
    Bodies(String, &'static str),
}

impl Shape {
    /// The shape of the first records.
    pub fn of(list: &List<'_>, options: &LoadOptions) -> Result<Self, NoShape> {
        // Who names the list has chosen.
        let chosen = match options.topics.contains(&list.name) {
            true => &[][..],
            false => &options.topics,
        };
        let mut names = None;
        for index in 0..list.length.min(SAMPLE) {
            let parts = (list.record)(index);
            let found = match options.columns {
                Some(_) => Some(Self::all(&parts)),
                None => Self::find(&parts, list.stamps.is_some(), chosen)?,
            };
            if let Some(shape) = found {
                return Ok(shape);
            }
            names.get_or_insert_with(|| {
                let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
                names.join(", ")
            });
        }
        Err(NoShape::Names(names.unwrap_or_default()))
    }

    /// Every number as a column under its own name.
    fn all(parts: &[Part<'_>]) -> Self {
        let columns = parts.iter().flat_map(|part| {
            let single = part.cells.len() == 1;
            (0..part.cells.len()).map(move |cell| Column {
                header: match single {
                    true => part.name.clone(),
                    false => format!("{}.{cell}", part.name),
                },
                name: part.name.clone(),
                cell,
            })
        });
        Self {
            columns: columns.collect(),
            pair: None,
            keys: false,
            header: true,
            unit: None,
            words: String::new(),
        }
    }

    /// `chosen` are the names of the body that is meant, where one is said.
    fn find(parts: &[Part<'_>], keys: bool, chosen: &[String]) -> Result<Option<Self>, NoShape> {
        let scalars: Vec<&Part<'_>> = parts.iter().filter(|part| part.cells.len() == 1).collect();
        let names: Vec<Name> = scalars.iter().map(|part| Name::new(&part.name)).collect();
        let several = |(words, hint)| NoShape::Bodies(words, hint);
        let body = body(parts, chosen).map_err(several)?;
        let topic = match body {
            Some(_) => None,
            None => choose(&names, chosen).map_err(several)?,
        };
        if body.is_none() && topic.is_none() && !chosen.is_empty() {
            return Ok(None);
        }
        let mut roles = topic.map_or_else(|| by_header(&names), |topic| topic.roles);
        if body.is_some() {
            roles.retain(|(role, _)| role.is_time());
        }
        let parts: Vec<&Part<'_>> = parts
            .iter()
            .filter(|part| body.is_none_or(|body| above(part) == body))
            .collect();
        Ok(Self::of_roles(&parts, &scalars, &names, &roles, keys))
    }

    /// The shape of parts, of which those of one number have roles by their names.
    fn of_roles(
        parts: &[&Part<'_>],
        scalars: &[&Part<'_>],
        names: &[Name],
        roles: &[(Role, usize)],
        keys: bool,
    ) -> Option<Self> {
        let scalar = |role: Role| {
            let (_, at) = roles.iter().find(|(known, _)| *known == role)?;
            Some((scalars[*at].name.clone(), names[*at].unit.clone()))
        };
        let scalar_columns = |make: fn(usize) -> Role, headers: &[&str]| {
            let columns = headers.iter().enumerate().map(|(index, header)| {
                let (name, unit) = scalar(make(index))?;
                let header = match *header {
                    "yaw" if is_heading(&name) => "heading",
                    header => header,
                };
                Some(Column {
                    header: match unit {
                        Some(unit) => format!("{header} [{unit}]"),
                        None => header.to_owned(),
                    },
                    name,
                    cell: 0,
                })
            });
            columns.collect::<Option<Vec<Column>>>()
        };
        let pair = scalar(Role::Seconds).and_then(|(seconds, _)| {
            let part = |unit| Some((scalar(Role::Part(unit))?.0, unit));
            let (part, unit) = StampUnit::ALL.into_iter().rev().find_map(part)?;
            Some(([seconds, part], unit))
        });
        let stamp = scalar(Role::Stamp)
            .or_else(|| scalar(Role::Seconds))
            .filter(|_| pair.is_none());
        let unit = stamp
            .as_ref()
            .and_then(|(_, unit)| stamp_unit(unit.as_deref()?));
        let mut columns: Vec<Column> = Vec::new();
        columns.extend(stamp.clone().map(|(name, _)| Column {
            header: "t".to_owned(),
            name,
            cell: 0,
        }));
        let stamps = columns.len();
        let mut header = true;
        if let Some(part) = whole_pose(parts) {
            header = false;
            columns.extend(cells(part, part.cells.len(), &[]));
        } else {
            let position = scalar_columns(Role::Position, &["x", "y", "z"]).or_else(|| {
                let part = parts.iter().find(|part| is_position(part))?;
                let names = match key(part) == BOP {
                    true => ["x [mm]", "y [mm]", "z [mm]"],
                    false => ["x", "y", "z"],
                };
                Some(cells(part, 3, &names))
            })?;
            columns.extend(position);
            let known = scalar_columns(Role::Quaternion, &QUATERNION)
                .or_else(|| scalar_columns(Role::Angle, &ANGLES))
                .or_else(|| scalar_columns(Role::Vector, &VECTOR))
                .or_else(|| scalar_columns(Role::Matrix, &MATRIX));
            let rotation = match known {
                Some(columns) => columns,
                None => {
                    let nuscenes = parts.iter().any(|part| part.name == "token");
                    let (columns, named) =
                        parts.iter().find_map(|part| rotation(part, nuscenes))?;
                    header = named;
                    columns
                }
            };
            columns.extend(rotation);
        }
        let mut taken: Vec<&str> = columns[stamps..]
            .iter()
            .map(|column| column.name.as_str())
            .collect();
        taken.dedup();
        let stamp_name = match (&stamp, &pair) {
            (Some((name, _)), _) => format!("stamps from `{name}`"),
            (None, Some(([a, b], _))) => format!("stamps from `{a}` and `{b}`"),
            (None, None) if keys => "stamps from the numbers of the records".to_owned(),
            (None, None) => "no stamps".to_owned(),
        };
        let words = match taken[..] {
            [""] => format!("poses from lists of {} numbers", columns.len()),
            _ => format!("{stamp_name}, poses from `{}`", taken.join("`, `")),
        };
        Some(Self {
            columns,
            keys: keys && stamp.is_none() && pair.is_none(),
            pair,
            header,
            unit,
            words,
        })
    }

    /// Whether the first line of the table names its columns.
    pub fn has_header(&self) -> bool {
        self.header
    }

    /// The unit of the stamps, where their name says it.
    pub fn stamp_unit(&self) -> Option<StampUnit> {
        self.unit
    }
}

const QUATERNION: [&str; 4] = ["qw", "qx", "qy", "qz"];
const ANGLES: [&str; 3] = ["roll", "pitch", "yaw"];
const VECTOR: [&str; 3] = ["rotvec_x", "rotvec_y", "rotvec_z"];
const MATRIX: [&str; 9] = [
    "r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33",
];

/// What stands above the last of the names of a part.
fn above<'p>(part: &'p Part<'_>) -> &'p str {
    part.name.rsplit_once('.').map_or("", |(above, _)| above)
}

/// The body whose parts lie side by side below one name: the only one, the chosen one, or that without a name.
///
/// # Errors
/// Several of which none is chosen, and what to do.
fn body<'p>(
    parts: &'p [Part<'_>],
    chosen: &[String],
) -> Result<Option<&'p str>, (String, &'static str)> {
    let mut names: Vec<&str> = parts.iter().map(above).collect();
    names.sort_unstable();
    names.dedup();
    names.retain(|name| {
        let own: Vec<&Part<'_>> = parts.iter().filter(|part| above(part) == *name).collect();
        let turns = |part: &&Part<'_>| rotation(part, false).is_some();
        whole_pose(&own).is_some()
            || own.iter().any(|part| is_position(part)) && own.iter().any(turns)
    });
    if chosen.is_empty() && names.contains(&"") {
        return Ok(Some(""));
    }
    if !chosen.is_empty() {
        names.retain(|name| chosen.iter().any(|chosen| chosen == name));
    }
    match names[..] {
        [] => Ok(None),
        [name] => Ok(Some(name)),
        _ => {
            let words = format!("{} of them: {}", names.len(), names.join(", "));
            Err((words, "say which one is meant"))
        }
    }
}

/// Columns of the first cells of a part.
fn cells(part: &Part<'_>, count: usize, headers: &[&str]) -> Vec<Column> {
    let column = |cell: usize| Column {
        header: headers.get(cell).map_or("", |header| header).to_owned(),
        name: part.name.clone(),
        cell,
    };
    (0..count).map(column).collect()
}

/// The last of the names, in lower case, without what joins its words and without a plural.
fn key(part: &Part<'_>) -> String {
    let last = part.name.rsplit('.').next().unwrap_or_default();
    let letters = last.chars().filter(char::is_ascii_alphanumeric);
    let key: String = letters.map(|c| c.to_ascii_lowercase()).collect();
    match key.strip_suffix('s') {
        Some(one) if one.len() > 2 && !["trans", "campos"].contains(&&*key) => one.to_owned(),
        _ => key,
    }
}

fn is_position(part: &Part<'_>) -> bool {
    part.cells.len() == 3
        && matches!(
            key(part).as_str(),
            "position"
                | "pos"
                | "p"
                | "translation"
                | "trans"
                | "t"
                | "tvec"
                | "location"
                | "xyz"
                | "campos"
                | BOP
        )
}

/// A part that is a pose on its own: a matrix, or position and quaternion.
fn whole_pose<'p, 'a>(parts: &[&'p Part<'a>]) -> Option<&'p Part<'a>> {
    let named = |part: &Part<'_>| {
        matches!(
            key(part).as_str(),
            "" | "pose"
                | "transform"
                | "transformation"
                | "transformmatrix"
                | "matrix"
                | "t"
                | "tf"
                | "c2w"
                | "camtoworld"
                | "cameratoworld"
                | "posematrix"
                | "worldpose"
                | "twb"
                | "twc"
                | "transformationmatrix"
        )
    };
    let unit = |part: &Part<'_>, at: usize| {
        let squares = part.cells[at..at + 4].iter().filter_map(Cell::number);
        (squares.map(|value| value * value).sum::<f64>() - 1.0).abs() < UNIT_NORM
    };
    let size = |part: &Part<'_>| match part.cells.len() {
        7 => named(part) && (unit(part, 3) || unit(part, 0)),
        12 | 16 => named(part),
        // With a stamp or an index in front.
        8 | 13 | 17 => part.name.is_empty(),
        _ => false,
    };
    let mut parts = parts.iter().copied();
    parts.find(|part| part.is_pose || size(part))
}

/// The columns of a rotation, and whether the names say which number is which.
fn rotation(part: &Part<'_>, w_first: bool) -> Option<(Vec<Column>, bool)> {
    let key = key(part);
    let is = |names: &[&str]| names.contains(&key.as_str());
    let w_last = ["qx", "qy", "qz", "qw"];
    match part.cells.len() {
        4 if key.contains("wxyz") => Some((cells(part, 4, &QUATERNION), true)),
        4 if key.contains("xyzw") || key == "orientation" => Some((cells(part, 4, &w_last), true)),
        4 if is(&[
            "rotation",
            "rot",
            "r",
            "q",
            "quat",
            "quaternion",
            "attitude",
        ]) =>
        {
            match w_first {
                true => Some((cells(part, 4, &QUATERNION), true)),
                false => Some((cells(part, 4, &[]), false)),
            }
        }
        9 if is(&[
            "rotation",
            "rot",
            "r",
            "orientation",
            "rotationmatrix",
            "matrix",
            "rotmat",
            "camrm2c",
        ]) =>
        {
            Some((cells(part, 9, &MATRIX), true))
        }
        3 if is(&["rotvec", "rvec", "axisangle", "rotationvector"]) => {
            Some((cells(part, 3, &VECTOR), true))
        }
        3 if is(&["rpy", "rollpitchyaw"]) => Some((cells(part, 3, &ANGLES), true)),
        _ => None,
    }
}
