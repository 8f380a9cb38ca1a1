//! Pose lists of mapping and rendering tools: g2o graphs, COLMAP images, NeRF transforms, Open3D logs.

use std::path::Path;

use dose3_lie::Pose;
use serde::Deserialize;

use super::collect::{Collector, euler_rotation, pose};
use super::iros20::pose_or_lost;
use super::layout::is_comment;
use super::table::{Row, Separator, is_no_value};
use super::text::{Line, Text};
use crate::error::Place;
use crate::{
    Error, Format, LoadOptions, LostKind, ReadOption, Remark, RemarkKind, RowKind, Trajectory,
};

/// The format that the first lines of a text are of, where it is one of these.
pub(crate) fn detect(text: &str) -> Option<Format> {
    if text.trim_start().starts_with('{') && text.contains("transform_matrix") {
        return Some(Format::Transforms);
    }
    let colmap = text
        .lines()
        .take_while(|line| is_comment(line.trim()))
        .any(|line| line.contains("IMAGE_ID") && line.contains("QW"));
    if colmap {
        return Some(Format::Colmap);
    }
    let lines: Vec<&str> = text
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty() && !is_comment(line))
        .take(5)
        .collect();
    let first = lines.first()?;
    let graph = [
        "VERTEX_SE",
        "EDGE_SE",
        "PARAMS_SE3",
        "VERTEX2 ",
        "VERTEX3 ",
        "EDGE2 ",
        "EDGE3 ",
    ];
    if graph.iter().any(|tag| first.starts_with(tag)) {
        return Some(Format::G2o);
    }
    let widths: Vec<usize> = lines
        .iter()
        .map(|line| line.split_whitespace().count())
        .collect();
    let whole = |line: &str| {
        line.split_whitespace()
            .all(|field| field.parse::<i64>().is_ok())
    };
    (widths == [3, 4, 4, 4, 4] && whole(first)).then_some(Format::Open3d)
}

/// A pose with the number that says its place among the others.
struct Numbered {
    number: u64,
    place: Place,
    /// The row as the report counts it: the line of the file; `None` where it is the place in time.
    row: Option<u64>,
    found: Result<Pose, LostKind>,
}

/// The log of poses in order of their numbers.
fn finish(
    mut collector: Collector<'_>,
    format: Format,
    poses: Vec<Numbered>,
) -> Result<Trajectory, Error> {
    let numbers: Vec<u64> = poses.iter().map(|pose| pose.number).collect();
    for (each, index) in poses.into_iter().zip(places(&numbers)) {
        collector.skip_to(index);
        let row = each.row.unwrap_or(collector.seen() as u64);
        let stamp = collector.next_nominal(format);
        match each.found {
            Ok(pose) => collector.push_row(each.place, row, stamp, pose)?,
            Err(kind) => collector.lose(each.place, row, Some(stamp), kind)?,
        }
    }
    collector.finish_without_stamps(format)
}

/// Places in time of frames with these numbers, in increasing order: the numbers themselves, from the first on, where
/// they mostly go up by one; else each has the next place.
fn places(numbers: &[u64]) -> Vec<usize> {
    let steps = || {
        numbers
            .windows(2)
            .map(|pair| pair[1].saturating_sub(pair[0]))
    };
    let counted = steps().all(|step| (1..1000).contains(&step))
        && 2 * steps().filter(|step| *step == 1).count() >= numbers.len().saturating_sub(1);
    let first = numbers.first().copied().unwrap_or(0);
    let place = |(index, number): (usize, &u64)| {
        if counted {
            (number - first) as usize
        } else {
            index
        }
    };
    numbers.iter().enumerate().map(place).collect()
}

/// How a vertex is written.
#[derive(Clone, Copy)]
enum Vertex {
    /// `VERTEX_SE2` of g2o, `VERTEX2` of TORO: x, y, yaw.
    Planar,
    /// `VERTEX3` of TORO: x, y, z, roll, pitch, yaw.
    Angles,
    /// `VERTEX_SE3:QUAT` of g2o: x, y, z, qx, qy, qz, qw.
    Quaternion,
}

