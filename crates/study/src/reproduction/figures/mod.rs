//! The figures of `cargo xtask benchmark --all`, as SVG text.

mod canvas;
mod epsilon;
mod kde;
mod legend;
mod palette;
mod panel;
mod plane;
mod reverse;
mod roc;
mod select;
mod simplify;
mod ticks;
mod trajectories;

use super::record::Curve;
use crate::sets::DataSet;
use dose3::Model;
use dose3::backend::Computing;
use dose3_ood::DensityConfig;

pub use epsilon::epsilon;
pub use reverse::reverse_diffusion;
pub use roc::roc;
pub use trajectories::trajectories;

/// A figure with what has to stand below it.
pub struct Figure {
    /// Its name in files.
    pub key: &'static str,
    /// A line that says what it shows.
    pub title: String,
    /// Exactly what is shown: model, sets, seed, numbers of windows, steps and draws.
    pub caption: String,
    /// The drawing.
    pub svg: String,
}

/// The ROC curves of one pair of sets.
#[derive(Clone, Debug, PartialEq)]
pub struct RocPanel {
    /// ID and OOD set, as in `K/O`.
    pub title: String,
    /// One curve a method.
    pub curves: Vec<Curve>,
}

/// What the figures are made from.
pub struct FigureInput<'a> {
    /// The data sets, prepared for the window length of `kitti`.
    pub sets: &'a [DataSet],
    /// A model of the paper's representation, trained on KITTI.
    pub kitti: &'a Model,
    /// The same trained on RobotCar; the figure that needs it is left out without.
    pub oxford: Option<&'a Model>,
    /// Density over the statistics.
    pub density: &'a DensityConfig,
    /// Seed of all noise.
    pub seed: u64,
    /// Where the networks run; figures do not depend on it.
    pub computing: Computing,
    /// At most so many windows of a set, evenly spread.
    pub max_windows: usize,
}

#[cfg(test)]
mod tests;
