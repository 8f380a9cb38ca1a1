//! Whether position and attitude of a log belong together as those of the trusted logs do.
//!
//! Two sensors, or two halves of one, make a pose; their calibration against each other shows in how velocity
//! follows from attitude. With u the step (seen from half-way) and w the turn of a pose, forward-left-up:
//!
//! | what is off | u changes by |
//! |---|---|
//! | position behind attitude by s seconds | -s (w x u + du) times the rate, and more for larger s |
//! | position of a point l metres away | w x l |
//! | attitude turned by d radians | -d x u |
//!
//! So five robust regressions (Huber) over a piece of about 1000 poses, 14 coefficients in all,
//!
//! ```text
//! u_y  on u_x, w_z, u_x w_z, w_x        u_z on u_x, w_y, u_x w_y, w_x
//! du_x on dw_z, dw_y      du_y on dw_z, dw_x      du_z on dw_y, dw_x
//! ```
//!
//! (d: from one pose to the next) are compared with the trusted logs': `z = |b - median| / sqrt(se^2 + tau^2)`, with
//! tau the root mean square by which a group of trusted logs is away from the median of the others. The largest z is
//! the statistic. Its chance is the larger of what a Student distribution says and of what trusted pieces show, each
//! judged by the other groups: a tail fitted to the largest of them, at least eight. Of a log of several pieces the
//! medians are judged. Nothing is called that a trusted piece shows too, and nothing at all where more than one in
//! twenty of the trusted pieces would be called by those of the other groups.
//!
//! What is named is the one cause that explains most of the weighted squares of these differences: a lever arm or a
//! mounting by the pattern that it makes over the coefficients, with its size by weighted least squares; an offset in
//! time by shifting the position back and forth and regressing again. At one steady speed v an offset of s seconds is a
//! lever arm of -v s metres, and cannot be told from it. A turn about the forward axis (roll) is not seen: it hardly
//! moves these coefficients. A log in feet, or with degrees for radians, changes all coefficients by its factor, and is
//! named so where that explains more than any of these causes.

mod explain;
mod finding;
mod piece;
mod reference;
mod regression;
mod tail;
mod units;

pub use finding::{CalibrationFinding, MeasuredAlarms, Unit};
pub use piece::{Axis, CalibrationPiece, Kind};
pub use reference::CalibrationReference;

#[cfg(test)]
mod tests;
