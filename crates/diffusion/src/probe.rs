//! Runs the noise estimator along the forward process: the raw material of every statistic.

use crate::error::{Error, check_len};
use crate::process::{Process, rotation_logs};
use crate::window::{Noise, Window};
use dose3_model::{Input, NoiseModel};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The noise estimators of both branches.
pub struct ModelPair {
    /// Translations, 3 channels in, 3 out.
    pub translation: Box<dyn NoiseModel>,
    /// Rotations, 9 channels in, 3 out.
    pub rotation: Box<dyn NoiseModel>,
}

/// Which windows share their noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseSharing {
    /// Every window has a draw of its own, keyed by its content (the paper's evaluation): the
    /// same window gets the same noise wherever it stands.
    #[default]
    PerWindow,
    /// All windows share the same draws (common random numbers): a statistic is then a fixed
    /// function of the window, and differences between windows are not blurred by the draw.
    Common,
}

/// How windows are noised when they are scored; stored in every detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProbeConfig {
    /// Number of diffusion steps used, evenly spread over the process's own.
    pub steps: usize,
    /// Noise draws per window; statistics are averaged over them.
    pub draws: usize,
    /// Seed of the draws.
    pub seed: u64,
    /// Own or common draws.
    pub sharing: NoiseSharing,
}

impl ProbeConfig {
    /// The steps of the process that are visited, ascending; first and last are always among
    /// them where more than one is used.
    pub fn step_indices(&self, total: usize) -> Vec<usize> {
        let used = self.steps.clamp(1, total);
        if used == 1 {
            return vec![total / 2];
        }
        (0..used)
            .map(|i| (i * (total - 1) + (used - 1) / 2) / (used - 1))
            .collect()
    }

    /// The noise of draw `draw` for `window`. Draws are independent: antithetic pairs were tried
    /// and told data sets apart less well (docs/RESULTS.md).
    pub fn noise(&self, process: &Process, window: Window<'_>, draw: usize) -> Noise {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let key = match self.sharing {
            NoiseSharing::PerWindow => content_key(window),
            NoiseSharing::Common => 0,
        };
        rng.set_stream(key.wrapping_add(draw as u64));
        let length = window.translation.len() / 3;
        Noise::draw(&mut rng, length, process.config().rotation_noise)
    }
}

/// FNV-1a over the window's numbers.
fn content_key(window: Window<'_>) -> u64 {
    window
        .translation
        .iter()
        .chain(window.rotation)
        .flat_map(|x| x.to_le_bytes())
        .fold(0xcbf2_9ce4_8422_2325, |h, b| {
            (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
        })
}

/// Which networks a trace runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branches {
    /// The translation branch; the rotation channels of the estimate are zero.
    Translation,
    /// Both branches.
    Both,
}

/// The estimates along the forward process for some windows at some draws each.
#[derive(Clone, Debug, PartialEq)]
pub struct Traces {
    /// Steps visited, ascending.
    pub steps: Vec<usize>,
    /// Draws a window.
    pub draws: usize,
    /// Poses a window.
    pub length: usize,
    /// `eps_hat`, `[windows, draws, steps, length, 6]`: translation x, y, z, rotation tangent
    /// x, y, z.
    pub eps_hat: Vec<f32>,
    /// The noise drawn, `[windows, draws, length, 6]`, shared by all steps.
    pub eps: Vec<f32>,
}

impl Traces {
    /// `eps_hat` of window `w` at the `d`-th draw, `[steps, length, 6]`.
    pub fn eps_hat(&self, w: usize, d: usize) -> &[f32] {
        let n = self.steps.len() * self.length * 6;
        &self.eps_hat[(w * self.draws + d) * n..][..n]
    }

    /// The noise of window `w` at the `d`-th draw, `[length, 6]`.
    pub fn eps(&self, w: usize, d: usize) -> &[f32] {
        let n = self.length * 6;
        &self.eps[(w * self.draws + d) * n..][..n]
    }
}

/// Runs the networks of `branches` on `windows`, noised by each of `draws` to every visited step,
/// in one batch over windows, draws and steps.
///
/// # Errors
/// [`Error::Shape`] where windows differ in length; whatever the networks refuse.
pub fn trace(
    models: &mut ModelPair,
    process: &Process,
    config: &ProbeConfig,
    windows: &[Window<'_>],
    draws: Range<usize>,
    branches: Branches,
) -> Result<Traces, Error> {
    let steps = config.step_indices(process.steps());
    let length = match windows.first() {
        Some(first) if !draws.is_empty() => first.length()?,
        _ => 0,
    };
    if length == 0 {
        return Ok(Traces {
            steps,
            draws: draws.len(),
            length,
            eps_hat: Vec::new(),
            eps: Vec::new(),
        });
    }
    let batch = windows.len() * draws.len() * steps.len();
    let mut translation = vec![0.0; batch * length * 3];
    let mut rotation = vec![0.0; batch * length * 9];
    let mut eps = vec![0.0; windows.len() * draws.len() * length * 6];
    let a_draw = steps.len() * length;
    windows
        .par_iter()
        .zip(translation.par_chunks_mut(draws.len() * a_draw * 3))
        .zip(rotation.par_chunks_mut(draws.len() * a_draw * 9))
        .zip(eps.par_chunks_mut(draws.len() * length * 6))
        .try_for_each(|(((window, translation), rotation), eps)| {
            check_len("window translation", length * 3, window.translation.len())?;
            check_len("window rotation", length * 9, window.rotation.len())?;
            let logs = match branches {
                Branches::Both => rotation_logs(window.rotation),
                Branches::Translation => Vec::new(),
            };
            for (d, draw) in draws.clone().enumerate() {
                let noise = config.noise(process, *window, draw);
                for (k, t) in steps.iter().enumerate() {
                    let i = d * a_draw + k * length;
                    let out = &mut translation[i * 3..(i + length) * 3];
                    process.noise_translations(window.translation, &noise, *t, out)?;
                    if branches == Branches::Both {
                        let out = &mut rotation[i * 9..(i + length) * 9];
                        process.noise_rotations(&logs, &noise, *t, out)?;
                    }
                }
                let out = &mut eps[d * length * 6..(d + 1) * length * 6];
                interleave(&noise.translation, &noise.rotation, out);
            }
            Ok::<_, Error>(())
        })?;
    let times: Vec<f32> = (0..batch).map(|b| steps[b % steps.len()] as f32).collect();
    let run = |model: &mut dyn NoiseModel, x: &[f32], out: &mut [f32]| {
        let input = Input {
            x,
            steps: &times,
            batch,
            length,
        };
        model.forward(input, out)
    };
    let (mut of_translation, mut of_rotation) =
        (vec![0.0; batch * length * 3], vec![0.0; batch * length * 3]);
    run(
        models.translation.as_mut(),
        &translation,
        &mut of_translation,
    )?;
    if branches == Branches::Both {
        run(models.rotation.as_mut(), &rotation, &mut of_rotation)?;
    }
    let mut eps_hat = vec![0.0; batch * length * 6];
    interleave(&of_translation, &of_rotation, &mut eps_hat);
    Ok(Traces {
        steps,
        draws: draws.len(),
        length,
        eps_hat,
        eps,
    })
}

fn interleave(translation: &[f32], rotation: &[f32], out: &mut [f32]) {
    for ((out, t), r) in out
        .chunks_exact_mut(6)
        .zip(translation.chunks_exact(3))
        .zip(rotation.chunks_exact(3))
    {
        out[..3].copy_from_slice(t);
        out[3..].copy_from_slice(r);
    }
}
