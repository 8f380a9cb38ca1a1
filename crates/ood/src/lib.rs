#![doc = include_str!("../README.md")]

pub mod alarm;
pub mod calibration;
pub mod density;
pub mod detector;
mod error;
pub mod fdr;
pub mod findings;
pub mod folds;
pub mod localise;
pub mod metrics;
pub mod ranges;
mod score;
mod special;
pub mod statistics;
pub mod timing;
mod verdict;

#[cfg(test)]
mod property_cases;

pub use calibration::{Combination, Reference, cross_fit};
pub use density::{Density, DensityConfig, DensityModel};
pub use detector::{DetectorConfig, DetectorStatistics, ExternalTest, LogVerdict, Place};
pub use error::Error;
pub use folds::{FoldPlan, Folds, Unit};
pub use localise::PoseReference;
pub use score::Score;
pub use statistics::{
    Accumulator, Group, PoseWindow, Sample, Statistic, StatisticsSet, Trace, TraceSummary,
    Workspace,
};
pub use verdict::Verdict;
