#![doc = include_str!("../README.md")]
//!
//! # Map
//! | to | see |
//! |---|---|
//! | read logs, or take poses from memory | [`load`], [`logs`], [`Trajectory`] |
//! | fit a detector, judge, save, load | [`Detector`], [`Report`] |
//! | draw a judged log pose by pose, beside what is trusted | [`Detector::series`], [`series`] |
//! | judge while a log is recorded | [`Stream`], [`stream`] |
//! | compute statistics of windows | [`Probe`] |
//! | train a model, draw from one | [`train`], [`generate`] |
//! | measure a detector on labelled logs | [`evaluate`] |
//! | many results as a table | [`table`] |
//!
//! Poses are `T_world_body` in metres, f64; stamps are integer nanoseconds; angles are radians; a higher score is
//! more out of distribution. The same input, seed and build give the same bytes for any number of threads. Nothing
//! here prints; errors are one type, [`Error`].

pub mod atomic;
pub mod backend;
pub mod built_in;
pub mod detector;
pub mod error;
pub mod evaluate;
pub mod generate;
pub mod joint;
pub mod logs;
pub mod model_file;
pub mod probe;
pub mod progress;
mod reasons;
pub mod report;
mod seal;
pub mod series;
pub mod stream;
pub mod table;
pub mod train;

pub use backend::{Backend, Computing};
pub use detector::{Detector, DetectorBuilder, FitOptions, Fitted, JudgeOptions};
pub use dose3_datasets::{Frame, Trajectory};
pub use dose3_lie::{Pose, nalgebra};
pub use dose3_ood::{Score, Verdict};
pub use error::{Error, Result, Setting};
pub use model_file::Model;
pub use probe::{Measured, Probe, ProbePlan};
pub use progress::Progress;
pub use report::{Reason, Report};
pub use series::Series;
pub use stream::{Monitor, Said, Stream, StreamOptions};

// The crates below, whose types stand in the interface.
pub use {dose3_datasets as datasets, dose3_diffusion as diffusion, dose3_lie as lie};
pub use {dose3_model as model, dose3_ood as ood};

use logs::ReadOptions;
use std::path::Path;

/// What most programs name.
pub mod prelude {
    pub use crate::{Detector, Frame, Pose, Report, Trajectory, Verdict};
}

/// Reads every log under the paths: files, or folders that are searched. Formats are told by content.
///
/// # Errors
/// A path without a log, the first log that cannot be read. [`logs::read`] takes what a user knows better.
///
/// ```no_run
/// let trusted = dose3::load(["trusted/", "more/log.txt"])?;
/// # Ok::<(), dose3::Error>(())
/// ```
pub fn load<P: AsRef<Path>>(paths: impl IntoIterator<Item = P>) -> Result<Vec<Trajectory>> {
    let paths: Vec<_> = paths
        .into_iter()
        .map(|p| p.as_ref().to_path_buf())
        .collect();
    logs::read(&paths, &ReadOptions::default())
}
