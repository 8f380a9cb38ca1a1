//! How to read a log.

use std::path::PathBuf;

use crate::{Columns, Error, Format, LostKind, StampUnit};

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
    /// Unit of the stamps in the file. `None` is what the header says, else what the size of the numbers says.
    pub stamp_unit: Option<StampUnit>,
    /// Poses a second of files without stamps, or whose stamps are none (an index, all the same). Replaces the
    /// stamps.
    pub rate: Option<f64>,
    /// Which columns of a text file hold the pose. `None` is what the header or the data say.
    pub columns: Option<Columns>,
    /// The column of a text table, by its name in the header or its number from 1, whose values tell several logs
    /// apart: one log a value, named so. Other formats have no columns and are read as ever.
    pub log_column: Option<String>,
    /// What marks rows without a pose. Empty: NaN and zero rotations, and the identity where the log jumps to it
    /// and back. Given kinds are the only ones looked for, and `Identity` then means every identity.
    pub lost: Vec<LostKind>,
    /// Lost tracking is an error instead of a gap.
    pub strict: bool,
    /// Topics of a recording; the topic, rigid body, list or array of a table, JSON or npz file with several. Empty: the only one with
    /// poses; the usual one of a flight log.
    pub topics: Vec<String>,
    /// Parent and child frame of a pose to be looked up in the transforms of a recording; those of a printed
    /// transform.
    pub tf: Option<(String, String)>,
    /// Take the time a message was recorded for its stamp, not the one in its header.
    pub record_time: bool,
}

impl LoadOptions {
    /// Refuses settings that would let NaN or nonsense through.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let fault = |what, expected, value: f64| {
            Err(Error::Parameter {
                what,
                expected,
                // A number of hundreds of digits is not to be read.
                found: format!("{value:?}"),
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
        if let Some(rate) = self.rate
            && !(rate > 0.0 && rate <= 1e6)
        {
            return fault("rate in hertz", "above 0 and at most 1e6", rate);
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
            stamp_unit: None,
            rate: None,
            columns: None,
            log_column: None,
            lost: Vec::new(),
            strict: false,
            topics: Vec::new(),
            tf: None,
            record_time: false,
        }
    }
}
