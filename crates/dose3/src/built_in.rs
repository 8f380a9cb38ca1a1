//! The models that ship with the program.

use crate::model_file::Model;
use anyhow::{Context, Result};

/// `paper` representation, trained on KITTI odometry by `cargo xtask train-release-model`.
const PAPER: &[u8] = include_bytes!("../weights/kitti-paper.dose3");
/// `motion` representation, trained on KITTI, RobotCar and IROS20 logs by
/// `cargo xtask train-release-model --recipe motion`.
const MOTION: &[u8] = include_bytes!("../weights/motion.dose3");

/// The model of the paper's protocol.
///
/// # Errors
/// Never with the file that was compiled in; a test holds it to that.
pub fn paper() -> Result<Model> {
    read(PAPER, "the built-in model `paper`")
}

/// The model of body-frame motion, which `dose3 fit` uses unless told otherwise.
///
/// # Errors
/// Never with the file that was compiled in; a test holds it to that.
pub fn motion() -> Result<Model> {
    read(MOTION, "the built-in model `motion`")
}

fn read(bytes: &[u8], name: &'static str) -> Result<Model> {
    let (model, _) = Model::from_bytes(bytes).context(name)?;
    Ok(model)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_datasets::Kind;

    #[test]
    fn the_built_in_models_can_be_read() {
        assert_eq!(paper().unwrap().header.representation.kind, Kind::Paper);
        assert_eq!(motion().unwrap().header.representation.kind, Kind::Motion);
    }
}
