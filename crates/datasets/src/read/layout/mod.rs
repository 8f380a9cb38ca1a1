//! How the lines of a text file hold poses: from the header where it names columns, else from the numbers.

mod named;
mod numbers;
mod topics;

use std::path::Path;

use super::columns::{Name, by_header, length_unit, stamp_unit};
use super::table::{Row, Separator, is_no_value, shorten};
use super::text::{Line, Text};
use crate::error::Place;
use crate::{Error, Format, LoadOptions, ReadOption, Remark, StampUnit};

pub(crate) use topics::choose;

/// Lines looked at to find the layout.
const SAMPLE: usize = 40;
/// Where the stamp is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stamp {
    /// There is none.
    None,
    /// In one column, in this unit where the header says it.
    Column(usize, Option<StampUnit>),
    /// Whole seconds in one column, what is more in another, in this unit.
    Pair(usize, usize, StampUnit),
    /// Frame numbers.
    Index(usize),
}

/// Where the rotation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rotation {
    /// Columns of w, x, y, z.
    Quaternion([usize; 4]),
    /// Columns of the row-major matrix.
    Matrix([usize; 9]),
    /// Columns of roll, pitch and yaw, in degrees or radians where the header says so.
    Angles([usize; 3], Option<bool>),
    /// Columns of roll, pitch (nose up) and heading (clockwise from north, which is y), in degrees or radians.
    Heading([usize; 3], bool),
    /// The column of the yaw of a body in the plane, in degrees or radians, and whether it is clockwise from y.
    Yaw([usize; 1], Option<bool>, bool),
    /// Columns of a rotation vector, radians.
    Vector([usize; 3]),
}

impl Rotation {
    /// Its columns.
    pub fn columns(&self) -> &[usize] {
        match self {
            Self::Quaternion(columns) => columns,
            Self::Matrix(columns) => columns,
            Self::Angles(columns, _) | Self::Heading(columns, _) | Self::Vector(columns) => columns,
            Self::Yaw(column, ..) => column,
        }
    }
}

/// Who says the order of the quaternion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    /// The user.
    Given,
    /// The header.
    Header,
    /// The habit of the format, and the data may overrule it.
    Habit,
}

/// The layout of one file.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    pub format: Format,
    pub separator: Separator,
    /// Fields a row must have.
    pub columns: usize,
    /// Whether it may have more.
    pub more: bool,
    pub stamp: Stamp,
    /// Columns of x, y and z; in the plane there is no z, and its column is that of y.
    pub position: [usize; 3],
    pub rotation: Rotation,
    pub order: Order,
    /// Metres in one unit of the position.
    pub metres: f64,
    /// Rows without any number of the pose belong to something else that the table holds.
    pub shared: bool,
    /// Columns of the last row of a 4x4 matrix.
    pub last_row: Option<[usize; 4]>,
    /// Names of columns, where there is a header.
    pub names: Vec<String>,
    /// Line of a header that is no comment, or of the units below it.
    pub header_line: Option<usize>,
    pub remarks: Vec<Remark>,
}

/// The first lines of a file, taken apart.
pub(crate) struct Head<'a> {
    /// The last comment before the data.
    pub comment: Option<Line<'a>>,
    /// The line before the data that is no comment and holds words.
    pub header: Option<Line<'a>>,
    /// A line of units below it.
    pub units: Option<Line<'a>>,
    /// The first lines of data.
    pub data: Vec<Line<'a>>,
}

/// True for a line that holds no data.
pub(crate) fn is_comment(line: &str) -> bool {
    // Excel's first line says the separator.
    line.starts_with(['#', '%']) || line.starts_with("//") || line.starts_with("sep=")
}

