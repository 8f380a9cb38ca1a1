//! Is this pose log like the logs I trust? The library behind the `dose3` program: it wires the
//! crates of the workspace together. [`train`] makes a model, [`fit`] a detector from a model and
//! trusted logs without retraining, [`score`] judges logs.

pub mod atomic;
pub mod backend;
pub mod built_in;
pub mod detector_file;
pub mod error;
pub mod evaluate;
pub mod fit;
pub mod generate;
pub mod logs;
pub mod model_file;
pub mod probe;
pub mod progress;
pub mod score;
pub mod train;

pub use error::{Error, Result};
pub use model_file::Model;
pub use probe::{Measured, Probe, ProbePlan};
