//! The model that ships with the program.

use crate::model_file::Model;
use anyhow::{Context, Result};

/// Trained on KITTI odometry by `cargo xtask train-release-model`; see docs/RESULTS.md.
pub const MODEL: &[u8] = include_bytes!("../weights/kitti-paper.dose3");

/// The built-in model.
///
/// # Errors
/// Never with the file that was compiled in; a test holds it to that.
pub fn model() -> Result<Model> {
    let (model, _) = Model::from_bytes(MODEL).context("the built-in model")?;
    Ok(model)
}
