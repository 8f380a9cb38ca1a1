//! From scores to verdicts: held-out trusted scores, thresholds, p-values, combinations of groups.
//!
//! A score says nothing by itself; what trusted logs score that the density has not seen says what it
//! means. [`cross_fit`] makes such scores, [`Reference`] turns a score into a p-value and an alpha
//! into a threshold, [`RunReference`] says how unusual the worst run of windows of a log is, and
//! [`Combination`] makes one score of several groups of statistics.

mod combine;
mod cross_fit;
mod erosion;
mod reference;
mod runs;
mod tails;

pub use combine::Combination;
pub(crate) use cross_fit::held_out;
pub use cross_fit::{CrossFit, cross_fit};
pub use erosion::{Duration, erode};
pub use reference::Reference;
pub use runs::{Run, RunReference, Stretch};
