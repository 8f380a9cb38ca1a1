//! How a stream is judged.

use crate::error::{Error, Result, Setting};
use crate::model_file::FASTEST;
use serde::{Deserialize, Serialize};

/// Longest pause that may be taken for motion, seconds.
const LONGEST_GAP: f64 = 3600.0;

/// Options of [`crate::Detector::stream`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StreamOptions {
    /// False alarms an hour that are allowed on logs like the trusted ones, above 0 and at most 60.
    pub alarms_per_hour: f64,
    /// Poses at the detector's rate from one window to the next; it divides the detector's stride, so that the windows of a
    /// verdict are among those of the stream. A quarter of the stride where `None`.
    pub every: Option<usize>,
    /// Poses a second that will come, at most 1e6; measured from the first ones where `None`.
    pub rate_hz: Option<f64>,
    /// Seconds without a pose that end a stretch. At most 3600; ten times the usual step, at least half a second, where `None`.
    pub max_gap_s: Option<f64>,
    /// Metres from one pose to the next that are a jump of the estimator's world, not a motion: reported, and the
    /// poses behind it begin a new stretch. A hundred times the model's usual step where `None`.
    pub reset_m: Option<f64>,
    /// Whether every window is answered, or alarms and events only.
    pub windows: bool,
}

impl Default for StreamOptions {
    fn default() -> Self {
        Self {
            alarms_per_hour: 1.0,
            every: None,
            rate_hz: None,
            max_gap_s: None,
            reset_m: None,
            windows: true,
        }
    }
}

impl StreamOptions {
    pub(super) fn check(&self, stride: usize) -> Result<()> {
        let above = |setting, value: Option<f64>| match value {
            // Written so that NaN fails as well.
            Some(v) if !(v > 0.0 && v.is_finite()) => {
                Err(Error::setting(setting, v, "a number above 0"))
            }
            _ => Ok(()),
        };
        above(Setting::Rate, self.rate_hz)?;
        if let Some(rate) = self.rate_hz.filter(|rate| *rate > FASTEST) {
            let found = format!("{rate:?}");
            return Err(Error::setting(Setting::Rate, found, "at most 1e6 Hz"));
        }
        above(Setting::Gap, self.max_gap_s)?;
        if let Some(gap) = self.max_gap_s.filter(|gap| *gap > LONGEST_GAP) {
            let expected = format!("at most {LONGEST_GAP} s: what lies between is interpolated");
            return Err(Error::setting(Setting::Gap, gap, expected));
        }
        above(Setting::Reset, self.reset_m)?;
        if !(self.alarms_per_hour > 0.0 && self.alarms_per_hour <= 60.0) {
            let expected = "above 0 and at most 60";
            return Err(Error::setting(
                Setting::AlarmsPerHour,
                self.alarms_per_hour,
                expected,
            ));
        }
        match self.every {
            Some(every) if every == 0 || !stride.is_multiple_of(every) => {
                let expected = format!("a divisor of the detector's stride, {stride}");
                Err(Error::setting(Setting::Every, every, expected))
            }
            _ => Ok(()),
        }
    }

    /// Poses from one window to the next.
    pub(super) fn every(&self, stride: usize) -> usize {
        let quarter = (1..=stride.div_ceil(4))
            .rev()
            .find(|e| stride.is_multiple_of(*e));
        self.every.or(quarter).unwrap_or(1)
    }
}
