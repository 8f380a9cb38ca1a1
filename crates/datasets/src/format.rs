//! The formats, body frames and rates of pose logs.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::Error;

/// How a log is written on disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// KITTI odometry ground truth: 12 numbers a line, row-major 3x4; times in a separate file.
    Kitti,
    /// Oxford RobotCar: `gps/ins.csv`, `gps/rtk.csv` (poses) or `vo/vo.csv` (relative poses).
    RobotCar,
    /// IROS20 6-D pose tracking: 4x4 `.npy` arrays one after another in one stream.
    Iros20,
    /// The original layout of the same data: a folder `annotated_poses` with one 4x4 text file per frame.
    Iros20Poses,
    /// TUM RGB-D: `timestamp tx ty tz qx qy qz qw`, seconds and metres.
    Tum,
    /// EuRoC MAV: `state_groundtruth_estimate0/data.csv`, nanoseconds, quaternion with w first.
    Euroc,
    /// Text with a pose a line whose columns are told by a header or by the data: csv, tsv, estimator output.
    Csv,
    /// Text with the 3x4 or 4x4 matrix of a pose a line, with or without a stamp before it.
    Matrix,
    /// One `.npy` array of poses: `(n, 4, 4)`, `(n, 3, 4)`, `(n, 12)`, `(n, 16)`, `(n, 7)` or `(n, 8)`, or of
    /// records with named fields.
    Npy,
    /// A `.npz` file: several `.npy` arrays, each under a name.
    Npz,
    /// A pose graph: the lines `VERTEX_SE3:QUAT` (or `VERTEX_SE2`) of a g2o file.
    G2o,
    /// COLMAP `images.txt`: world to camera, two lines an image.
    Colmap,
    /// NeRF `transforms.json`: a list of camera-to-world matrices.
    Transforms,
    /// JSON with a list of poses, or an object a line.
    Json,
    /// Messages as `rostopic echo` and `ros2 topic echo` print them.
    Echo,
    /// Open3D `.log`: three numbers, then a 4x4 matrix.
    Open3d,
    /// An MCAP recording of ROS 1 or ROS 2.
    Mcap,
    /// A ROS 1 bag.
    Bag,
    /// A ROS 2 bag in SQLite, or a folder with `metadata.yaml`.
    Rosbag2,
    /// A flight log of PX4: many topics, of which some hold poses.
    Ulog,
    /// Poses that were in memory. Not a member of [`Format::ALL`].
    Memory,
    /// Made by [`crate::synthetic`], not read from a file. Not a member of [`Format::ALL`].
    Synthetic,
}

impl Format {
    /// The formats that can be read.
    pub const ALL: [Self; 20] = [
        Self::Kitti,
        Self::RobotCar,
        Self::Iros20,
        Self::Iros20Poses,
        Self::Tum,
        Self::Euroc,
        Self::Csv,
        Self::Matrix,
        Self::Npy,
        Self::Npz,
        Self::G2o,
        Self::Colmap,
        Self::Transforms,
        Self::Open3d,
        Self::Json,
        Self::Echo,
        Self::Mcap,
        Self::Bag,
        Self::Rosbag2,
        Self::Ulog,
    ];

