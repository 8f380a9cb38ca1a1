//! New pose sequences from a model.

use crate::error::{Error, Result};
use crate::model_file::Model;
use dose3_datasets::{Format, Frame, Kind, Trajectory};
use dose3_diffusion::{ModelPair, Process, SampleConfig, rotation_logs, sample};
use dose3_lie::{Pose, Vector, so3};

/// Draws one sequence and takes it out of the model's representation: a `paper` model gives
/// positions in units of the window's largest displacement, a `motion` model metres.
///
/// # Errors
/// A representation without stored constants where it needs them; a failing network.
pub fn sequence(model: &Model, models: &mut ModelPair, seed: u64) -> Result<Trajectory> {
    let process = Process::new(model.header.process)?;
    let config = SampleConfig {
        length: model.header.window,
        seed,
        clip: clip(model),
    };
    let state = sample(models, &process, &config, &mut |_, _| ())?;
    let rotations = rotation_logs(&state.rotation);
    let elements = state
        .translation
        .chunks_exact(3)
        .zip(&rotations)
        .map(|(t, log)| Pose {
            rotation: so3::exp(log),
            translation: Vector::new(t[0].into(), t[1].into(), t[2].into()),
        });
    let representation = model.header.representation;
    // Increments lie in forward-left-up axes where the model's frame defines them.
    let mut frame = model.header.frame;
    let poses: Vec<Pose> = match (representation.kind, representation.scaling.stored()) {
        (Kind::Paper, _) => elements.collect(),
        (Kind::Motion, Some((translation, rotation))) => {
            let (scale, factor) = (Vector::from(translation), Vector::from(rotation));
            if frame.has_forward() {
                frame = Frame::BodyFlu;
            }
            let mut at = Pose::identity();
            let mut poses = vec![at];
            for step in elements {
                at = at.compose(&Pose {
                    rotation: so3::exp(&so3::log(&step.rotation).component_div(&factor)),
                    translation: step.translation.component_mul(&scale),
                });
                poses.push(at);
            }
            poses
        }
        (Kind::Motion, None) => {
            let reason = format!("no stored constants ({:?})", representation.scaling);
            return Err(Error::unsound("model", reason));
        }
    };
    let stamp = |i: usize| (i as f64 / model.header.rate * 1e9).round() as i64;
    let stamps = (0..poses.len()).map(stamp).collect();
    let name = format!("sample_{seed}");
    Ok(Trajectory::new(
        name,
        Format::Synthetic,
        frame,
        stamps,
        poses,
    ))
}

/// `paper` positions lie in [-1, 1] by construction; increments have unit size.
fn clip(model: &Model) -> f64 {
    match model.header.representation.kind {
        Kind::Paper => 1.0,
        Kind::Motion => 8.0,
    }
}
