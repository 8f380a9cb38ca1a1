//! Small well-formed inputs of every kind, made here.

pub mod arguments;
pub mod binary;
pub mod detectors;
pub mod models;
pub mod recordings;
pub mod streams;
pub mod text;
pub mod words;

use dose3_datasets::Trajectory;
use dose3_datasets::synthetic::{Platform, trajectory};

/// The logs that seeds are written from.
fn logs() -> [Trajectory; 2] {
    [
        trajectory(Platform::Vehicle, 7, 24, 10.0),
        trajectory(Platform::Drone, 8, 24, 20.0),
    ]
}

/// One after another, all seeds of logs.
pub fn everything() -> Vec<Vec<u8>> {
    [
        text::kitti,
        text::tum,
        text::euroc,
        text::robotcar,
        text::csv,
        text::g2o,
        text::colmap,
        text::transforms,
        text::open3d,
        text::json,
        text::echo,
        binary::npy,
        binary::npz,
        binary::iros20,
        binary::ulog,
        recordings::mcap,
        recordings::bag,
        recordings::rosbag2,
    ]
    .iter()
    .flat_map(|seeds| seeds())
    .chain(packed())
    .collect()
}

/// Packed text.
fn packed() -> Vec<Vec<u8>> {
    let level = ruzstd::encoding::CompressionLevel::Fastest;
    let text = text::tum();
    let packed = text
        .iter()
        .map(|text| ruzstd::encoding::compress_to_vec(&text[..], level));
    packed.collect()
}
