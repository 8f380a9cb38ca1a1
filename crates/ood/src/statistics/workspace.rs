//! Buffers that statistics of increments are computed in.

use super::linear::{Channels, Residual};
use super::twist::Twist;

/// What statistics of increments need on the way. Whoever computes them window by window keeps one: after the first
/// window of a length nothing is allocated any more. Holds nothing that a result depends on.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    pub(super) series: Vec<f64>,
    pub(super) first: Vec<f64>,
    pub(super) second: Vec<f64>,
    pub(super) twists: Vec<Twist>,
    pub(super) channels: Vec<Channels>,
    pub(super) residuals: Vec<Residual>,
}
