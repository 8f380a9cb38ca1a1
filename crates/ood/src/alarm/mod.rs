//! When to raise a hand while a log is still being recorded.
//!
//! A verdict asks once, at the end of a log; a monitor asks at every window and must not cry wolf because it asks
//! often. So what is promised is a rate: on logs like the trusted ones at most so many alarms an hour.
//!
//! Every window has a chance `p`, the smallest `p_k / share_k` over the tests of the detector, each the conformal
//! p-value of the window's score among held-out trusted windows with the tail of
//! [`RunReference`](crate::calibration::RunReference). Watchers look at them, each with a share of the rate:
//!
//! - **one window** alone;
//! - **runs** of windows, two at least, as long as half and three quarters of one, as far apart as the trusted windows,
//!   by the lowest of their scores (the erosion of the verdict): what is weak but lasts;
//! - **evidence that adds up**: windows that share no step are bet on one after the other ([`ln_bet`], a p-to-e
//!   calibrator: its expectation is 1 for a uniform p), and the products are kept as a CUSUM, `W <- max(W, 1) e`. If
//!   the bets of a chain are e-values given the past, the mean time to a false alarm at `W >= A` is at least A windows
//!   (the e-detector of Shin, Ramdas and Rinaldo 2023, Lorden's bound for CUSUM). Windows overlap, so one chain takes
//!   every window that begins where its last one ended, and there are as many chains as windows that share a step;
//! - **single numbers** of few steps ([`SpanReference`]): what is plain in one of them and short.
//!
//! Sound logs have rough patches, in which windows that share no step depend on each other all the same. So every level
//! is the larger of two. One is what windows as independent as the trusted ones ask for: `ln(theta N / rate)` with N
//! windows an hour and their extremal index theta; for the sum, where nothing may cluster, `ln(N / rate)`. The other is
//! what the trusted logs themselves ask for: their held-out windows, in order, each compared with those of the other
//! groups only, are watched in the same way, and the rate of clusters of peaks is continued beyond the highest by
//! the predictive tail of the verdict ([`Peaks`]).
//!
//! A monitor looks more often than trusted windows lie; N counts the trusted ones, because windows a fraction of a stride
//! apart are nearly the same window. What this and the model of the tail cost is measured, on sound logs left out by
//! group (`docs/results/live.md`).

mod bet;
mod peaks;
mod reference;
mod span;
mod watch;

pub use bet::ln_bet;
pub use peaks::Peaks;
pub use reference::{AlarmBasis, AlarmConfig, AlarmReference, LevelBasis, RunLevel};
pub use span::{
    SPAN_NUMBERS, SpanLevels, SpanReference, SpanRow, SpanSeries, SpanStep, SpanWatch,
    SpanWorkspace, span_name, span_row,
};
pub use watch::{Change, RaisedBy, Watch, WatchStep};
