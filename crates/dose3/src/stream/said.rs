//! What a stream says.

use super::{Alarm, Event};
use dose3_ood::Score;
use serde::{Deserialize, Serialize};

/// One thing that a stream has to say.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Said {
    /// A window was judged.
    Window(WindowResult),
    /// Something is wrong with the poses as they come.
    Event(Event),
    /// An alarm was raised, or ended.
    Alarm(Alarm),
}

/// What is said of one window.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowResult {
    /// Which window of the stream, from 0.
    pub number: u64,
    /// Stamp of its first pose, nanoseconds.
    pub first_stamp_ns: i64,
    /// Stamp of its last pose.
    pub last_stamp_ns: i64,
    /// As in a [`crate::report::WindowReport`]: higher is more out of distribution.
    pub score: Score,
    /// Share of held-out trusted windows with such a score or a higher one.
    pub p_value: f64,
    /// Whether the score is beyond the window threshold.
    pub beyond: bool,
    /// Chance of such a window among trusted ones, continued beyond the highest of them: what alarms rest on.
    pub chance: f64,
    /// How far it is: 0 is the median of trusted windows, 1 what one in a thousand reaches.
    pub excess: f64,
    /// Whether [`crate::Detector::judge`] would cut this window too.
    pub in_verdict: bool,
}
