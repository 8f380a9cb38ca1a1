//! Statistics of the noise estimator, and of the poses themselves, as named, composable sets.
//!
//! A [`StatisticsSet`] turns one window into a fixed vector of numbers. Every entry has a name such as
//! `rotation_z.sum_eps^3` and belongs to one [`Group`]: its block where the set has several, else one
//! such as `paper24.rotation_z`.
//!
//! | name | numbers | groups | from |
//! |---|---|---|---|
//! | `paper24` | 24 | translation pooled over xyz; rotation x; y; z | trace |
//! | `paper12` | 12 | translation pooled; rotation pooled ("no split") | trace |
//! | `r3` | 6 | translation pooled | trace |
//! | `diffpath6` | 6 | all six channels pooled, as DiffPath-6D does in a Euclidean space | trace |
//! | `diffpath1` | 1 | root of the summed squared changes of eps_hat between steps (DiffPath-1D) | trace |
//! | `residual` | 36 | log mean denoising error per axis in 6 noise bands | trace |
//! | `residual-quantiles` | 72 | as `residual`, poses pooled by the 0.9 quantile and the maximum | trace |
//! | `eps-mean` | 36 | mean of eps_hat per axis in 6 noise bands | trace |
//! | `change` | 36 | log mean squared change of eps_hat between steps, per axis in 6 noise bands | trace |
//! | `moments24` | 24 | raw moments of the represented poses (a baseline without a network) | poses |
//! | `kinematic` | 36 | body velocity, angular rate and their differences (a baseline without a network) | increments |
//! | `differences` | 36 | quantiles of the first and second differences of velocity and rate (no network) | increments |
//! | `lin` | 36 | quantiles of what a linear prediction of each axis from the others leaves over (no network) | increments, [`LinearPredictor`] |
//! | `joint`, `joint-given`, `joint-quantiles`, `joint-elbo` | 24, 24, 96, 6 | denoising errors of the joint network, and those given other axes | [`JointErrors`] |
//! | `joint-score` | 42 | slopes of the joint network's log-likelihood along mixed axes and delays | [`JointScore`] |
//! | `cc` | 28 | correlation of pairs of axes and its lag (no network) | increments |
//!
//! Members joined by `+` share one density. A set may also hold blocks, separated by commas:
//! `kinematic,differences,residual+eps-mean`. Each block has a density of its own, and a
//! [`Combination`](crate::calibration::Combination) makes one score of them.

mod bands;
mod correlation;
mod differences;
mod joint;
mod joint_score;
mod kinematic;
mod linear;
mod moments;
mod paper;
mod path;
mod quantile;
mod scale;
mod set;
mod statistic;
mod trace;
pub(crate) mod twist;
mod workspace;

pub use bands::BANDS;
pub(crate) use joint::POSE_NUMBERS as JOINT_POSE_NUMBERS;
pub use joint::{JointErrors, JointView, SCORE_VIEW, VIEWS};
pub use joint_score::JointScore;
pub use linear::{Deviation, LinearPredictor, LinearReference, Regressors};
pub use moments::PoseWindow;
pub use quantile::quantile_sorted;
pub use scale::axis_scale;
pub use set::{Group, Sample, StatisticsSet};
pub use statistic::Statistic;
pub use trace::{Accumulator, CHANNELS, StepMoments, Trace, TraceSummary};
pub use twist::{Twist, halfway};
pub use workspace::Workspace;

/// Names of the six channels, in the order of the last axis of `eps_hat`.
pub const AXES: [&str; CHANNELS] = [
    "translation_x",
    "translation_y",
    "translation_z",
    "rotation_x",
    "rotation_y",
    "rotation_z",
];

/// A column before it is placed in a set: the part it belongs to and its full name.
struct Column {
    part: &'static str,
    name: String,
}
