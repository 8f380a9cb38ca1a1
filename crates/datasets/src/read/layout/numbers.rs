//! Layouts from the numbers of a file without a header.

use std::path::Path;

use super::{Head, Layout, Order, Rotation, Stamp, unknown};
use crate::read::dates;
use crate::read::table::{Separator, is_no_value};
use crate::read::text::Line;
use crate::{Error, Format, ReadOption, Remark, RemarkKind, StampUnit};

/// Deviation from 1 of the norm of four numbers that are a quaternion.
const UNIT_NORM: f64 = 0.02;
/// Deviation from orthogonality of nine numbers that are a rotation matrix.
const ORTHOGONAL: f64 = 0.05;

impl Layout {
    /// The layout that the numbers of a file without a header make.
    pub(super) fn by_numbers(
        path: &Path,
        head: &Head<'_>,
        separator: Separator,
    ) -> Result<Self, Error> {
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
            metres: 1.0,
            shared: false,
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
            let vicon = ["Objects", "Segments", "Trajectories", "Joints"].contains(&first.text);
            let hint = if vicon {
                "this looks like Vicon's; its angles depend on settings: save positions and quaternions under named columns"
            } else if words {
                "a table needs columns for position and rotation; say which they are"
            } else {
                "give the file that holds the poses"
            };
            return Err(unknown(path, first.place(), "text without numbers", hint)
                .option(ReadOption::Columns));
        }
        if let Some(start) = sample.echo() {
            layout.stamp = Stamp::Pair(0, 1, StampUnit::Nanoseconds);
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
        if let Some((stamp, lead, what)) = sample.lead() {
            layout.stamp = stamp;
            layout.set_quaternion(lead, true);
            layout.more = width > lead + 7;
            layout.columns = lead + 7;
            let text = format!("{width} columns: {what}, position, quaternion");
            layout
                .remarks
                .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns));
            return Ok(layout);
        }
        match width {
            7 if !sample.is_quaternion(3) && sample.is_quaternion(0) => {
                layout.position = [4, 5, 6];
                layout.rotation = Rotation::Quaternion([3, 0, 1, 2]);
                let text = "7 numbers a line: quaternion and position without a stamp";
                layout
                    .remarks
                    .push(Remark::new(RemarkKind::Columns, text).option(ReadOption::Columns));
            }
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
    pub(super) fn set_quaternion(&mut self, start: usize, w_last: bool) {
        self.position = [start, start + 1, start + 2];
        let [a, b, c, d] = [start + 3, start + 4, start + 5, start + 6];
        self.rotation = Rotation::Quaternion(if w_last { [d, a, b, c] } else { [a, b, c, d] });
    }

    /// A 3x4 or 4x4 matrix from column `lead` on.
    pub(super) fn set_matrix(&mut self, lead: usize, size: usize, transposed: bool) {
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

/// A number, or the seconds of a date.
fn value(field: &str) -> Option<f64> {
    let date = || Some(dates::nanoseconds(field)? as f64 * 1e-9);
    field.parse().ok().or_else(date)
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
            let values: Vec<f64> = fields.iter().filter_map(|field| value(field)).collect();
            if first.is_empty() {
                width = fields.len();
                numbers = fields
                    .iter()
                    .filter(|field| {
                        value(field).is_some() || !field.is_empty() && is_no_value(field)
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

    /// What stands before position and quaternion where it is more than a stamp: seconds and nanoseconds, or a number and a
    /// stamp.
    fn lead(&self) -> Option<(Stamp, usize, &'static str)> {
        if self.width < 9 || self.is_quaternion(4) || !self.is_quaternion(5) {
            return None;
        }
        let parts = |row: &[f64]| {
            row[0].fract() == 0.0 && row[1].fract() == 0.0 && (0.0..1e9).contains(&row[1])
        };
        // Nanoseconds are seldom small, and begin anew each second.
        let large = self.rows.iter().any(|row| row[1] >= 1e6);
        if self.rows.iter().all(|row| parts(row)) && large && !self.is_index() {
            return Some((
                Stamp::Pair(0, 1, StampUnit::Nanoseconds),
                2,
                "seconds and nanoseconds",
            ));
        }
        self.is_index()
            .then_some((Stamp::Column(1, None), 2, "a number, a stamp"))
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
