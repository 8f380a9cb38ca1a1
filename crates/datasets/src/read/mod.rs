//! The readers: one file per format, and what they share.

mod collect;
mod euroc;
mod iros20;
mod kitti;
mod npy;
mod numbers;
mod records;
mod robotcar;
mod table;
mod text;
mod tum;

use std::path::Path;

use crate::{Error, Format, LoadOptions, Trajectory};

pub(crate) use collect::euler_rotation;
pub(crate) use iros20::frame_files;
pub(crate) use npy::write_4x4;
pub(crate) use text::{signature, split_fields};

/// Reads one log of a known format.
pub(crate) fn read(
    path: &Path,
    format: Format,
    options: &LoadOptions,
) -> Result<Trajectory, Error> {
    match format {
        Format::Kitti => kitti::read(path, options),
        Format::RobotCar => robotcar::read(path, options),
        Format::Iros20 => iros20::read_stream(path, options),
        Format::Iros20Poses => iros20::read_folder(path, options),
        Format::Tum => tum::read(path, options),
        Format::Euroc => euroc::read(path, options),
        Format::Synthetic => Err(Error::UnknownName {
            what: "format to read",
            found: format.to_string(),
            expected: Format::ALL.map(Format::name).join(", "),
        }),
    }
}
