//! How the lines of a text file hold poses: from the header where it names columns, else from the numbers.

use std::path::Path;

use super::columns::{Name, Role, by_header, stamp_unit};
use super::table::{Separator, is_no_value, shorten};
use super::text::{Line, Text};
use crate::error::Place;
use crate::{Error, Format, LoadOptions, ReadOption, Remark, RemarkKind, StampUnit};

/// Lines looked at to find the layout.
const SAMPLE: usize = 40;
/// Deviation from 1 of the norm of four numbers that are a quaternion.
const UNIT_NORM: f64 = 0.02;
/// Deviation from orthogonality of nine numbers that are a rotation matrix.
const ORTHOGONAL: f64 = 0.05;

/// Where the stamp is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stamp {
    /// There is none.
    None,
    /// In one column, in this unit where the header says it.
    Column(usize, Option<StampUnit>),
    /// Seconds and nanoseconds in two columns.
    Pair(usize, usize),
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
    /// Columns of a rotation vector, radians.
    Vector([usize; 3]),
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
    pub position: [usize; 3],
    pub rotation: Rotation,
    pub order: Order,
    /// Columns of the last row of a 4x4 matrix.
    pub last_row: Option<[usize; 4]>,
    /// Names of columns, where there is a header.
    pub names: Vec<String>,
    /// Line of a header that is no comment.
    pub header_line: Option<usize>,
    pub remarks: Vec<Remark>,
}

/// The first lines of a file, taken apart.
pub(crate) struct Head<'a> {
    /// The last comment before the data.
    pub comment: Option<Line<'a>>,
    /// The line before the data that is no comment and holds words.
    pub header: Option<Line<'a>>,
    /// The first lines of data.
    pub data: Vec<Line<'a>>,
}

/// True for a line that holds no data.
pub(crate) fn is_comment(line: &str) -> bool {
    line.starts_with(['#', '%']) || line.starts_with("//")
}