impl Vertex {
    fn of(tag: &str) -> Option<Self> {
        match tag {
            "VERTEX2" => Some(Self::Planar),
            "VERTEX3" => Some(Self::Angles),
            tag if tag.starts_with("VERTEX_SE2") => Some(Self::Planar),
            tag if tag.starts_with("VERTEX_SE") => Some(Self::Quaternion),
            _ => None,
        }
    }

    /// Fields of a line.
    fn columns(self) -> usize {
        match self {
            Self::Planar => 5,
            Self::Angles => 8,
            Self::Quaternion => 9,
        }
    }
}

/// Leaves the vertices of one robot: the first byte of GTSAM's keys is a letter for each.
fn choose_robot(
    path: &Path,
    vertices: &mut Vec<Numbered>,
    options: &LoadOptions,
) -> Result<(), Error> {
    let letter = |number: u64| match (number >> 56) as u8 {
        letter @ b'!'..=b'~' => char::from(letter).to_string(),
        other => other.to_string(),
    };
    let mut letters: Vec<String> = vertices
        .iter()
        .map(|vertex| letter(vertex.number))
        .collect();
    letters.sort_unstable();
    letters.dedup();
    if letters.len() < 2 {
        return Ok(());
    }
    vertices.retain(|vertex| options.topics.contains(&letter(vertex.number)));
    if options.topics.len() == 1 && !vertices.is_empty() {
        return Ok(());
    }
    let found = format!("keys of {}: {}", letters.len(), letters.join(", "));
    let hint = "say the letter of the one that is meant";
    let fault = Error::input(path, Place::File, "the poses of one robot", found, hint);
    Err(fault.option(ReadOption::Topic))
}

/// The vertices of a graph in order of their numbers.
pub(crate) fn read_g2o(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    let mut collector = Collector::new(path, options);
    let text = Text::new(path, bytes, &mut collector.report)?;
    let mut fields = Vec::new();
    let mut vertices: Vec<Numbered> = Vec::new();
    for line in text.lines() {
        Separator::Blanks.split(line.text, &mut fields);
        let row = Row::new(path, &line, &fields);
        let kind = fields.first().and_then(|tag| Vertex::of(tag));
        let Some(kind) = kind else { continue };
        let columns = kind.columns();
        if row.is_cut_off(columns, None) {
            collector.report.truncated_tail += 1;
            continue;
        }
        if row.len() != columns {
            return Err(row.wrong_length(
                format!("{columns} fields"),
                "a vertex is `VERTEX_SE3:QUAT id x y z qx qy qz qw`, `VERTEX3 id x y z roll pitch yaw` or `VERTEX_SE2 id x y theta`",
            ));
        }
        let id = match row.fields()[1].parse() {
            Ok(id) => id,
            Err(_) => row.number(1, "the number of the vertex")?.max(0.0) as u64,
        };
        let mut add = |found| {
            vertices.push(Numbered {
                number: id,
                place: row.place(),
                row: Some(line.number as u64),
                found,
            });
        };
        if row.fields()[2..].iter().any(|field| is_no_value(field))
            && collector.looks_for(LostKind::Nan)
        {
            add(Err(LostKind::Nan));
            continue;
        }
        let (x, y) = (row.coordinate(2, "x")?, row.coordinate(3, "y")?);
        let number = |column, name| row.number(column, name);
        let found = match kind {
            Vertex::Planar => {
                let yaw = number(4, "theta")?;
                pose(euler_rotation(0.0, 0.0, yaw), [x, y, 0.0])
            }
            Vertex::Angles => {
                let (roll, pitch) = (number(5, "roll")?, number(6, "pitch")?);
                let rotation = euler_rotation(roll, pitch, number(7, "yaw")?);
                pose(rotation, [x, y, row.coordinate(4, "z")?])
            }
            Vertex::Quaternion => {
                let [x_part, y_part, z_part, w] =
                    [5, 6, 7, 8].map(|column| number(column, "the quaternion"));
                let rotation = collector.quaternion(row.place(), w?, x_part?, y_part?, z_part?)?;
                pose(rotation, [x, y, row.coordinate(4, "z")?])
            }
        };
        add(Ok(found));
    }
    choose_robot(path, &mut vertices, options)?;
    let sorted = vertices.is_sorted_by_key(|vertex| vertex.number);
    vertices.sort_by_key(|vertex| vertex.number);
    let text = if sorted {
        "vertices taken in order of their numbers"
    } else {
        "vertices sorted by their numbers"
    };
    collector
        .report
        .remarks
        .push(Remark::new(RemarkKind::Columns, text));
    finish(collector, Format::G2o, vertices)
}