impl<'a> Head<'a> {
    pub fn new(text: &'a Text<'_>) -> Self {
        let mut head = Self {
            comment: None,
            header: None,
            units: None,
            data: Vec::new(),
        };
        for line in text.lines() {
            if is_comment(line.text) {
                if head.data.is_empty() && head.header.is_none() {
                    head.comment = Some(line);
                }
            } else if head.data.is_empty() && head.header.is_none() && is_words(line.text) {
                head.header = Some(line);
            } else if head.data.is_empty() && head.header.is_some() && is_units(line.text) {
                head.units = Some(line);
            } else {
                head.data.push(line);
                if head.data.len() == SAMPLE {
                    break;
                }
            }
        }
        // ROS writes its header as a comment: `%time,field.header.seq,...`.
        if head.header.is_none() && head.comment.is_some_and(|line| line.text.starts_with('%')) {
            head.header = head.comment;
        }
        head
    }
}

/// True for a line that begins a table: no field is a number, and several are words.
fn is_words(line: &str) -> bool {
    let mut fields = Vec::new();
    Separator::of(line).split(line, &mut fields);
    let numbers = fields.iter().filter(|field| field.parse::<f64>().is_ok());
    let words = fields.iter().filter(|field| {
        field
            .trim_start_matches(['"', '_', '/'])
            .starts_with(|c: char| c.is_ascii_alphabetic())
    });
    numbers.count() == 0 && words.count() >= 2 && fields.iter().any(|field| !is_no_value(field))
}

/// True for a line of units below a header: no field is a number, and most are units, perhaps in brackets.
fn is_units(line: &str) -> bool {
    let mut fields = Vec::new();
    Separator::of(line).split(line, &mut fields);
    let known =
        |unit: &str| stamp_unit(unit).is_some() || length_unit(unit).is_some() || is_angle(unit);
    let units = fields.iter().filter(|field| known(&unit_of(field))).count();
    units >= 3 && fields.iter().all(|field| field.parse::<f64>().is_err())
}

fn unit_of(field: &str) -> String {
    field
        .trim_matches(|c: char| "[]() ".contains(c))
        .to_ascii_lowercase()
}

fn is_angle(unit: &str) -> bool {
    matches!(
        unit,
        "deg" | "degree" | "degrees" | "rad" | "radian" | "radians" | "\u{b0}"
    )
}

/// The names of a header line; blanks within a name, units in brackets behind a blank belong to it.
fn names(line: &str, separator: Separator) -> Vec<Name> {
    let line = line.trim_start_matches(['#', '%', ' ']);
    let mut fields = Vec::new();
    let own = Separator::of(line);
    // A comment over a table of commas may name its columns with blanks between.
    let separator = match separator {
        Separator::Blanks => own,
        _ if own == Separator::Blanks => own,
        other => other,
    };
    separator.split(line, &mut fields);
    let mut joined: Vec<String> = Vec::new();
    for field in fields {
        match joined.last_mut() {
            Some(last) if separator == Separator::Blanks && field.starts_with(['[', '(']) => {
                last.push_str(field)
            }
            _ => joined.push(field.to_owned()),
        }
    }
    joined.iter().map(|name| Name::new(name)).collect()
}

