//! How far a long computation is.

use crate::error::{Error, Result};
use dose3_diffusion::trainer::LogRow;

/// Hears how far a computation is. Every method does nothing unless it is written; `()` hears nothing.
pub trait Progress {
    /// `done` of `total` windows of the logs at hand are measured.
    fn windows(&mut self, done: usize, total: usize) {
        let _ = (done, total);
    }

    /// The log of that name is judged.
    fn log(&mut self, name: &str) {
        let _ = name;
    }

    /// Training begins on so many windows, validated on so many.
    fn training(&mut self, training: usize, validation: usize) {
        let _ = (training, validation);
    }

    /// A training step is done.
    fn step(&mut self, row: &LogRow) {
        let _ = row;
    }

    /// Whether the computation should end here, with [`crate::Error::Stopped`]. Asked after each
    /// window and each training step.
    fn stop(&mut self) -> bool {
        false
    }
}

impl dyn Progress + '_ {
    /// Tells of measured windows.
    ///
    /// # Errors
    /// [`Error::Stopped`] where the listener has had enough.
    pub(crate) fn measured(&mut self, done: usize, total: usize) -> Result<()> {
        self.windows(done, total);
        match self.stop() {
            true => Err(Error::Stopped),
            false => Ok(()),
        }
    }
}

impl Progress for () {}

/// Hears training steps alone.
pub struct OnStep<F>(pub F);

impl<F: FnMut(&LogRow)> Progress for OnStep<F> {
    fn step(&mut self, row: &LogRow) {
        self.0(row);
    }
}

/// Hears measured windows alone, `(done, total)`.
pub struct OnWindow<F>(pub F);

impl<F: FnMut(usize, usize)> Progress for OnWindow<F> {
    fn windows(&mut self, done: usize, total: usize) {
        self.0(done, total);
    }
}