    /// The name used on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kitti => "kitti",
            Self::RobotCar => "robotcar",
            Self::Iros20 => "iros20",
            Self::Iros20Poses => "iros20-poses",
            Self::Tum => "tum",
            Self::Euroc => "euroc",
            Self::Csv => "csv",
            Self::Matrix => "matrix",
            Self::Npy => "npy",
            Self::Npz => "npz",
            Self::G2o => "g2o",
            Self::Colmap => "colmap",
            Self::Transforms => "transforms",
            Self::Open3d => "open3d",
            Self::Json => "json",
            Self::Echo => "echo",
            Self::Mcap => "mcap",
            Self::Bag => "bag",
            Self::Rosbag2 => "rosbag2",
            Self::Ulog => "ulog",
            Self::Memory => "memory",
            Self::Synthetic => "synthetic",
        }
    }

    /// True for recordings of ROS.
    pub fn is_recording(self) -> bool {
        matches!(self, Self::Mcap | Self::Bag | Self::Rosbag2)
    }

    /// The body frame that the data set defines.
    pub fn frame(self) -> Frame {
        match self {
            Self::Kitti | Self::Colmap => Frame::CameraRdf,
            Self::RobotCar | Self::Ulog => Frame::BodyFrd,
            Self::Iros20 | Self::Iros20Poses => Frame::Object,
            Self::Synthetic => Frame::BodyFlu,
            // These come from any camera, marker or IMU; the file does not say which.
            _ => Frame::Sensor,
        }
    }

    /// Rate in hertz that the data set is known for where the file has no stamps.
    pub fn nominal_rate(self) -> Option<f64> {
        match self {
            Self::Kitti => Some(10.0),
            Self::Iros20 | Self::Iros20Poses => Some(30.0),
            _ => None,
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Format {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL
            .into_iter()
            .find(|format| format.name().eq_ignore_ascii_case(text))
            .ok_or_else(|| Error::UnknownName {
                what: "format",
                found: text.to_owned(),
                expected: Self::ALL.map(Self::name).join(", "),
            })
    }
}

/// What the axes of the moving body are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Frame {
    /// A camera: x right, y down, z forward.
    CameraRdf,
    /// A vehicle: x forward, y right, z down.
    BodyFrd,
    /// A vehicle: x forward, y left, z up.
    BodyFlu,
    /// Axes defined by the model of a tracked object.
    Object,
    /// A sensor of unknown mounting.
    Sensor,
}

impl Frame {
    /// All frames.
    pub const ALL: [Self; 5] = [
        Self::CameraRdf,
        Self::BodyFrd,
        Self::BodyFlu,
        Self::Object,
        Self::Sensor,
    ];

    /// The name used on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::CameraRdf => "camera-rdf",
            Self::BodyFrd => "body-frd",
            Self::BodyFlu => "body-flu",
            Self::Object => "object",
            Self::Sensor => "sensor",
        }
    }

    /// True where forward, left and up are known, so that logs of different sensors can be compared by axis.
    pub fn has_forward(self) -> bool {
        matches!(self, Self::CameraRdf | Self::BodyFrd | Self::BodyFlu)
    }

    /// The rotation that takes coordinates in this frame to forward-left-up coordinates of the same body
    /// (`v_flu = C v`). Identity where the frame defines no forward.
    pub fn to_forward_left_up(self) -> dose3_lie::Rotation {
        let rows = match self {
            Self::CameraRdf => [0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0],
            Self::BodyFrd => [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0],
            Self::BodyFlu | Self::Object | Self::Sensor => {
                [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
            }
        };
        // A signed permutation of determinant 1: a rotation without any numerical projection.
        dose3_lie::Rotation::from_matrix_unchecked(dose3_lie::Matrix::from_row_slice(&rows))
    }
}

impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Frame {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL
            .into_iter()
            .find(|frame| frame.name().eq_ignore_ascii_case(text))
            .ok_or_else(|| Error::UnknownName {
                what: "frame",
                found: text.to_owned(),
                expected: Self::ALL.map(Self::name).join(", "),
            })
    }
}

/// Where a rate comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum RateSource {
    /// One over the median step of the log's own stamps.
    Stamps,
    /// The rate the data set is known for; the file itself has no stamps.
    Nominal,
    /// Said by the user, [`crate::LoadOptions::rate`].
    Given,
    /// Nobody knows: the file has no stamps and its format no rate. [`Rate::UNKNOWN_HERTZ`] is put in.
    Unknown,
}

impl Rate {
    /// What stands for a rate that nobody knows.
    pub const UNKNOWN_HERTZ: f64 = 10.0;
}

/// Poses a second.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Poses a second, positive and finite.
    pub hertz: f64,
    /// Where the number comes from.
    pub source: RateSource,
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.source {
            RateSource::Stamps => write!(f, "{:.2} Hz", self.hertz),
            RateSource::Nominal => {
                write!(f, "{:.2} Hz (nominal, the file has no stamps)", self.hertz)
            }
            RateSource::Given => write!(f, "{:.2} Hz (as given)", self.hertz),
            RateSource::Unknown => {
                write!(f, "{:.2} Hz (unknown, the file has no stamps)", self.hertz)
            }
        }
    }
}