impl Layout {
    /// Finds the layout of a text.
    pub fn find(path: &Path, text: &Text<'_>, options: &LoadOptions) -> Result<Self, Error> {
        let head = Head::new(text);
        let Some(first) = head.data.first() else {
            if let Some(line) = head.header {
                let names = names(line.text, Separator::of(line.text));
                if let Err(missing) =
                    Self::from_roles(&by_header(&names), &names, Separator::Blanks, 0)
                {
                    return Err(not_understood(path, line, &names, &missing));
                }
            }
            let found = match (head.header, head.comment) {
                (Some(_), _) => "only a header",
                (_, Some(_)) => "only comments",
                _ => "only blank lines",
            };
            return Err(unknown(
                path,
                Place::File,
                found,
                "the recording may have failed",
            ));
        };
        let separator = head
            .data
            .iter()
            .map(|line| Separator::of(line.text))
            .find(|separator| *separator != Separator::Blanks)
            .unwrap_or(Separator::Blanks);
        let mut fields = Vec::new();
        separator.split(first.text, &mut fields);
        let width = fields.len();
        let mut header = head.header.map(|line| (line, names(line.text, separator)));
        if let (Some((_, names)), Some(units)) = (&mut header, head.units) {
            separator.split(units.text, &mut fields);
            for (name, unit) in names.iter_mut().zip(&fields) {
                name.unit = Some(unit_of(unit)).filter(|unit| !unit.is_empty());
            }
        }
        // Data begin behind the units.
        let last_head = head.units.or(head.header).map(|line| line.number);
        let comment = head.comment.map(|line| (line, names(line.text, separator)));
        let plain_names = |names: &[Name]| {
            names
                .iter()
                .map(|name| name.text.clone())
                .collect::<Vec<_>>()
        };
        if let Some(columns) = &options.columns {
            let named = header
                .as_ref()
                .or(comment.as_ref())
                .map_or(&[][..], |(_, names)| names);
            let roles = columns.resolve(&plain_names(named)).map_err(|missing| {
                let found = if named.is_empty() {
                    "no header".to_owned()
                } else {
                    format!("`{}`", shorten(&plain_names(named).join(",")))
                };
                Error::input(
                    path,
                    Place::File,
                    format!("a column `{missing}`"),
                    found,
                    "say columns by the names in the header or by number from 1",
                )
                .option(ReadOption::Columns)
            })?;
            let mut layout =
                Self::from_roles(&roles, named, separator, width).map_err(|missing| {
                    Error::input(
                        path,
                        first.place(),
                        "columns that make a pose",
                        missing,
                        "name position and rotation",
                    )
                    .option(ReadOption::Columns)
                })?;
            layout.order = Order::Given;
            layout.header_line = last_head;
            return Ok(layout);
        }
        if let Some((line, names)) = &header {
            let topic = choose(names, &options.topics).map_err(|(found, hint)| {
                let wanted = "the columns of one pose";
                Error::input(path, line.place(), wanted, found, hint).option(ReadOption::Topic)
            })?;
            let (roles, shared) = match topic {
                Some(topic) => (topic.roles, topic.shared),
                None => (by_header(names), false),
            };
            return match Self::from_roles(&roles, names, separator, width) {
                Ok(layout) if layout.is_of_names_that_come_twice(names) => {
                    let wanted = "the columns of one pose";
                    let hint = "say by their numbers which columns are meant";
                    let found = "each of its names twice";
                    let fault = Error::input(path, line.place(), wanted, found, hint);
                    Err(fault.option(ReadOption::Columns))
                }
                Ok(mut layout) => {
                    layout.shared = shared;
                    layout.header_line = last_head;
                    layout.name_columns(names);
                    Ok(layout)
                }
                Err(missing) => {
                    // A title over numbers is no header.
                    if roles.is_empty()
                        && names.len() != width
                        && let Ok(mut layout) = Self::by_numbers(path, &head, separator)
                    {
                        layout.header_line = last_head;
                        return Ok(layout);
                    }
                    Err(not_understood(path, *line, names, &missing))
                }
            };
        }
        if let Some((line, names)) = &comment {
            let roles = by_header(names);
            let fits = names.len() == width
                || roles.iter().all(|(_, column)| *column < width) && roles.len() >= 7;
            if fits && let Ok(mut layout) = Self::from_roles(&roles, names, separator, width) {
                layout.name_columns(names);
                return Ok(layout);
            }
            if names.len() == width && roles.len() >= 4 && separator != Separator::Blanks {
                let missing = Self::from_roles(&roles, names, separator, width)
                    .err()
                    .unwrap_or_default();
                return Err(not_understood(path, *line, names, &missing));
            }
        }
        Self::by_numbers(path, &head, separator)
    }

