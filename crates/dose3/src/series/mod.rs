//! What a log does, pose by pose, in plain quantities, beside what trusted logs do: for plots, recordings and words.
//!
//! ```
//! use dose3::series::{Axis, Quantity};
//! use dose3::{Detector, datasets::synthetic};
//!
//! let trusted = synthetic::suite(synthetic::Platform::Vehicle, 4, 1);
//! let detector = Detector::fit(&trusted)?;
//! let log = synthetic::trajectory(synthetic::Platform::Vehicle, 9, 600, 20.0);
//! let report = detector.judge(&log)?;
//! let series = detector.series(&log, &report)?;
//!
//! let sideways = series.column(Quantity::Velocity(Axis::Left)).unwrap();
//! assert_eq!(sideways.values.len(), series.len());
//! let trusted = sideways.trusted.unwrap();
//! assert!(trusted.poses.at(0.05) <= trusted.poses.at(0.95));
//! # Ok::<(), dose3::Error>(())
//! ```

mod grid;
mod motion;
mod quantity;
mod ranges;

pub(crate) use grid::{GRID_SPAN, GRID_STEP, grid};
pub(crate) use motion::Motion;
pub use quantity::{Axis, Part, Quantity, Unit};
pub(crate) use ranges::{Collector, WindowSummary, inner};
pub use ranges::{TrustedRange, TrustedRanges};

use crate::detector::Detector;
use crate::error::Result;
use crate::logs::conform;
use crate::report::Report;
use dose3_datasets::{Trajectory, stretches};
use dose3_lie::Pose;
use dose3_ood::Score;
use std::ops::Range;

/// A judged log pose by pose, at the rate it was judged at. All lists have one entry a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Stamps, nanoseconds.
    pub stamps: Vec<i64>,
    /// Rows of the user's file, counted as [`crate::report::JudgedLog::row_kind`] says; of a resampled log the row
    /// nearest in time.
    pub rows: Vec<u64>,
    /// Poses, `T_world_body`, metres, in the axes of the file.
    pub poses: Vec<Pose>,
    /// Scores of single poses, as [`crate::report::PoseScores`] has them; none where no window reaches.
    pub scores: Vec<Option<Score>>,
    /// The score that one trusted pose in a thousand exceeds.
    pub threshold: Option<Score>,
    /// Gap-free stretches, as ranges of poses: lines are not drawn from one to the next.
    pub stretches: Vec<Range<usize>>,
    /// The quantities, in the order of [`Quantity::all`]; none of a model that only counts poses where the log's rate is
    /// not known.
    pub columns: Vec<Column>,
}

/// One quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Which.
    pub quantity: Quantity,
    /// Of every pose, in the unit of the quantity; none at the beginning of a stretch and where it is not defined.
    pub values: Vec<Option<f64>>,
    /// The same in trusted logs; none in detectors of format 3 and older.
    pub trusted: Option<TrustedRange>,
}

impl Series {
    /// Number of poses.
    #[must_use]
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// Whether there is no pose.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stamps.is_empty()
    }

    /// A quantity by name.
    #[must_use]
    pub fn column(&self, quantity: Quantity) -> Option<&Column> {
        self.columns.iter().find(|c| c.quantity == quantity)
    }
}

impl Detector {
    /// A log that was judged, pose by pose: what it does, what trusted logs do, and the scores of `report`, which must
    /// be this detector's of the same log. One hour at 10 Hz takes about 20 MB.
    ///
    /// # Errors
    /// As [`Detector::judge`], for a log that cannot be judged.
    pub fn series(&self, log: &Trajectory, report: &Report) -> Result<Series> {
        let (log, _) = conform(log, &self.needs())?;
        let ranges = self.header().ranges.as_ref();
        let stretches = stretches(&log, log.max_gap);
        let known_rate = log.rate.source != dose3_datasets::RateSource::Unknown;
        let quantities = Quantity::all().filter(|_| known_rate);
        let mut columns: Vec<Column> = quantities
            .map(|quantity| Column {
                quantity,
                values: Vec::with_capacity(log.len()),
                trusted: ranges.and_then(|r| r.get(quantity)).copied(),
            })
            .collect();
        for stretch in &stretches {
            let poses = &log.poses[stretch.clone()];
            let motion = Motion::new(poses, log.frame, log.rate.hertz, self.linear())?;
            for column in &mut columns {
                column.values.extend(motion.column(column.quantity));
            }
        }
        let mut scores = report.poses.scores.clone();
        // A report that was read back holds no scores of poses.
        scores.resize(log.len(), None);
        let log = log.into_owned();
        Ok(Series {
            scores,
            threshold: report.poses.threshold,
            stretches,
            columns,
            stamps: log.stamps,
            rows: log.rows,
            poses: log.poses,
        })
    }
}