/// Images in order of their names: COLMAP writes them in order of registration.
pub(crate) fn read_colmap(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    let mut collector = Collector::new(path, options);
    let text = Text::new(path, bytes, &mut collector.report)?;
    // Every second line holds points of an image and may be empty, so blank lines count here.
    let mut images: Vec<(String, Numbered)> = Vec::new();
    let mut fields = Vec::new();
    let mut points = false;
    for (index, content) in text.as_str().split_inclusive('\n').enumerate() {
        let line = Line {
            number: index + 1,
            text: content.trim(),
            unterminated: !content.ends_with('\n'),
        };
        if is_comment(line.text) {
            continue;
        }
        if points {
            points = false;
            continue;
        }
        if line.text.is_empty() {
            continue;
        }
        Separator::Blanks.split(line.text, &mut fields);
        let row = Row::new(path, &line, &fields);
        if row.is_cut_off(10, None) {
            collector.report.truncated_tail += 1;
            continue;
        }
        if row.len() < 10 {
            return Err(row.wrong_length(
                "10 fields",
                "an image is `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, then a line of points",
            ));
        }
        let q = [
            row.number(1, "QW")?,
            row.number(2, "QX")?,
            row.number(3, "QY")?,
            row.number(4, "QZ")?,
        ];
        let rotation = collector.quaternion(row.place(), q[0], q[1], q[2], q[3])?;
        let translation = [
            row.coordinate(5, "TX")?,
            row.coordinate(6, "TY")?,
            row.coordinate(7, "TZ")?,
        ];
        let name = fields[9..].join(" ");
        let image = Numbered {
            number: number_in(&name),
            place: row.place(),
            row: Some(line.number as u64),
            found: Ok(pose(rotation, translation).inverse()),
        };
        images.push((name, image));
        points = true;
    }
    // The counts of Text are of a format without empty lines.
    collector.report.blank_lines = 0;
    images.sort_by(|a, b| a.0.cmp(&b.0));
    let words = "poses are those of the cameras (the file's world-to-camera, inverted), in order of the images' names; lengths are in the scale of the reconstruction";
    collector
        .report
        .remarks
        .push(Remark::new(RemarkKind::Columns, words));
    let images = images.into_iter().map(|(_, image)| image).collect();
    finish(collector, Format::Colmap, images)
}

#[derive(Deserialize)]
struct Transforms {
    frames: Vec<Frame>,
}

#[derive(Deserialize)]
struct Frame {
    #[serde(default)]
    file_path: String,
    transform_matrix: Vec<Vec<Option<f64>>>,
    #[serde(default)]
    time: Option<f64>,
}

