//! Out-of-distribution statistics, densities, calibration and metrics.

pub mod density;
mod error;
pub mod folds;
mod score;
mod special;
pub mod statistics;

pub use density::{Density, DensityConfig, DensityModel};
pub use error::Error;
pub use folds::{FoldPlan, Folds, Unit};
pub use score::Score;
pub use statistics::{
    Accumulator, Group, PoseWindow, Sample, Statistic, StatisticsSet, Trace, TraceSummary,
};
