//! The models that ship with the program.

use crate::error::Result;
use crate::model_file::Model;

/// `paper` representation, trained on KITTI odometry by `cargo xtask train-release-model`.
const PAPER: &[u8] = include_bytes!("../weights/kitti-paper.dose3");
/// `motion` representation, trained on KITTI, RobotCar and IROS20 logs by
/// `cargo xtask train-release-model --recipe motion`.
const MOTION: &[u8] = include_bytes!("../weights/motion.dose3");

/// The model of the paper's windows.
///
/// # Errors
/// Never with the file that was compiled in; a test holds it to that.
pub fn paper() -> Result<Model> {
    read(PAPER)
}

/// The model of body-frame motion, which a fit uses unless told otherwise.
///
/// # Errors
/// Never with the file that was compiled in; a test holds it to that.
pub fn motion() -> Result<Model> {
    read(MOTION)
}

fn read(bytes: &[u8]) -> Result<Model> {
    Ok(Model::from_bytes(bytes)?.0)
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