/// The frames of `transforms.json` in order of their file names, where those are numbered.
pub(crate) fn read_transforms(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    let mut collector = Collector::new(path, options);
    collector.rows_are(RowKind::Record);
    let text = Text::new(path, bytes, &mut collector.report)?;
    let file: Transforms = serde_json::from_str(text.as_str()).map_err(|fault| {
        let place = if fault.line() > 0 {
            Place::Line(fault.line())
        } else {
            Place::File
        };
        Error::input(
            path,
            place,
            "a list `frames` of objects with a `transform_matrix`",
            fault.to_string(),
            "is the file cut off?",
        )
    })?;
    let mut order: Vec<usize> = (0..file.frames.len()).collect();
    let named = file.frames.iter().all(|frame| !frame.file_path.is_empty());
    if named {
        order.sort_by_key(|index| (number_in(&file.frames[*index].file_path), *index));
    }
    let words = "camera axes are those of NeRF (x right, y up, z backward); frames in order of the numbers in their file names";
    collector
        .report
        .remarks
        .push(Remark::new(RemarkKind::Columns, words));
    if file.frames.iter().any(|frame| frame.time.is_some()) {
        let words = "the frames' `time` is a share of the clip, not a stamp, and is not used";
        collector
            .report
            .remarks
            .push(Remark::new(RemarkKind::Columns, words));
    }
    let mut poses = Vec::new();
    for index in order {
        let matrix = &file.frames[index].transform_matrix;
        let place = Place::Pose(index);
        if !(3..=4).contains(&matrix.len()) || matrix.iter().any(|row| row.len() != 4) {
            let found = format!("{} rows", matrix.len());
            return Err(Error::input(
                path,
                place,
                "a 4x4 or 3x4 matrix",
                found,
                "is this a NeRF file?",
            ));
        }
        let entry = |row: usize, column: usize| match matrix.get(row) {
            Some(row) => row[column].unwrap_or(f64::NAN),
            None => [0.0, 0.0, 0.0, 1.0][column],
        };
        poses.push(Numbered {
            number: number_in(&file.frames[index].file_path),
            place,
            row: None,
            found: pose_or_lost(&mut collector, path, place, entry)?,
        });
    }
    finish(collector, Format::Transforms, poses)
}

/// The last number in a file name, for the order of frames.
fn number_in(name: &str) -> u64 {
    let stem = name.rsplit('/').next().unwrap_or(name);
    let digits: Vec<&str> = stem
        .split(|c: char| !c.is_ascii_digit())
        .filter(|part| !part.is_empty())
        .collect();
    digits
        .last()
        .and_then(|digits| digits.parse().ok())
        .unwrap_or(0)
}

/// Blocks of a line with three whole numbers and four lines of a matrix.
pub(crate) fn read_open3d(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    let mut collector = Collector::new(path, options);
    collector.rows_are(RowKind::Record);
    let text = Text::new(path, bytes, &mut collector.report)?;
    let lines: Vec<Line<'_>> = text.lines().filter(|line| !is_comment(line.text)).collect();
    let mut fields = Vec::new();
    let mut poses = Vec::new();
    for block in lines.chunks(5) {
        if block.len() < 5 {
            collector.report.truncated_tail += 1;
            break;
        }
        let mut values = Matrix4::default();
        let mut cut = false;
        for (row_index, line) in block[1..].iter().enumerate() {
            Separator::Blanks.split(line.text, &mut fields);
            let row = Row::new(path, line, &fields);
            if row.is_cut_off(4, None) {
                cut = true;
                break;
            }
            if row.len() != 4 {
                return Err(row.wrong_length("4 numbers", "an Open3D pose is a line of three whole numbers, then four lines of a 4x4 matrix"));
            }
            for (column, value) in values[row_index].iter_mut().enumerate() {
                let field = row.field(column, "the matrix")?;
                *value = if is_no_value(field) {
                    f64::NAN
                } else {
                    row.number(column, "the matrix")?
                };
            }
        }
        if cut {
            collector.report.truncated_tail += 1;
            break;
        }
        let number = block[0].text.split_whitespace().next();
        let place = Place::Line(block[0].number);
        let entry = |row: usize, column: usize| values[row][column];
        poses.push(Numbered {
            number: number.and_then(|field| field.parse().ok()).unwrap_or(0),
            place,
            row: None,
            found: pose_or_lost(&mut collector, path, place, entry)?,
        });
    }
    finish(collector, Format::Open3d, poses)
}

type Matrix4 = [[f64; 4]; 4];
