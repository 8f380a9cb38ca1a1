//! IROS20 6-D pose tracking (Wen et al. 2020): object poses in a camera frame, as one stream of `.npy` arrays
//! or as a folder with one 4x4 text file per frame.

use std::fs;
use std::path::{Path, PathBuf};

use dose3_lie::{Matrix, Pose};

use super::collect::{Collector, pose};
use super::npy::{NpyFault, Stream};
use super::table::{Row, Separator, check_coordinate, is_no_value};
use super::text::Text;
use crate::error::Place;
use crate::{
    Error, Format, Frame, LoadOptions, LoadReport, LostKind, ReadOption, Remark, RemarkKind,
    RowKind, Trajectory,
};

/// Largest deviation of the last row from (0, 0, 0, 1).
const LAST_ROW_TOLERANCE: f64 = 1e-6;

/// Reads arrays of shape (4, 4) one after another until the end of the file.
pub(crate) fn read_stream(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    let mut collector = Collector::new(path, options);
    collector.rows_are(RowKind::Record);
    let mut stream = Stream::new(bytes);
    let mut count = 0;
    while !stream.is_empty() {
        let place = Place::Array(count);
        let array = match stream.take() {
            Ok(array) => array,
            Err(NpyFault::Truncated) if count > 0 => {
                collector.report.truncated_tail += 1;
                break;
            }
            Err(fault) => return Err(npy_error(path, place, fault)),
        };
        let [4, 4] = *array.shape() else {
            let hint = "a stream has a 4x4 matrix for each pose; one array of many poses is the format npy";
            let found = format!("the shape {:?}", array.shape());
            return Err(
                Error::input(path, place, "an array of shape (4, 4)", found, hint)
                    .option(ReadOption::Format),
            );
        };
        let entry = |row: usize, column: usize| array.get(&[row, column]);
        push_matrix(&mut collector, Format::Iros20, path, place, entry)?;
        count += 1;
    }
    collector.finish_without_stamps(Format::Iros20)
}

/// The error for a damaged array.
pub(crate) fn npy_error(path: &Path, place: Place, fault: NpyFault) -> Error {
    match fault {
        NpyFault::Truncated => Error::input(
            path,
            place,
            "a whole array",
            "the end of the file",
            "the file is cut off; copy it again",
        ),
        NpyFault::NotNpy(found) => Error::input(
            path,
            place,
            "a numpy array",
            found,
            "is this the right file and format?",
        ),
        NpyFault::Dtype(found) => Error::input(
            path,
            place,
            "numbers of dtype f4 or f8",
            format!("dtype `{found}`"),
            "save the poses with numpy as float32 or float64",
        ),
        NpyFault::Records(found) => Error::input(
            path,
            place,
            "an array (n,) of records with numbers of dtype f4, f8, i4, i8 or dates under the names of a pose",
            found,
            "convert the fields of the pose with numpy's astype",
        ),
    }
}

/// Takes the next matrix of a log without stamps, or counts it as lost.
pub(crate) fn push_matrix(
    collector: &mut Collector<'_>,
    format: Format,
    path: &Path,
    place: Place,
    entry: impl Fn(usize, usize) -> f64,
) -> Result<(), Error> {
    let row = collector.seen() as u64;
    let stamp = collector.next_nominal(format);
    match pose_or_lost(collector, path, place, entry)? {
        Ok(pose) => collector.push_row(place, row, stamp, pose),
        Err(kind) => collector.lose(place, row, Some(stamp), kind),
    }
}

/// The pose of a matrix, or how it says that there is none.
pub(crate) fn pose_or_lost(
    collector: &mut Collector<'_>,
    path: &Path,
    place: Place,
    entry: impl Fn(usize, usize) -> f64,
) -> Result<Result<Pose, LostKind>, Error> {
    match lost(collector, &entry) {
        Some(kind) => Ok(Err(kind)),
        None => pose_from_matrix(collector, path, place, entry).map(Ok),
    }
}

/// How a matrix says that there is no pose.
fn lost(collector: &Collector<'_>, entry: &impl Fn(usize, usize) -> f64) -> Option<LostKind> {
    let cells = || (0..3).flat_map(|row| (0..4).map(move |column| (row, column)));
    if cells().any(|(row, column)| !entry(row, column).is_finite()) {
        return collector.looks_for(LostKind::Nan).then_some(LostKind::Nan);
    }
    let zero = cells().all(|(row, column)| column == 3 || entry(row, column).abs() < 1e-6);
    (zero && collector.looks_for(LostKind::Zero)).then_some(LostKind::Zero)
}

/// Checks a 4x4 matrix and takes it apart.
pub(crate) fn pose_from_matrix(
    collector: &mut Collector<'_>,
    path: &Path,
    place: Place,
    entry: impl Fn(usize, usize) -> f64,
) -> Result<Pose, Error> {
    let matrix = nalgebra::Matrix4::from_fn(entry);
    if matrix.iter().any(|value| !value.is_finite()) {
        let hint = "remove the poses without a value";
        return Err(Error::input(
            path,
            place,
            "finite numbers",
            "NaN or infinity",
            hint,
        ));
    }
    let last = matrix.row(3);
    let off = (last - nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0)).amax();
    if off > LAST_ROW_TOLERANCE {
        let found = format!("{} {} {} {}", last[0], last[1], last[2], last[3]);
        let hint = "is the matrix transposed?";
        return Err(Error::input(
            path,
            place,
            "0 0 0 1 as the last row of the matrix",
            found,
            hint,
        ));
    }
    let translation: [f64; 3] = std::array::from_fn(|row| matrix[(row, 3)]);
    for value in translation {
        check_coordinate(path, place, value)?;
    }
    let rotation = Matrix::from_fn(|row, column| matrix[(row, column)]);
    Ok(pose(
        collector.rotation(path, place, &rotation)?,
        translation,
    ))
}

