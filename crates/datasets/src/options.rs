//! How to read a log.

use std::path::PathBuf;

use crate::Format;

/// Settings of [`crate::load`], [`crate::discover`] and [`crate::load_all`].
#[derive(Debug, Clone, PartialEq)]
pub struct LoadOptions {
    /// Read as this format instead of finding it from the content.
    pub format: Option<Format>,
    /// Largest allowed entry of `|R^T R - I|` of a rotation matrix; default 1e-3. Beyond it reading fails.
    pub rotation_tolerance: f64,
    /// Largest allowed deviation of a quaternion's norm from 1; default 1e-2. Beyond it reading fails.
    pub quaternion_tolerance: f64,
    /// KITTI only: file with one stamp in seconds per pose. `None` looks for `NN_times.txt` beside the
    /// poses and `times.txt` in a sequence folder, and falls back to the nominal 10 Hz.
    pub times: Option<PathBuf>,
    /// A step between stamps longer than this many seconds ends a stretch. `None` is ten times the
    /// median step, but at least half a second.
    pub max_gap: Option<f64>,
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
