//! The readers, from bytes: one file per kind of format, and what they share.

mod arrays;
mod collect;
pub(crate) mod columns;
mod dates;
mod echo;
mod graphs;
mod guess;
mod iros20;
mod json;
mod kitti;
mod layout;
mod motive;
mod npy;
mod npz;
pub(crate) mod numbers;
mod one_way;
mod order;
mod plausible;
mod records;
mod robotcar;
mod several;
mod sheet;
mod table;
mod text;
mod ulog;
mod unpack;

use std::path::Path;

use crate::error::Place;
use crate::{Error, Format, LoadOptions, ReadOption, Remark, RemarkKind, Trajectory};

pub(crate) use arrays::is_stream;
#[cfg(feature = "recordings")]
pub(crate) use collect::Collector;
pub(crate) use collect::euler_rotation;
pub(crate) use echo::detect as detect_echo;
pub(crate) use graphs::detect as detect_graph;
pub(crate) use iros20::{frame_files, read_folder};
pub(crate) use json::detect as detect_json;
pub(crate) use layout::{Layout, unknown};
pub(crate) use motive::detect as detect_motive;
pub(crate) use npy::write_4x4;
pub(crate) use npz::is_npz;
pub(crate) use table::LARGEST_COORDINATE;
pub(crate) use text::{Text, signature};
pub(crate) use ulog::MAGIC as ULOG;
pub(crate) use unpack::unpack;
#[cfg(feature = "recordings")]
pub(crate) use unpack::{broken, chunk_limit, zstd_chunk};

/// Reads the logs in the unpacked bytes of a file, each on its own: one, but for a table with a column that names its logs
/// and for a flight log of which several topics were asked for.
pub(crate) fn read_all(
    path: &Path,
    bytes: &[u8],
    format: Format,
    named: bool,
    options: &LoadOptions,
) -> Result<Vec<Result<Trajectory, Error>>, Error> {
    match (&options.log_column, format) {
        (
            Some(column),
            Format::Kitti | Format::Tum | Format::Euroc | Format::Csv | Format::Matrix,
        ) => several::read(path, bytes, named.then_some(format), column, options),
        (_, Format::Ulog) => Ok(ulog::read(path, bytes, options)?
            .into_iter()
            .map(Ok)
            .collect()),
        _ => Ok(vec![read(path, bytes, format, named, options)]),
    }
}

/// Whether the unpacked bytes of a file of this format hold poses: JSON and `.npz` files hold all kinds of things.
pub(crate) fn has_poses(path: &Path, bytes: &[u8], format: Format, options: &LoadOptions) -> bool {
    match format {
        Format::Json => json::has_poses(bytes, options),
        Format::Npz => npz::has_poses(path, bytes, options),
        _ => true,
    }
}

/// Reads the one log in the unpacked bytes of a file; `named` where the user said the format.
///
/// `path` is for messages and names; where it is a file, times may lie beside it.
fn read(
    path: &Path,
    bytes: &[u8],
    format: Format,
    named: bool,
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    if format == Format::Csv
        && let Ok(text) = std::str::from_utf8(bytes)
        && motive::detect(text)
    {
        let table = motive::table(path, text, options)?;
        let format = named.then_some(format);
        let mut log = sheet::read(path, table.text.as_bytes(), format, None, options)?;
        // The columns are those of the header that was made.
        log.report
            .remarks
            .retain(|remark| remark.kind != RemarkKind::Columns);
        let words = format!("the rigid body `{}` of a table of Motive", table.body);
        let remark = Remark::new(RemarkKind::Columns, words).option(ReadOption::Topic);
        log.report.remarks.push(remark);
        return Ok(log);
    }
    match format {
        Format::RobotCar => robotcar::read(path, bytes, options),
        Format::Iros20 => iros20::read_stream(path, bytes, options),
        Format::Npy => arrays::read(path, bytes, options),
        Format::G2o => graphs::read_g2o(path, bytes, options),
        Format::Colmap => graphs::read_colmap(path, bytes, options),
        Format::Transforms => graphs::read_transforms(path, bytes, options),
        Format::Open3d => graphs::read_open3d(path, bytes, options),
        Format::Npz => npz::read(path, bytes, options),
        Format::Echo => echo::read(path, bytes, options),
        Format::Json => json::read(path, bytes, options),
        Format::Kitti | Format::Tum | Format::Euroc | Format::Csv | Format::Matrix => {
            let times = match format {
                Format::Kitti => kitti::times_path(path, options),
                _ => None,
            };
            sheet::read(path, bytes, named.then_some(format), times, options)
        }
        Format::Iros20Poses => read_folder(path, options),
        Format::Mcap | Format::Bag | Format::Rosbag2 => Err(Error::input(
            path,
            Place::File,
            "poses",
            format!("a recording ({format})"),
            "this build does not read recordings; export the poses to a TUM file",
        )),
        Format::Ulog | Format::Memory | Format::Synthetic => Err(Error::UnknownName {
            what: "format to read",
            found: format.to_string(),
            expected: Format::ALL.map(Format::name).join(", "),
        }),
    }
}
