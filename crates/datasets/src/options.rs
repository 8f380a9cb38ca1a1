//! How to read a log.

use std::path::PathBuf;

use crate::{Error, Format};

/// Settings of [`crate::load`], [`crate::discover`] and [`crate::load_all`].
#[derive(Debug, Clone, PartialEq)]
pub struct LoadOptions {
    /// Read as this format instead of finding it from the content.
    pub format: Option<Format>,
    /// Largest allowed entry of `|R^T R - I|` of a rotation matrix; default 1e-3,
    /// at most 0.5. Beyond it reading fails.
    pub rotation_tolerance: f64,
    /// Largest allowed deviation of a quaternion's norm from 1; default 1e-2,
    /// at most 0.5. Beyond it reading fails.
    pub quaternion_tolerance: f64,
    /// KITTI only: file with one stamp in seconds per pose. `None` looks for `NN_times.txt` beside the
    /// poses and `times.txt` in a sequence folder, and falls back to the nominal 10 Hz.
    pub times: Option<PathBuf>,
    /// A step between stamps longer than this many seconds ends a stretch. `None` is ten times the
    /// median step, but at least half a second.
    pub max_gap: Option<f64>,
}

impl LoadOptions {
    /// Refuses settings that would let NaN or nonsense through.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let fault = |what, expected, value: f64| {
            Err(Error::Parameter {
                what,
                expected,
                found: value.to_string(),
            })
        };
        if !(0.0..=0.5).contains(&self.rotation_tolerance) {
            return fault(
                "rotation tolerance",
                "between 0 and 0.5",
                self.rotation_tolerance,
            );
        }
        if !(0.0..=0.5).contains(&self.quaternion_tolerance) {
            return fault(
                "quaternion tolerance",
                "between 0 and 0.5",
                self.quaternion_tolerance,
            );
        }
        match self.max_gap {
            Some(gap) if gap.is_nan() || gap <= 0.0 => {
                fault("largest gap in seconds", "above 0", gap)
            }
            _ => Ok(()),
        }
    }
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            format: None,
            rotation_tolerance: 1e-3,
            quaternion_tolerance: 1e-2,
            times: None,
            max_gap: None,
        }
    }
}
