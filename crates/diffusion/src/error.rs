//! What can go wrong in this crate.

use dose3_model::ModelError;

/// Errors of schedules, processes, training and probing.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A schedule's parameters cannot make a diffusion process.
    #[error("noise schedule: {0}")]
    Schedule(String),
    /// A slice does not have the size its shape asks for.
    #[error("{what}: expected {expected} numbers, found {found}")]
    Shape {
        /// Which tensor.
        what: &'static str,
        /// Numbers the shape asks for.
        expected: usize,
        /// Numbers given.
        found: usize,
    },
    /// A window could not be made.
    #[error("window: {0}")]
    Window(String),
    /// A training setting is out of its range.
    #[error("training: {name} is {found}, expected {expected}")]
    Config {
        /// The setting's name.
        name: &'static str,
        /// Its value.
        found: String,
        /// What is allowed.
        expected: &'static str,
    },
    /// Training left the finite numbers.
    #[error(
        "training: the {branch} branch's {what} stopped being finite at step {step}; \
         lower the learning rate or raise the warm-up (the last checkpoint is intact)"
    )]
    Diverged {
        /// `translation`, `rotation` or `joint`.
        branch: &'static str,
        /// What was not finite.
        what: &'static str,
        /// The optimiser step.
        step: usize,
    },
    /// A checkpoint does not fit the run that wants to resume from it.
    #[error("checkpoint {path}: {reason}")]
    Checkpoint {
        /// The file.
        path: String,
        /// Why it was refused.
        reason: String,
    },
    /// The network refused its input or parameters.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Whoever watched the training asked to end it.
    #[error("training: stopped before it was done")]
    Stopped,
}

/// Checks a slice's length against its shape.
pub(crate) fn check_len(what: &'static str, expected: usize, found: usize) -> Result<(), Error> {
    if expected == found {
        Ok(())
    } else {
        Err(Error::Shape {
            what,
            expected,
            found,
        })
    }
}
