//! Ancestral sampling: new pose sequences from pure noise.

use crate::error::Error;
use crate::probe::ModelPair;
use crate::process::{Estimate, Process, State};
use crate::window::Noise;
use dose3_model::{Input, NoiseModel};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Settings of a sampling run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleConfig {
    /// Poses a sequence.
    pub length: usize,
    /// Seed of prior and fresh noise.
    pub seed: u64,
    /// Translations of `x0_hat` are clipped to `[-clip, clip]`: at the first steps
    /// `1 / sqrt(alpha_bar)` magnifies the network's error some hundred times.
    pub clip: f64,
}

/// Draws one sequence; `visit` sees the state before every step (noisiest first) and the result
/// (as step `None`).
///
/// # Errors
/// Whatever the networks refuse.
pub fn sample(
    models: &mut ModelPair,
    process: &Process,
    config: &SampleConfig,
    visit: &mut dyn FnMut(Option<usize>, &State),
) -> Result<State, Error> {
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    let kind = process.config().rotation_noise;
    let length = config.length;
    let mut state = process.prior(&Noise::draw(&mut rng, length, kind));
    for t in (0..process.steps()).rev() {
        visit(Some(t), &state);
        let run = |model: &mut dyn NoiseModel, x: &[f32]| -> Result<Vec<f32>, Error> {
            let mut out = vec![0.0; length * 3];
            model.forward(
                Input {
                    x,
                    steps: &[t as f32],
                    batch: 1,
                    length,
                },
                &mut out,
            )?;
            Ok(out)
        };
        let translation = run(models.translation.as_mut(), &state.translation)?;
        let rotation = run(models.rotation.as_mut(), &state.rotation)?;
        let estimate = Estimate {
            translation: &translation,
            rotation: &rotation,
        };
        let mut x0 = process.x0_hat(state.as_window(), estimate, t)?;
        let clip = config.clip as f32;
        x0.translation
            .iter_mut()
            .for_each(|x| *x = x.clamp(-clip, clip));
        let fresh = Noise::draw(&mut rng, length, kind);
        state = process.step_from_x0(x0.as_window(), state.as_window(), &fresh, t)?;
    }
    visit(None, &state);
    Ok(state)
}