    /// Columns of the axes of the position that there are.
    pub fn axes(&self) -> &[usize] {
        match self.rotation {
            Rotation::Yaw(..) => &self.position[..2],
            _ => &self.position,
        }
    }

    /// Whether every name of a column of the pose is that of another one too.
    fn is_of_names_that_come_twice(&self, names: &[Name]) -> bool {
        let twice = |column: usize| {
            let own = &names[column].text;
            names.iter().filter(|name| name.text == *own).count() > 1
        };
        let mut columns = self.axes().iter().chain(self.rotation.columns());
        columns.all(|column| twice(*column))
    }

    /// Whether a row has nothing in any column of the pose.
    pub fn has_no_pose(&self, row: &Row<'_, '_>) -> bool {
        let mut columns = self.axes().iter().chain(self.rotation.columns());
        columns.all(|column| {
            row.fields()
                .get(*column)
                .is_some_and(|field| field.is_empty())
        })
    }

    /// The layout of a format that the user named.
    pub fn of_format(format: Format, separator: Separator) -> Self {
        let mut layout = Self {
            format,
            separator,
            columns: 8,
            more: false,
            stamp: Stamp::Column(0, None),
            position: [1, 2, 3],
            rotation: Rotation::Quaternion([7, 4, 5, 6]),
            order: Order::Habit,
            metres: 1.0,
            shared: false,
            last_row: None,
            names: Vec::new(),
            header_line: None,
            remarks: Vec::new(),
        };
        match format {
            Format::Kitti => {
                layout.columns = 12;
                layout.stamp = Stamp::None;
                layout.set_matrix(0, 12, false);
            }
            Format::Euroc => {
                layout.set_quaternion(1, false);
                layout.more = true;
            }
            _ => {}
        }
        layout
    }
}

impl Line<'_> {
    /// Where it is.
    pub fn place(&self) -> Place {
        Place::Line(self.number)
    }
}

/// The error for a file that is no log.
pub(crate) fn unknown(path: &Path, place: Place, found: &str, hint: &str) -> Error {
    let expected = "poses as text (KITTI, TUM, EuRoC, RobotCar, csv with named columns, matrices), JSON, npy, npz, or a recording";
    Error::input(path, place, expected, found, hint).option(ReadOption::Format)
}

fn not_understood(path: &Path, line: Line<'_>, names: &[Name], missing: &str) -> Error {
    let has = |wanted: &str| names.iter().any(|name| name.plain == wanted);
    let hint = if has("northing") && has("easting") && !has("roll") {
        "RobotCar poses with orientation are in gps/ins.csv, gps/rtk.csv and vo/vo.csv"
    } else if names
        .iter()
        .any(|name| name.plain.starts_with("w_rs") || name.plain.starts_with("a_rs"))
    {
        "EuRoC poses are in state_groundtruth_estimate0/data.csv; sensor files have no orientation"
    } else if ["lat", "latitude"].iter().any(|word| has(word)) {
        "latitude and longitude are no metres: convert them first (UTM, or east, north, up about a point)"
    } else if ["rx", "ry", "rz"].iter().all(|word| has(word)) {
        "rx, ry, rz may be a rotation vector or angles: name them rx,ry,rz (a vector in radians) or roll,pitch,yaw"
    } else if ["x", "y", "z", "a", "b", "c"].iter().all(|word| has(word)) {
        "A, B, C of KUKA are yaw, pitch and roll in degrees: name them so, as in x=X,y=Y,z=Z,yaw=A,pitch=B,roll=C"
    } else {
        "these column names were not understood; say which columns hold the pose"
    };
    let header: Vec<&str> = names.iter().map(|name| name.text.as_str()).collect();
    Error::input(
        path,
        line.place(),
        "a header that names the columns of a pose",
        format!("{missing} in `{}`", shorten(&header.join(","))),
        hint,
    )
    .option(ReadOption::Columns)
}
