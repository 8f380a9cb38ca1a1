//! Poses from the lines of a text file, given its layout.

use std::path::{Path, PathBuf};

use dose3_lie::{Matrix, Pose, Rotation as LieRotation, Vector, so3};

use super::collect::{Collector, euler_rotation, pose};
use super::guess::{self, DECIDED, Stamps};
use super::kitti;
use super::layout::{Layout, Order, Rotation, Stamp, is_comment};
use super::numbers::float;
use super::order;
use super::table::{Row, Separator, after_point, check_coordinate, is_no_value};
use super::text::{Line, Text};
use crate::error::Place;
use crate::{
    Error, Format, LoadOptions, LoadReport, LostKind, ReadOption, Remark, RemarkKind, StampUnit,
    Trajectory,
};

/// Rows looked at to tell units and orders.
const SAMPLE: usize = 5000;
/// Largest deviation of the last row of a 4x4 matrix from (0, 0, 0, 1).
const LAST_ROW_TOLERANCE: f64 = 1e-6;
/// Lines that make a thread of their own worth it.
const LINES_A_PART: usize = 20_000;
/// Beyond this many threads, the file comes slower than it is taken apart.
const MOST_THREADS: usize = 8;
/// Rows whose digits are counted.
const ROWS_FOR_DIGITS: usize = 100;
/// Two turns: larger angles are degrees.
const LARGEST_RADIANS: f64 = 4.0 * std::f64::consts::PI;
/// Below this norm a quaternion or a matrix was never filled in.
const ZERO: f64 = 1e-6;

/// Reads a text whose layout is found from its content, or that of `format` where the user named it.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    format: Option<Format>,
    times: Option<PathBuf>,
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    let mut collector = Collector::new(path, options);
    let text = Text::new(path, bytes, &mut collector.report)?;
    let mut layout = named_layout(path, &text, format, options)?;
    if let Some(times) = times
        && layout.stamp == Stamp::None
    {
        let stamps = kitti::read_times(&times)?;
        collector.take_times(times, stamps);
    }
    let lines = data_lines(&text, &layout);
    let sample = Sample::new(path, &lines, &layout);
    let clock = settle(&mut layout, &sample, options, &mut collector);
    read_lines(path, &lines, &layout, clock, collector)
}

/// The lines that hold data.
pub(super) fn data_lines<'a>(text: &'a Text<'_>, layout: &Layout) -> Vec<Line<'a>> {
    let data = |line: &Line<'_>| {
        let header = layout
            .header_line
            .is_some_and(|header| line.number <= header);
        !header && !is_comment(line.text)
    };
    text.lines().filter(data).collect()
}