/// Reads a folder with one text file per frame, named by the frame's number.
///
/// Missing numbers stay empty places in time at the nominal rate and are counted.
pub(crate) fn read_folder(path: &Path, options: &LoadOptions) -> Result<Trajectory, Error> {
    let frames = frame_files(path)?;
    let mut collector = Collector::new(path, options);
    collector.rows_are(RowKind::File);
    let Some(first) = frames.first().map(|(number, _)| *number) else {
        let hint = "the poses are in files like annotated_poses/0000000.txt";
        return Err(Error::input(
            path,
            Place::File,
            "one text file per pose",
            "none",
            hint,
        ));
    };
    let mut next = first;
    for (number, file) in &frames {
        // Two names of one number, like 1.txt and 0000001.txt, meet in the check of repeated stamps.
        collector.report.missing_frames += (number.saturating_sub(next)) as usize;
        next = number + 1;
        let mut report = LoadReport::default();
        let values = read_matrix(file, &mut report)?;
        collector.report.byte_order_mark |= report.byte_order_mark;
        collector.report.crlf_lines += report.crlf_lines;
        collector.report.blank_lines += report.blank_lines;
        let entry = |row: usize, column: usize| values[4 * row + column];
        let index = (number - first) as usize;
        let stamp = collector.nominal(Format::Iros20Poses, index);
        if let Some(kind) = lost(&collector, &entry) {
            collector.lose(Place::File, *number, Some(stamp), kind)?;
            continue;
        }
        let pose = pose_from_matrix(&mut collector, file, Place::File, entry)?;
        collector.push_row(Place::File, *number, stamp, pose)?;
    }
    let mut log = collector.finish_without_stamps(Format::Iros20Poses)?;
    if is_camera(path, &frames) {
        log.frame = Frame::CameraRdf;
        let text = "poses of a camera (right, down, forward), as 7-Scenes and ScanNet keep them";
        log.report
            .remarks
            .push(Remark::new(RemarkKind::Frame, text).option(ReadOption::Frame));
    }
    Ok(log)
}

/// True for the names of 7-Scenes (`seq-01/frame-000000.pose.txt`) and of ScanNet (`pose/0.txt`).
fn is_camera(folder: &Path, frames: &[(u64, PathBuf)]) -> bool {
    let scenes = |(_, file): &(u64, PathBuf)| file.to_string_lossy().ends_with(".pose.txt");
    folder.file_name().is_some_and(|name| name == "pose") || frames.iter().all(scenes)
}

/// The files of a folder whose name is a number, or `frame-`, a number and `.pose`, with that number, in its order.
pub(crate) fn frame_files(folder: &Path) -> Result<Vec<(u64, PathBuf)>, Error> {
    let entries = fs::read_dir(folder).map_err(|source| Error::io(folder, source))?;
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.map_err(|source| Error::io(folder, source))?.path();
        // At most nine digits: the stamps made from larger ones would leave the range of time.
        let number = path
            .file_stem()
            .and_then(|stem| stem.to_str())
            .map(|stem| {
                let inner = stem.strip_prefix("frame-");
                let inner = inner.and_then(|stem| stem.strip_suffix(".pose"));
                inner.unwrap_or(stem)
            })
            .filter(|stem| stem.len() <= 9 && stem.bytes().all(|byte| byte.is_ascii_digit()))
            .and_then(|stem| stem.parse().ok());
        if let Some(number) = number
            && path.extension().is_some_and(|extension| extension == "txt")
        {
            files.push((number, path));
        }
    }
    files.sort();
    Ok(files)
}

/// Reads the 16 numbers of one text file, four a line.
fn read_matrix(path: &Path, report: &mut LoadReport) -> Result<[f64; 16], Error> {
    let bytes = fs::read(path).map_err(|source| Error::io(path, source))?;
    let text = Text::new(path, &bytes, report)?;
    let mut values = [0.0; 16];
    let mut rows = 0;
    let mut fields = Vec::new();
    for line in text.lines() {
        Separator::Blanks.split(line.text, &mut fields);
        let row = Row::new(path, &line, &fields);
        if row.len() != 4 || rows == 4 {
            return Err(row.wrong_length(
                "four lines of 4 numbers",
                "the file of one pose is a 4x4 matrix",
            ));
        }
        for column in 0..4 {
            let field = row.field(column, "the matrix")?;
            values[4 * rows + column] = if is_no_value(field) {
                f64::NAN
            } else {
                row.number(column, "the matrix")?
            };
        }
        rows += 1;
    }
    if rows != 4 {
        let hint = "the file is cut off; remove it and the frame is counted as missing";
        return Err(Error::input(
            path,
            Place::File,
            "four lines of 4 numbers",
            format!("{rows} lines"),
            hint,
        ));
    }
    Ok(values)
}
