//! One `.npy` array of poses: matrices, positions with quaternions, or records of fields with names.

use std::fmt::Write as _;
use std::path::Path;

use super::collect::Collector;
use super::iros20::{npy_error, push_matrix};
use super::npy::{Array, Stream, Structured};
use super::records;
use crate::error::Place;
use crate::{Error, Format, LoadOptions, RowKind, Trajectory};

/// True for a file whose first array is a single 4x4 matrix: a stream of the IROS20 data.
pub(crate) fn is_stream(bytes: &[u8]) -> bool {
    match (Structured::new(bytes), Stream::new(bytes).shape()) {
        (None, Ok(shape)) => shape == [4, 4],
        (records, _) => records.is_none(),
    }
}

pub(crate) fn read(path: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Trajectory, Error> {
    let fault = |fault| npy_error(path, Place::Array(0), fault);
    if let Some(found) = Structured::new(bytes) {
        let found = found.map_err(fault)?;
        if options.columns.is_none() {
            found.check().map_err(fault)?;
        }
        return records::read(path, vec![found.list("")], None, Format::Npy, options);
    }
    let array = Stream::new(bytes).take().map_err(fault)?;
    let mut collector = Collector::new(path, options);
    collector.rows_are(RowKind::Record);
    match *array.shape() {
        [count, rows @ (3 | 4), 4] => {
            for index in 0..count as usize {
                let entry = |row: usize, column: usize| match (row, rows) {
                    (3, 3) => [0.0, 0.0, 0.0, 1.0][column],
                    _ => array.get(&[index, row, column]),
                };
                push_matrix(&mut collector, Format::Npy, path, Place::Pose(index), entry)?;
            }
            collector.finish_without_stamps(Format::Npy)
        }
        [count, width @ (12 | 16)] => {
            for index in 0..count as usize {
                let entry = |row: usize, column: usize| match (row, width) {
                    (3, 12) => [0.0, 0.0, 0.0, 1.0][column],
                    _ => array.get(&[index, 4 * row + column]),
                };
                push_matrix(&mut collector, Format::Npy, path, Place::Pose(index), entry)?;
            }
            collector.finish_without_stamps(Format::Npy)
        }
        [_, 7 | 8 | 13 | 17] => as_text(path, &array, options),
        _ => Err(Error::input(
            path,
            Place::Array(0),
            "an array of shape (n, 4, 4), (n, 3, 4), (n, 12), (n, 16), (n, 7) or (n, 8)",
            format!("the shape {:?}", array.shape()),
            "a pose is a matrix, or position and quaternion with or without a stamp; other shapes have to be converted first",
        )),
    }
}

/// Rows of numbers are what a text file without a header holds: the same rules tell their order and units.
fn as_text(path: &Path, array: &Array, options: &LoadOptions) -> Result<Trajectory, Error> {
    let (count, width) = (array.shape()[0], array.shape()[1]);
    let mut text = String::new();
    for row in 0..count as usize {
        for column in 0..width as usize {
            // Writing to a String cannot fail.
            let _ = write!(text, "{} ", array.get(&[row, column]));
        }
        text.push('\n');
    }
    records::read_table(path, &text, 0, None, Format::Npy, options)
}
