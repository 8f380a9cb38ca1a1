//! Settings of a fit, and what a model is best used with.

use crate::model_file::Model;
use dose3_datasets::Kind;
use dose3_diffusion::NoiseSharing;
use dose3_ood::{Combination, DensityConfig, StatisticsSet};

/// The statistics of the default detector: a test of kinematics, robust differences and what a linear prediction
/// leaves over, and one of how the axes go together; a density for each block.
pub const MOTION_STATISTICS: &str = "kinematic,differences,lin/cc";
/// Shares of alpha of its tests.
pub const MOTION_SHARES: [f64; 2] = [0.75, 0.25];

/// What a model is best used with where the user says nothing; measured by
/// `cargo xtask benchmark --faults --part validation` (docs/METHOD.md).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defaults {
    /// The statistics.
    pub statistics: &'static str,
    /// Shares of alpha of their tests; equal ones where `None`.
    pub shares: Option<&'static [f64]>,
    /// Diffusion steps visited.
    pub steps: usize,
    /// Noise draws per window.
    pub draws: usize,
}

impl Defaults {
    /// The paper's statistics for a `paper` model, [`MOTION_STATISTICS`] for a `motion` model.
    #[must_use]
    pub fn of(model: &Model) -> Self {
        let steps = model.header.process.steps;
        match model.header.representation.kind {
            Kind::Paper => Self {
                statistics: "paper24",
                shares: None,
                steps,
                draws: 2,
            },
            Kind::Motion => Self {
                statistics: MOTION_STATISTICS,
                shares: Some(&MOTION_SHARES),
                steps: steps.min(12),
                draws: 1,
            },
        }
    }
}

/// Settings of a fit. What is `None` is what the model is best used with ([`Defaults`]).
#[derive(Clone, Debug, PartialEq)]
pub struct FitOptions {
    /// The statistics, in blocks with a density each.
    pub statistics: Option<StatisticsSet>,
    /// The density over them.
    pub density: DensityConfig,
    /// How the blocks become one score; by default Fisher's sum for several, else one joint density.
    pub combination: Option<Combination>,
    /// Share of alpha of each test of the statistics, in (0, 1]; they sum to 1. By default those
    /// measured to be good for the default statistics, else equal ones.
    pub shares: Option<Vec<f64>>,
    /// Whether trusted logs that share a recording ([`dose3_datasets::overlaps`]) are one group, whatever their
    /// groups say.
    pub join_overlapping: bool,
    /// Whether the stamps of a log are compared with those of the trusted logs.
    pub timing: bool,
    /// Whether it is asked if position and attitude belong together as in the trusted logs.
    pub calibration: bool,
    /// Whether trusted logs that are unlike the others stay among what new logs are compared with.
    pub keep_all: bool,
    /// Share of trusted logs, and of trusted windows, that may be rejected, in (0, 1).
    pub alpha: f64,
    /// Poses between the starts of windows of the model's length; shorter ones start nearer in proportion.
    pub stride: usize,
    /// Rate at which logs are measured, hertz, 2 to 200; by default the model's, or where too few trusted logs reach
    /// that, theirs. Faster logs are interpolated down to it, slower ones refused.
    pub rate: Option<f64>,
    /// Steps of a window, at least 32; by default as many as the model's, or fewer where too few trusted logs are as
    /// long. Logs that are too short for them are judged in windows of [`SHORT_STEPS`](super::SHORT_STEPS).
    pub window: Option<usize>,
    /// Diffusion steps visited, at most the model's.
    pub steps: Option<usize>,
    /// Noise draws a window, over which statistics are averaged.
    pub draws: Option<usize>,
    /// Whether windows share their noise.
    pub noise: NoiseSharing,
    /// Seed of noise and fit.
    pub seed: u64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            statistics: None,
            density: DensityConfig::default(),
            combination: None,
            shares: None,
            join_overlapping: true,
            timing: true,
            calibration: true,
            keep_all: false,
            alpha: 0.05,
            stride: 32,
            rate: None,
            window: None,
            steps: None,
            draws: None,
            noise: NoiseSharing::Shared,
            seed: 0,
        }
    }
}