impl<'a> Head<'a> {
    pub fn new(text: &'a Text<'_>) -> Self {
        let mut head = Self {
            comment: None,
            header: None,
            data: Vec::new(),
        };
        for line in text.lines() {
            if is_comment(line.text) {
                if head.data.is_empty() && head.header.is_none() {
                    head.comment = Some(line);
                }
            } else if head.data.is_empty() && head.header.is_none() && is_words(line.text) {
                head.header = Some(line);
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
            .trim_start_matches(['"', '_'])
            .starts_with(|c: char| c.is_ascii_alphabetic())
    });
    numbers.count() == 0 && words.count() >= 2 && fields.iter().any(|field| !is_no_value(field))
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
        let header = head.header.map(|line| (line, names(line.text, separator)));
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
            layout.header_line = header.map(|(line, _)| line.number);
            return Ok(layout);
        }
        if let Some((line, names)) = &header {
            let roles = by_header(names);
            return match Self::from_roles(&roles, names, separator, width) {
                Ok(mut layout) => {
                    layout.header_line = Some(line.number);
                    layout.name_columns(names);
                    Ok(layout)
                }
                Err(missing) => {
                    // A title over numbers is no header.
                    if roles.is_empty()
                        && names.len() != width
                        && let Ok(mut layout) = Self::by_numbers(path, &head, separator)
                    {
                        layout.header_line = Some(line.number);
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

    /// The layout that named columns make; what is missing otherwise.
    fn from_roles(
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
        let Some(position) = all(Role::Position, 3) else {
            return Err("no columns for the position x, y, z".to_owned());
        };
        let (quaternion, matrix, angles) = (
            all(Role::Quaternion, 4),
            all(Role::Matrix, 9),
            all(Role::Angle, 3),
        );
        let rotation = if let Some(columns) = quaternion {
            Rotation::Quaternion([columns[0], columns[1], columns[2], columns[3]])
        } else if let Some(columns) = matrix {
            Rotation::Matrix(std::array::from_fn(|index| columns[index]))
        } else if let Some(columns) = angles {
            let degrees = unit(columns[2]).and_then(|unit| {
                if unit.starts_with("deg") || unit == "\u{b0}" {
                    Some(true)
                } else if unit.starts_with("rad") {
                    Some(false)
                } else {
                    None
                }
            });
            Rotation::Angles([columns[0], columns[1], columns[2]], degrees)
        } else {
            return Err(
                "positions without a rotation (a quaternion, roll, pitch and yaw, or a matrix)"
                    .to_owned(),
            );
        };
        let stamp = match (
            find(Role::Stamp),
            find(Role::Seconds),
            find(Role::Nanoseconds),
        ) {
            (Some(column), None, _) | (Some(column), _, None) => {
                Stamp::Column(column, unit(column).and_then(stamp_unit))
            }
            (_, Some(seconds), Some(nanoseconds)) => Stamp::Pair(seconds, nanoseconds),
            (None, Some(seconds), None) => Stamp::Column(seconds, Some(StampUnit::Seconds)),
            (None, None, _) => Stamp::None,
        };
        let mut used: Vec<usize> = position.clone();
        used.extend(match &rotation {
            Rotation::Quaternion(columns) => &columns[..],
            Rotation::Matrix(columns) => &columns[..],
            Rotation::Angles(columns, _) | Rotation::Vector(columns) => &columns[..],
        });
        match stamp {
            Stamp::Column(column, _) | Stamp::Index(column) => used.push(column),
            Stamp::Pair(a, b) => used.extend([a, b]),
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
            position: [position[0], position[1], position[2]],
            rotation,
            order: Order::Header,
            last_row: None,
            names: names.iter().map(|name| name.text.clone()).collect(),
            header_line: None,
            remarks: Vec::new(),
        })
    }

    /// Says which columns a header named, where that is not the habit of the format.
    fn name_columns(&mut self, names: &[Name]) {
        let name = |column: usize| names.get(column).map_or("?", |name| name.text.as_str());
        let rotation: Vec<&str> = match &self.rotation {
            Rotation::Quaternion(columns) => columns.iter().map(|column| name(*column)).collect(),
            Rotation::Matrix(columns) => vec![name(columns[0]), "...", name(columns[8])],
            Rotation::Angles(columns, _) | Rotation::Vector(columns) => {
                columns.iter().map(|column| name(*column)).collect()
            }
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
        if self.format != Format::Csv {
            return;
        }
        let stamp = match self.stamp {
            Stamp::None => "no stamp".to_owned(),
            Stamp::Column(column, _) | Stamp::Index(column) => {
                format!("stamp from `{}`", name(column))
            }
            Stamp::Pair(a, b) => format!("stamp from `{}` and `{}`", name(a), name(b)),
        };
        let position: Vec<&str> = self.position.iter().map(|column| name(*column)).collect();
        let text = format!(
            "columns by the header: {stamp}, position from `{}`, rotation from `{}`",
            position.join(" "),
            rotation.join(" ")
        );
        self.remarks
            .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns));
    }

    /// The layout that the numbers of a file without a header make.
    fn by_numbers(path: &Path, head: &Head<'_>, separator: Separator) -> Result<Self, Error> {
        let sample = Sample::new(&head.data, separator);
        let first = head.data[0];
        let blanks = separator == Separator::Blanks;
        let mut layout = Self {
            format: Format::Csv,
            separator,
            columns: sample.width,
            more: false,
            stamp: Stamp::None,
            position: [0; 3],
            rotation: Rotation::Quaternion([0; 4]),
            order: Order::Habit,
            last_row: None,
            names: Vec::new(),
            header_line: None,
            remarks: Vec::new(),
        };
        if sample.numbers == 0 {
            let words = head
                .data
                .iter()
                .any(|line| line.text.contains(|c: char| c.is_ascii_digit()));
            let hint = if words {
                "a table needs columns for position and rotation; say which they are"
            } else {
                "give the file that holds the poses"
            };
            return Err(unknown(path, first.place(), "text without numbers", hint)
                .option(ReadOption::Columns));
        }
        if let Some(start) = sample.echo() {
            layout.stamp = Stamp::Pair(0, 1);
            layout.set_quaternion(start, true);
            layout.columns = start + 7;
            layout.more = true;
            let text = "columns as `ros2 topic echo --csv` writes them: sec, nanosec, frames, position, quaternion";
            layout
                .remarks
                .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns));
            return Ok(layout);
        }
        if 2 * sample.numbers <= sample.width {
            let found = format!(
                "{} fields separated by {}, {} of them numbers",
                sample.width,
                separator.name(),
                sample.numbers
            );
            let hint = "say which columns hold the pose, or choose a format";
            return Err(unknown(path, first.place(), &found, hint).option(ReadOption::Columns));
        }
        let width = sample.width;
        if let Some((lead, size, transposed)) = sample.matrix() {
            layout.set_matrix(lead, size, transposed);
            let index = lead == 1 && sample.is_index();
            layout.format = if blanks && size == 12 && (lead == 0 || index) {
                Format::Kitti
            } else {
                Format::Matrix
            };
            if lead == 1 {
                layout.stamp = if index {
                    Stamp::Index(0)
                } else {
                    Stamp::Column(0, None)
                };
                let what = if index { "a frame number" } else { "a stamp" };
                let text = format!("{width} numbers a line: {what}, then the matrix of the pose");
                layout
                    .remarks
                    .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns));
            }
            if transposed {
                let text = "the translation is in the last row of the matrix: taken as written column by column";
                layout
                    .remarks
                    .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Format));
            }
            return Ok(layout);
        }
        match width {
            7 if sample.is_quaternion(3) => {
                layout.set_quaternion(0, true);
                let text = "7 numbers a line: position and quaternion without a stamp";
                layout
                    .remarks
                    .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns));
            }
            7 => {
                layout.stamp = Stamp::Column(0, None);
                layout.position = [1, 2, 3];
                layout.rotation = Rotation::Angles([4, 5, 6], None);
                let text = "7 numbers a line that hold no quaternion: stamp, position, then roll, pitch and yaw";
                layout
                    .remarks
                    .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns));
            }
            25 if blanks && !sample.is_quaternion(4) => {
                layout.stamp = Stamp::Column(0, Some(StampUnit::Seconds));
                layout.rotation = Rotation::Vector([1, 2, 3]);
                layout.position = [4, 5, 6];
                let text = "25 numbers a line as FAST-LIO writes them: seconds, rotation vector in radians, position";
                layout
                    .remarks
                    .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns));
            }
            8.. if !sample.is_quaternion(4) && sample.is_quaternion(1) => {
                layout.stamp = Stamp::Column(0, None);
                layout.set_quaternion(1, true);
                layout.rotation = Rotation::Quaternion([4, 1, 2, 3]);
                layout.position = [5, 6, 7];
                layout.more = width > 8;
                let text =
                    "columns 2 to 5 have norm 1 and 6 to 8 do not: stamp, quaternion, position";
                layout
                    .remarks
                    .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns));
            }
            8.. if width == 8
                || sample.is_quaternion(4)
                || separator == Separator::Character(',') && sample.has_ns() =>
            {
                layout.stamp = Stamp::Column(0, None);
                let euroc = separator == Separator::Character(',') && sample.has_ns();
                layout.set_quaternion(1, !euroc);
                layout.more = width > 8;
                layout.columns = 8;
                layout.format = if euroc {
                    Format::Euroc
                } else if blanks {
                    Format::Tum
                } else {
                    Format::Csv
                };
                if width > 8 && !euroc {
                    let text = format!(
                        "{width} columns: the first 8 as stamp, position, quaternion, the others unread"
                    );
                    layout
                        .remarks
                        .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns));
                }
            }
            1 => {
                let hint = "this looks like KITTI times; give the pose file";
                return Err(unknown(path, first.place(), "one number a line", hint));
            }
            4 if blanks => {
                let hint = "one 4x4 pose of a folder annotated_poses? Give the folder";
                return Err(unknown(path, first.place(), "a line of 4 numbers", hint));
            }
            _ => {
                let found = format!("{width} fields separated by {}", separator.name());
                let hint = "say which columns hold the pose, or choose a format";
                return Err(unknown(path, first.place(), &found, hint).option(ReadOption::Columns));
            }
        }
        Ok(layout)
    }

    /// Position from column `start` on, then a quaternion with w last or first.
    fn set_quaternion(&mut self, start: usize, w_last: bool) {
        self.position = [start, start + 1, start + 2];
        let [a, b, c, d] = [start + 3, start + 4, start + 5, start + 6];
        self.rotation = Rotation::Quaternion(if w_last { [d, a, b, c] } else { [a, b, c, d] });
    }

    /// A 3x4 or 4x4 matrix from column `lead` on.
    fn set_matrix(&mut self, lead: usize, size: usize, transposed: bool) {
        let at = |row: usize, column: usize| {
            lead + if transposed {
                4 * column + row
            } else {
                4 * row + column
            }
        };
        self.position = std::array::from_fn(|row| at(row, 3));
        self.rotation = Rotation::Matrix(std::array::from_fn(|index| at(index / 3, index % 3)));
        self.last_row = (size == 16).then(|| std::array::from_fn(|column| at(3, column)));
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

/// The numbers of the first lines of data.
struct Sample {
    /// Fields of the first line.
    width: usize,
    /// Numbers among them.
    numbers: usize,
    first: Vec<String>,
    /// Lines that are all numbers and have the width of the first.
    rows: Vec<Vec<f64>>,
}

impl Sample {
    fn new(lines: &[Line<'_>], separator: Separator) -> Self {
        let mut fields = Vec::new();
        let (mut width, mut numbers, mut first) = (0, 0, Vec::new());
        let mut rows = Vec::new();
        // The width that most lines have: the first one may be the damaged one.
        let mut widths: Vec<usize> = Vec::new();
        for line in lines {
            separator.split(line.text, &mut fields);
            widths.push(fields.len());
        }
        let most = |width: usize| widths.iter().filter(|other| **other == width).count();
        let common = widths
            .iter()
            .copied()
            .max_by_key(|width| (most(*width), *width))
            .unwrap_or(0);
        for line in lines {
            separator.split(line.text, &mut fields);
            if fields.len() != common {
                continue;
            }
            let values: Vec<f64> = fields
                .iter()
                .filter_map(|field| field.parse().ok())
                .collect();
            if first.is_empty() {
                width = fields.len();
                numbers = fields
                    .iter()
                    .filter(|field| {
                        field.parse::<f64>().is_ok() || !field.is_empty() && is_no_value(field)
                    })
                    .count();
                first = fields.iter().map(ToString::to_string).collect();
            }
            if values.len() == width && values.iter().all(|value| value.is_finite()) {
                rows.push(values);
            }
        }
        Self {
            width,
            numbers,
            first,
            rows,
        }
    }

    /// Share of rows for which a test holds is above a half.
    fn mostly(&self, test: impl Fn(&[f64]) -> bool) -> bool {
        let good = self.rows.iter().filter(|row| test(row)).count();
        2 * good > self.rows.len()
    }

    fn is_quaternion(&self, start: usize) -> bool {
        self.mostly(|row| {
            row.get(start..start + 4).is_some_and(|part| {
                (part.iter().map(|v| v * v).sum::<f64>().sqrt() - 1.0).abs() < UNIT_NORM
            })
        })
    }

    /// Columns before the matrix, its numbers, and whether it is written column by column.
    fn matrix(&self) -> Option<(usize, usize, bool)> {
        let (lead, size) = match self.width {
            12 => (0, 12),
            13 => (1, 12),
            16 => (0, 16),
            17 => (1, 16),
            _ => return None,
        };
        let orthogonal = |row: &[f64]| {
            let r = |i: usize, j: usize| row[lead + 4 * i + j];
            (0..3).all(|i| {
                (0..3).all(|j| {
                    let dot: f64 = (0..3).map(|k| r(i, k) * r(j, k)).sum();
                    (dot - if i == j { 1.0 } else { 0.0 }).abs() < ORTHOGONAL
                })
            })
        };
        // Twelve numbers are nothing else; a faulty matrix is named by the reader.
        if size == 12 && lead == 0 || self.mostly(orthogonal) {
            let below = |row: &[f64]| (0..3).any(|j| row[lead + 12 + j] != 0.0);
            let beside = |row: &[f64]| (0..3).any(|i| row[lead + 4 * i + 3] != 0.0);
            let transposed = size == 16
                && self.rows.iter().any(|row| below(row))
                && !self.rows.iter().any(|row| beside(row));
            return Some((lead, size, transposed));
        }
        None
    }

    /// The first column counts: whole numbers below a million that go up by one, mostly.
    fn is_index(&self) -> bool {
        let whole = self
            .rows
            .iter()
            .all(|row| row[0].fract() == 0.0 && (0.0..1e6).contains(&row[0]));
        let ups = self
            .rows
            .windows(2)
            .filter(|pair| pair[1][0] - pair[0][0] == 1.0)
            .count();
        whole && self.rows.len() > 1 && 2 * ups >= self.rows.len() - 1
    }

    /// The first column holds whole numbers of the size of nanoseconds since 1970.
    fn has_ns(&self) -> bool {
        self.first
            .first()
            .is_some_and(|field| field.len() >= 16 && field.bytes().all(|b| b.is_ascii_digit()))
    }

    /// Start of the position in a line of `ros2 topic echo --csv`: `sec,nanosec,frame[,child],x,y,...`.
    fn echo(&self) -> Option<usize> {
        let number = |index: usize| self.first.get(index)?.parse::<f64>().ok();
        let (seconds, part) = (number(0)?, number(1)?);
        let whole = seconds.fract() == 0.0 && part.fract() == 0.0 && (0.0..1e9).contains(&part);
        if !whole || number(2).is_some() || self.first.len() < 10 {
            return None;
        }
        let start = (3..5).find(|index| number(*index).is_some())?;
        (start..start + 7)
            .all(|index| number(index).is_some())
            .then_some(start)
    }
}

/// The error for a file that is no log.
pub(crate) fn unknown(path: &Path, place: Place, found: &str, hint: &str) -> Error {
    let expected = "poses as text (KITTI, TUM, EuRoC, RobotCar, csv with named columns, matrices), npy, or a recording";
    Error::input(path, place, expected, found, hint).option(ReadOption::Format)
}

fn not_understood(path: &Path, line: Line<'_>, names: &[Name], missing: &str) -> Error {
    let has = |wanted: &str| names.iter().any(|name| name.plain == wanted);
    let hint = if has("northing") && has("easting") {
        "RobotCar poses with orientation are in gps/ins.csv, gps/rtk.csv and vo/vo.csv"
    } else if names
        .iter()
        .any(|name| name.plain.starts_with("w_rs") || name.plain.starts_with("a_rs"))
    {
        "EuRoC poses are in state_groundtruth_estimate0/data.csv; sensor files have no orientation"
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
