//! Synthetic logs of three platforms: enough physics that windows of one look like each other and unlike the
//! others, and nothing of any real data set. They are the default of the benchmark where no data is given.
//!
//! The same platform, seed, number of poses and rate give the same bytes; different seeds give logs that differ in
//! the platform's parameters (speeds, wheel base, reach of the hand, ...) as well as in the course.

mod drone;
mod handheld;
mod signal;
mod vehicle;

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use dose3_lie::Pose;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::{Error, Format, Frame, Rate, RateSource, Trajectory};

/// Poses a second of [`suite`]; one rate for all platforms, so that the rate gives none of them away.
pub const SUITE_HERTZ: f64 = 20.0;
/// The inner simulation runs at least this fast.
const SIMULATION_HERTZ: f64 = 200.0;

/// What moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Platform {
    /// A car on roads: bicycle-model steering, smooth speed with stops, roll, pitch and heave on its suspension.
    /// World z up, body forward-left-up.
    Vehicle,
    /// An object turned and moved by a hand in front of a camera (camera frame z forward), with pauses.
    Handheld,
    /// A multicopter: its thrust axis follows from the acceleration, its heading is free. World z up, body
    /// forward-left-up.
    Drone,
}

impl Platform {
    /// All platforms.
    pub const ALL: [Self; 3] = [Self::Vehicle, Self::Handheld, Self::Drone];

    /// The name used on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vehicle => "vehicle",
            Self::Handheld => "handheld",
            Self::Drone => "drone",
        }
    }

    /// The body frame of its logs.
    pub fn frame(self) -> Frame {
        match self {
            Self::Vehicle | Self::Drone => Frame::BodyFlu,
            Self::Handheld => Frame::Object,
        }
    }
}

impl fmt::Display for Platform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Platform {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL
            .into_iter()
            .find(|platform| platform.name() == text)
            .ok_or_else(|| Error::UnknownName {
                what: "platform",
                found: text.to_owned(),
                expected: Self::ALL.map(Self::name).join(", "),
            })
    }
}

/// One log of `poses` poses at `hertz`; a rate that is not positive and finite is taken as [`SUITE_HERTZ`].
///
/// ```
/// use dose3_datasets::synthetic::{Platform, trajectory};
///
/// let log = trajectory(Platform::Drone, 3, 400, 30.0);
/// assert_eq!(log.len(), 400);
/// assert_eq!(log.fingerprint(), trajectory(Platform::Drone, 3, 400, 30.0).fingerprint());
/// ```
pub fn trajectory(platform: Platform, seed: u64, poses: usize, hertz: f64) -> Trajectory {
    let hertz = if hertz.is_finite() && hertz > 0.0 {
        hertz
    } else {
        SUITE_HERTZ
    };
    // Every platform has its own stream, so that seed 1 of one is unrelated to seed 1 of another.
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(platform as u64 + 1);
    let clock = Clock::new(poses, hertz);
    let poses = match platform {
        Platform::Vehicle => vehicle::simulate(&clock, &mut rng),
        Platform::Handheld => handheld::simulate(&clock, &mut rng),
        Platform::Drone => drone::simulate(&clock, &mut rng),
    };
    let name = format!("synthetic-{platform}-{seed}");
    Trajectory {
        group: name.clone(),
        name,
        path: PathBuf::new(),
        format: Format::Synthetic,
        frame: platform.frame(),
        rate: Rate {
            hertz,
            source: RateSource::Stamps,
        },
        stamps: (0..poses.len())
            .map(|index| (index as f64 * 1e9 / hertz).round() as i64)
            .collect(),
        rows: (0..poses.len() as u64).collect(),
        row_kind: crate::RowKind::Record,
        stamp_unit: Some(crate::StampUnit::Nanoseconds),
        source: None,
        poses,
        breaks: Vec::new(),
        max_gap: None,
        report: crate::LoadReport::default(),
    }
}

/// `logs` logs of one platform at [`SUITE_HERTZ`], 1,200 to 2,400 poses each, named `synthetic-vehicle-00`, ...
pub fn suite(platform: Platform, logs: usize, seed: u64) -> Vec<Trajectory> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(100 + platform as u64);
    (0..logs)
        .map(|index| {
            let poses = rng.random_range(1200..=2400);
            let mut log = trajectory(platform, rng.random(), poses, SUITE_HERTZ);
            log.name = format!("synthetic-{platform}-{index:02}");
            log.group.clone_from(&log.name);
            log
        })
        .collect()
}

/// The times of a simulation: `poses` outputs, `substeps` inner steps of `step` seconds from one to the next.
struct Clock {
    poses: usize,
    substeps: usize,
    step: f64,
}

impl Clock {
    fn new(poses: usize, hertz: f64) -> Self {
        let substeps = (SIMULATION_HERTZ / hertz).ceil().clamp(1.0, 1e6) as usize;
        Self {
            poses,
            substeps,
            step: 1.0 / (hertz * substeps as f64),
        }
    }

    /// Calls `advance` for every inner step and takes what `output` gives at each pose.
    fn run<S>(
        &self,
        mut state: S,
        mut advance: impl FnMut(&mut S, f64),
        mut output: impl FnMut(&mut S) -> Pose,
    ) -> Vec<Pose> {
        let mut poses = Vec::with_capacity(self.poses);
        for index in 0..self.poses {
            if index > 0 {
                for _ in 0..self.substeps {
                    advance(&mut state, self.step);
                }
            }
            poses.push(output(&mut state));
        }
        poses
    }
}
