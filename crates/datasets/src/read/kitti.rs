//! KITTI odometry ground truth: 12 numbers a line, the row-major 3x4 of `T_world_camera`.

use std::path::{Path, PathBuf};

use dose3_lie::Matrix;

use super::collect::{Collector, nominal_stamp, pose};
use super::table::Row;
use super::text::Text;
use crate::error::Place;
use crate::{Error, Format, LoadOptions, LoadReport, StampUnit, Trajectory};

const COLUMNS: usize = 12;
const NOMINAL_HERTZ: f64 = 10.0;

pub(crate) fn read(path: &Path, options: &LoadOptions) -> Result<Trajectory, Error> {
    let mut collector = Collector::new(path, options);
    let text = Text::read(path, &mut collector.report)?;
    let mut rows = Vec::new();
    for line in text.lines() {
        let row = Row::spaces(path, &line);
        if row.is_cut_off(COLUMNS) {
            collector.report.truncated_tail += 1;
            continue;
        }
        if row.len() != COLUMNS {
            let hint = "a KITTI line is the row-major 3x4 matrix of a pose; --format chooses another format";
            return Err(row.wrong_length("12 numbers", hint));
        }
        let mut value = [0.0; COLUMNS];
        for (column, value) in value.iter_mut().enumerate() {
            *value = if column % 4 == 3 {
                row.coordinate(column, "the translation")?
            } else {
                row.number(column, "the rotation")?
            };
        }
        let [a, b, c, x, d, e, f, y, g, h, i, z] = value;
        let rotation =
            collector.rotation(path, row.place(), &Matrix::new(a, b, c, d, e, f, g, h, i))?;
        rows.push((line.number, pose(rotation, [x, y, z])));
    }
    let Some(times) = times_path(path, options) else {
        for (index, (line, pose)) in rows.into_iter().enumerate() {
            collector.push(Place::Line(line), nominal_stamp(index, NOMINAL_HERTZ), pose)?;
        }
        return collector.finish_nominal(Format::Kitti, NOMINAL_HERTZ);
    };
    let stamps = read_times(&times)?;
    // A cut-off last pose leaves its stamp without a partner.
    let expected = rows.len() + collector.report.truncated_tail;
    if stamps.len() != expected && stamps.len() != rows.len() {
        return Err(Error::input(
            &times,
            Place::File,
            format!("{expected} stamps, one for each pose of {}", path.display()),
            stamps.len().to_string(),
            "the times belong to another sequence, or one of the two files is cut off; \
             without a times file the nominal 10 Hz is taken",
        ));
    }
    for ((row, pose), (line, stamp)) in rows.into_iter().zip(stamps) {
        // The stamps are the part that can be out of order: errors name the times file.
        if let Some((last, _)) = collector.last()
            && stamp < last
        {
            return Err(Error::input(
                &times,
                Place::Line(line),
                format!("a stamp after {last} ns"),
                format!("{stamp} ns"),
                "sort the poses by their stamps, or cut the log where the clock was reset",
            ));
        }
        collector.push_row(Place::Line(line), row as u64, stamp, pose)?;
    }
    collector.stamps_in(StampUnit::Seconds);
    collector.finish(Format::Kitti)
}

/// The stamps of a times file in nanoseconds, with their line numbers.
fn read_times(path: &Path) -> Result<Vec<(usize, i64)>, Error> {
    let text = Text::read(path, &mut LoadReport::default())?;
    let mut stamps = Vec::new();
    for line in text.lines() {
        let row = Row::spaces(path, &line);
        if row.len() != 1 {
            return Err(row.wrong_length("one stamp in seconds", "this is not a KITTI times file"));
        }
        stamps.push((line.number, row.stamp(0, StampUnit::Seconds)?));
    }
    Ok(stamps)
}

/// The times file: the one named, else one that lies where KITTI and its users put it.
fn times_path(path: &Path, options: &LoadOptions) -> Option<PathBuf> {
    if options.times.is_some() {
        return options.times.clone();
    }
    let folder = path.parent()?;
    let stem = path.file_stem()?.to_str()?;
    let mut candidates = vec![folder.join(format!("{stem}_times.txt"))];
    if stem.bytes().all(|byte| byte.is_ascii_digit()) {
        // The official archive: poses/00.txt beside sequences/00/times.txt.
        candidates.extend(
            folder
                .parent()
                .map(|root| root.join("sequences").join(stem).join("times.txt")),
        );
    } else {
        candidates.push(folder.join("times.txt"));
    }
    candidates
        .into_iter()
        .find(|candidate| candidate != path && candidate.is_file())
}
