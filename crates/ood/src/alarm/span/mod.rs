//! A few steps looked at by single numbers.
//!
//! A density over many statistics of a window finds what is weak in each of them and strong together; what one number
//! shows plainly, and for a short time, it dilutes. So spans of few steps are looked at by plain numbers
//! ([`SPAN_NUMBERS`]): changes of the motion from step to step, how rough and how smooth it is, and its direction. Each
//! has a level of its own, which trusted logs pass so and so often an hour: the rate of clusters of its peaks in trusted
//! logs is continued by the tail of [`Peaks`](super::Peaks), and no level is lower than the farthest that any group of
//! trusted logs went when it was compared with the other groups only. The numbers share the rate equally (Bonferroni).

mod numbers;
mod reference;
mod watch;

pub use numbers::{SPAN_NUMBERS, SpanRow, SpanWorkspace, span_name, span_row};
pub use reference::{SpanLevels, SpanReference, SpanSeries};
pub use watch::{SpanStep, SpanWatch};