/// Settles what the layout leaves open, from the numbers.
pub(super) fn settle(
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

/// The layout found in the text; where the user named a format that it does not suit, the usual one of that format.
pub(super) fn named_layout(
    path: &Path,
    text: &Text<'_>,
    format: Option<Format>,
    options: &LoadOptions,
) -> Result<Layout, Error> {
    let found = Layout::find(path, text, options);
    let Some(format) = format else {
        return found;
    };
    match found {
        Ok(layout) if suits(format, &layout) => Ok(Layout { format, ..layout }),
        Err(fault) if options.columns.is_some() => Err(fault),
        _ if matches!(format, Format::Kitti | Format::Tum | Format::Euroc) => {
            let first = text.lines().find(|line| !is_comment(line.text));
            let separator = first.map_or(Separator::Blanks, |line| Separator::of(line.text));
            Ok(Layout::of_format(format, separator))
        }
        Err(fault) => Err(fault),
        Ok(layout) => Err(Error::input(
            path,
            Place::File,
            format!("the format {format}"),
            format!("what looks like {}", layout.format),
            "leave the format to be found, or choose another one",
        )
        .option(ReadOption::Format)),
    }
}

fn suits(format: Format, layout: &Layout) -> bool {
    let headed = layout.order != Order::Habit;
    format == layout.format
        || matches!(format, Format::Csv | Format::Npy)
        || matches!((format, layout.format), (Format::Matrix, Format::Kitti))
        || headed && matches!(format, Format::Tum | Format::Euroc)
}

/// The numbers of the first rows.
pub(super) struct Sample {
    stamps: Vec<f64>,
    /// Whether all stamps are whole numbers.
    whole: bool,
    positions: Vec<Vector>,
    /// The numbers of the rotation, in the order of its columns.
    rotations: Vec<[f64; 4]>,
}

impl Sample {
    /// The numbers of the first lines of data.
    pub fn new(path: &Path, lines: &[Line<'_>], layout: &Layout) -> Self {
        let mut sample = Self {
            stamps: Vec::new(),
            whole: true,
            positions: Vec::new(),
            rotations: Vec::new(),
        };
        let columns: &[usize] = match &layout.rotation {
            Rotation::Quaternion(columns) => columns,
            Rotation::Angles(columns, _) => columns,
            Rotation::Matrix(_) | Rotation::Vector(_) => &[],
        };
        let mut fields = Vec::new();
        for line in lines.iter().take(SAMPLE) {
            layout.separator.split(line.text, &mut fields);
            let row = Row::new(path, line, &fields);
            let number = |column: usize| number(&row, column);
            if let Stamp::Column(column, _) = layout.stamp
                && let Some(value) = number(column)
            {
                sample.whole &= value.fract() == 0.0;
                sample.stamps.push(value);
            }
            let [Some(x), Some(y), Some(z)] = layout.position.map(number) else {
                continue;
            };
            let mut values = [0.0; 4];
            let all =
                columns
                    .iter()
                    .zip(&mut values)
                    .all(|(column, value)| match number(*column) {
                        Some(found) => {
                            *value = found;
                            true
                        }
                        None => false,
                    });
            if all && (columns.len() == 3 || values.iter().any(|value| *value != 0.0)) {
                sample.positions.push(Vector::new(x, y, z));
                sample.rotations.push(values);
            }
        }
        sample
    }
}

/// What a stamp is in this file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Clock {
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

/// Reads the poses of some lines of data.
pub(super) fn read_lines(
    path: &Path,
    lines: &[Line<'_>],
    layout: &Layout,
    clock: Clock,
    mut collector: Collector<'_>,
) -> Result<Trajectory, Error> {
    if let Some((decimals, deviation)) = coarseness(lines, layout) {
        collector.matrices_are_coarse(deviation);
        let words = format!(
            "the matrices are written with {decimals} decimals: replaced by the nearest rotations"
        );
        collector
            .report
            .remarks
            .push(Remark::new(RemarkKind::Encoding, words));
    }
    if let Clock::Unit(unit) = clock {
        collector.stamps_in(unit);
    }
    collector.expect(lines.len());
    let parts = parse_parts(path, lines, layout, clock, &collector);
    for part in parts {
        collector.add_repairs(&part.repairs);
        for Parsed { line, time, found } in part.rows {
            let stamp = match time {
                Time::Missing => None,
                Time::At(stamp) => Some(stamp),
                Time::Row => Some(collector.next_nominal(layout.format)),
                Time::Index(index) => Some(collector.nominal(layout.format, index)),
            };
            let (place, row) = (Place::Line(line), line as u64);
            match (found, stamp) {
                (Ok(pose), Some(stamp)) => collector.push_row(place, row, stamp, pose)?,
                (Ok(_), None) => collector.lose(place, row, None, LostKind::Nan)?,
                (Err(kind), stamp) => collector.lose(place, row, stamp, kind)?,
            }
        }
        if let Some(fault) = part.fault {
            return Err(fault);
        }
    }
    match clock {
        Clock::Unit(_) => collector.finish(layout.format),
        Clock::Index | Clock::Rows => collector.finish_without_stamps(layout.format),
    }
}

/// A row taken apart, not yet part of the log.
struct Parsed {
    line: usize,
    time: Time,
    found: Result<Pose, LostKind>,
}

/// When a row was.
enum Time {
    /// It does not say.
    Missing,
    /// Nanoseconds.
    At(i64),
    /// At the place of its frame number.
    Index(usize),
    /// After the row before.
    Row,
}

/// Rows in a piece, up to the first that cannot be read.
#[derive(Default)]
struct Part {
    rows: Vec<Parsed>,
    repairs: LoadReport,
    fault: Option<Error>,
}

/// Takes the lines apart on as many threads as are worth it; the parts come in the order of the file, so the log does
/// not depend on their number.
fn parse_parts(
    path: &Path,
    lines: &[Line<'_>],
    layout: &Layout,
    clock: Clock,
    collector: &Collector<'_>,
) -> Vec<Part> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = (lines.len() / LINES_A_PART).clamp(1, cores.min(MOST_THREADS));
    let parse = |lines: &[Line<'_>]| parse_part(path, lines, layout, clock, collector.part());
    if threads == 1 {
        return vec![parse(lines)];
    }
    std::thread::scope(|scope| {
        let parse = &parse;
        let spawned: Vec<_> = lines
            .chunks(lines.len().div_ceil(threads))
            .map(|lines| {
                let handle = std::thread::Builder::new().spawn_scoped(scope, move || parse(lines));
                (lines, handle)
            })
            .collect();
        spawned
            .into_iter()
            .map(|(lines, handle)| match handle.map(|handle| handle.join()) {
                Ok(Ok(part)) => part,
                Ok(Err(panic)) => std::panic::resume_unwind(panic),
                // No thread to be had.
                Err(_) => parse(lines),
            })
            .collect()
    })
}

fn parse_part(
    path: &Path,
    lines: &[Line<'_>],
    layout: &Layout,
    clock: Clock,
    mut collector: Collector<'_>,
) -> Part {
    let names = Names(layout);
    let mut part = Part::default();
    part.rows.reserve(lines.len());
    let mut fields = Vec::with_capacity(layout.columns);
    let mut tail = Tail::default();
    for line in lines {
        layout.separator.split(line.text, &mut fields);
        let row = Row::new(path, line, &fields);
        if row.is_cut_off(layout.columns, tail.digits()) {
            collector.report.truncated_tail += 1;
            continue;
        }
        tail.take(&row);
        match parse_row(path, &row, layout, clock, &names, &mut collector) {
            Ok((time, found)) => part.rows.push(Parsed {
                line: line.number,
                time,
                found,
            }),
            Err(fault) => {
                part.fault = Some(fault);
                break;
            }
        }
    }
    part.repairs = collector.report;
    part
}

fn parse_row(
    path: &Path,
    row: &Row<'_, '_>,
    layout: &Layout,
    clock: Clock,
    names: &Names<'_>,
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
        (Clock::Unit(_), Stamp::Pair(seconds, part)) => {
            let whole = row.stamp(seconds, StampUnit::Seconds)?;
            Time::At(whole.saturating_add(row.stamp(part, StampUnit::Nanoseconds)?))
        }
        (Clock::Unit(unit), Stamp::Column(column, _) | Stamp::Index(column)) => {
            match row.stamp(column, unit) {
                Ok(stamp) => Time::At(stamp),
                Err(_) if is_no_value(row.field(column, "the stamp")?) => Time::Missing,
                Err(fault) => return Err(fault),
            }
        }
    };
    let found = read_pose(path, row, layout, names, collector)?;
    Ok((time, found))
}

/// Decimals of the matrices of a file that has only two or three, and the deviation from orthogonality that follows:
/// an entry of R^T R is off by at most half a last digit times twice the norm of a row, the root of three.
fn coarseness(lines: &[Line<'_>], layout: &Layout) -> Option<(usize, f64)> {
    let Rotation::Matrix(columns) = &layout.rotation else {
        return None;
    };
    let mut fields = Vec::new();
    let mut decimals = 0;
    for line in lines.iter().take(ROWS_FOR_DIGITS) {
        layout.separator.split(line.text, &mut fields);
        for field in columns.iter().filter_map(|column| fields.get(*column)) {
            if field.contains(['e', 'E']) {
                return None;
            }
            decimals = decimals.max(after_point(field));
        }
    }
    matches!(decimals, 2 | 3).then(|| (decimals, 2.0 * 10_f64.powi(-(decimals as i32))))
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
    names: &Names<'_>,
    collector: &mut Collector<'_>,
) -> Result<Result<Pose, LostKind>, Error> {
    let columns: &[usize] = match &layout.rotation {
        Rotation::Quaternion(columns) => columns,
        Rotation::Matrix(columns) => columns,
        Rotation::Angles(columns, _) | Rotation::Vector(columns) => columns,
    };
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
    for (axis, value) in translation.iter_mut().enumerate() {
        let column = layout.position[axis];
        match number(row, column) {
            Some(found) => {
                check_coordinate(path, row.place(), found)?;
                *value = found;
            }
            None => match no_value(row, column, &names.position(axis)) {
                Some(fault) => return Err(fault),
                None => lost = true,
            },
        }
    }
    if lost && collector.looks_for(LostKind::Nan) {
        return Ok(Err(LostKind::Nan));
    }
    if lost {
        let column = columns.iter().chain(&layout.position).copied();
        for column in column {
            row.number(column, "the pose")?;
        }
    }
    let angles = matches!(layout.rotation, Rotation::Angles(..) | Rotation::Vector(_));
    let size = values[..columns.len()]
        .iter()
        .fold(0.0_f64, |a, b| a.max(b.abs()));
    if size < ZERO && !angles && collector.looks_for(LostKind::Zero) {
        return Ok(Err(LostKind::Zero));
    }
    if let Some(last) = layout.last_row {
        check_last_row(path, row, last)?;
    }
    let rotation = match &layout.rotation {
        Rotation::Quaternion(_) => {
            let [w, x, y, z, ..] = values;
            collector.quaternion(row.place(), w, x, y, z)?
        }
        Rotation::Matrix(_) => {
            collector.rotation(path, row.place(), &Matrix::from_row_slice(&values))?
        }
        Rotation::Angles(_, degrees) => {
            let factor = if *degrees == Some(true) {
                std::f64::consts::PI / 180.0
            } else {
                1.0
            };
            euler_rotation(values[0] * factor, values[1] * factor, values[2] * factor)
        }
        Rotation::Vector(_) => so3::exp(&Vector::new(values[0], values[1], values[2])),
    };
    Ok(Ok(pose(rotation, translation)))
}

/// The finite number in a column; `None` where there is something else.
fn number(row: &Row<'_, '_>, column: usize) -> Option<f64> {
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
    let off = found
        .iter()
        .zip([0.0, 0.0, 0.0, 1.0])
        .any(|(a, b)| (a - b).abs() > LAST_ROW_TOLERANCE);
    if !off {
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
            Rotation::Angles(columns, _) => (columns[part], ["roll", "pitch", "yaw"][part]),
            Rotation::Vector(columns) => (columns[part], "the rotation vector"),
        };
        self.header(column).unwrap_or_else(|| usual.to_owned())
    }
}

/// How the last fields of the rows are written.
#[derive(Default)]
struct Tail {
    digits: Option<usize>,
    mixed: bool,
    rows: usize,
}

impl Tail {
    fn take(&mut self, row: &Row<'_, '_>) {
        let Some(last) = row.fields().last() else {
            return;
        };
        let digits = after_point(last);
        self.rows += 1;
        self.mixed |= self.digits.is_some_and(|known| known != digits);
        self.digits = Some(digits);
    }

    /// Characters after the point of every last field so far, where they agree.
    fn digits(&self) -> Option<usize> {
        self.digits.filter(|_| !self.mixed && self.rows > 2)
    }
}
