//! What is fed, and what must hold of the answers.

mod arguments;
mod detectors;
mod models;
mod sound;
mod streams;
mod text;
mod words;

use crate::{Target, seeds};
use dose3_datasets::Format;
use text::read_as;

macro_rules! format {
    ($name:literal, $format:ident, $seeds:path, $dictionary:path) => {
        Target {
            name: $name,
            run: |bytes| read_as(bytes, Some(Format::$format)),
            seeds: $seeds,
            dictionary: $dictionary,
        }
    };
}

/// Every target.
pub const ALL: &[Target] = &[
    Target {
        name: "any",
        run: |bytes| read_as(bytes, None),
        seeds: seeds::everything,
        dictionary: seeds::words::TEXT,
    },
    format!("kitti", Kitti, seeds::text::kitti, seeds::words::TEXT),
    format!("tum", Tum, seeds::text::tum, seeds::words::TEXT),
    format!("euroc", Euroc, seeds::text::euroc, seeds::words::TEXT),
    format!(
        "robotcar",
        RobotCar,
        seeds::text::robotcar,
        seeds::words::TEXT
    ),
    format!("csv", Csv, seeds::text::csv, seeds::words::TEXT),
    format!("matrix", Matrix, seeds::text::kitti, seeds::words::TEXT),
    format!("g2o", G2o, seeds::text::g2o, seeds::words::GRAPHS),
    format!("colmap", Colmap, seeds::text::colmap, seeds::words::TEXT),
    format!(
        "transforms",
        Transforms,
        seeds::text::transforms,
        seeds::words::GRAPHS
    ),
    format!("open3d", Open3d, seeds::text::open3d, seeds::words::TEXT),
    format!("json", Json, seeds::text::json, seeds::words::GRAPHS),
    format!("echo", Echo, seeds::text::echo, seeds::words::GRAPHS),
    format!("npy", Npy, seeds::binary::npy, seeds::words::BINARY),
    format!("zip", Npz, seeds::binary::npz, seeds::words::BINARY),
    Target {
        name: "npz",
        run: |bytes| read_as(&seeds::binary::zip_of(bytes), Some(Format::Npz)),
        seeds: seeds::binary::arrays,
        dictionary: seeds::words::BINARY,
    },
    format!(
        "iros20",
        Iros20,
        seeds::binary::iros20,
        seeds::words::BINARY
    ),
    format!(
        "mcap",
        Mcap,
        seeds::recordings::mcap,
        seeds::words::RECORDINGS
    ),
    format!("bag", Bag, seeds::recordings::bag, seeds::words::RECORDINGS),
    format!(
        "rosbag2",
        Rosbag2,
        seeds::recordings::rosbag2,
        seeds::words::RECORDINGS
    ),
    format!("ulog", Ulog, seeds::binary::ulog, seeds::words::RECORDINGS),
    Target {
        name: "transform-tree",
        run: text::transform_tree,
        seeds: seeds::recordings::transforms,
        dictionary: seeds::words::RECORDINGS,
    },
    Target {
        name: "columns",
        run: text::columns,
        seeds: seeds::text::columns,
        dictionary: seeds::words::TEXT,
    },
    Target {
        name: "detector",
        run: detectors::file,
        seeds: seeds::detectors::files,
        dictionary: seeds::words::JSON,
    },
    Target {
        name: "detector-header",
        run: detectors::header,
        seeds: seeds::detectors::headers,
        dictionary: seeds::words::JSON,
    },
    Target {
        name: "words",
        run: words::settings,
        seeds: seeds::words::settings,
        dictionary: seeds::words::SETTINGS,
    },
    Target {
        name: "model",
        run: models::file,
        seeds: seeds::models::files,
        dictionary: seeds::words::JSON,
    },
    Target {
        name: "model-header",
        run: models::header,
        seeds: seeds::models::headers,
        dictionary: seeds::words::JSON,
    },
    Target {
        name: "stream",
        run: streams::poses,
        seeds: seeds::streams::sequences,
        dictionary: seeds::words::BINARY,
    },
    Target {
        name: "stream-state",
        run: streams::state,
        seeds: seeds::streams::states,
        dictionary: seeds::words::STATES,
    },
    Target {
        name: "arguments",
        run: arguments::arguments,
        seeds: seeds::arguments::lines,
        dictionary: seeds::words::ARGUMENTS,
    },
    Target {
        name: "list",
        run: arguments::logs,
        seeds: seeds::arguments::lists,
        dictionary: seeds::words::LINES,
    },
    Target {
        name: "pose-lines",
        run: arguments::poses,
        seeds: seeds::arguments::poses,
        dictionary: seeds::words::LINES,
    },
    Target {
        name: "poses",
        run: sound::poses,
        seeds: seeds::binary::poses,
        dictionary: seeds::words::BINARY,
    },
];
