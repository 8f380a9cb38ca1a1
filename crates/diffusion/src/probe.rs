//! Runs the noise estimator along the forward process: the raw material of every statistic.

use crate::error::{Error, check_len};
use crate::process::{Process, rotation_logs};
use crate::window::{Noise, Window};
use dose3_model::{Input, NoiseModel};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

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

/// The estimates along the forward process for some windows at one draw each.
#[derive(Clone, Debug, PartialEq)]
pub struct Traces {
    /// Steps visited, ascending.
    pub steps: Vec<usize>,
    /// Poses a window.
    pub length: usize,
    /// `eps_hat`, `[windows, steps, length, 6]`: translation x, y, z, rotation tangent x, y, z.
    pub eps_hat: Vec<f32>,
    /// The noise drawn, `[windows, length, 6]`, shared by all steps of a window.
    pub eps: Vec<f32>,
}

impl Traces {
    /// `eps_hat` of window `w`, `[steps, length, 6]`.
    pub fn eps_hat(&self, w: usize) -> &[f32] {
        let n = self.steps.len() * self.length * 6;
        &self.eps_hat[w * n..(w + 1) * n]
    }

    /// The noise of window `w`, `[length, 6]`.
    pub fn eps(&self, w: usize) -> &[f32] {
        let n = self.length * 6;
        &self.eps[w * n..(w + 1) * n]
    }
}

/// Runs both networks on `windows`, noised by draw `draw` to every visited step, in one batch
/// over windows and steps.
///
/// # Errors
/// [`Error::Shape`] where windows differ in length; whatever the networks refuse.
pub fn trace(
    models: &mut ModelPair,
    process: &Process,
    config: &ProbeConfig,
    windows: &[Window<'_>],
    draw: usize,
) -> Result<Traces, Error> {
    let steps = config.step_indices(process.steps());
    let Some(first) = windows.first() else {
        return Ok(Traces {
            steps,
            length: 0,
            eps_hat: Vec::new(),
            eps: Vec::new(),
        });
    };
    let length = first.length()?;
    let batch = windows.len() * steps.len();
    let mut translation = vec![0.0; batch * length * 3];
    let mut rotation = vec![0.0; batch * length * 9];
    let mut eps = vec![0.0; windows.len() * length * 6];
    for (w, window) in windows.iter().enumerate() {
        check_len("window translation", length * 3, window.translation.len())?;
        check_len("window rotation", length * 9, window.rotation.len())?;
        let noise = config.noise(process, *window, draw);
        let logs = rotation_logs(window.rotation);
        for (k, t) in steps.iter().enumerate() {
            let b = w * steps.len() + k;
            process.forward_into(
                window.translation,
                &logs,
                &noise,
                *t,
                &mut translation[b * length * 3..(b + 1) * length * 3],
                &mut rotation[b * length * 9..(b + 1) * length * 9],
            )?;
        }
        let out = &mut eps[w * length * 6..(w + 1) * length * 6];
        interleave(&noise.translation, &noise.rotation, out);
    }
    let times: Vec<f32> = windows
        .iter()
        .flat_map(|_| steps.iter().map(|t| *t as f32))
        .collect();
    let run = |model: &mut dyn NoiseModel, x: &[f32]| -> Result<Vec<f32>, Error> {
        let mut out = vec![0.0; batch * length * 3];
        model.forward(
            Input {
                x,
                steps: &times,
                batch,
                length,
            },
            &mut out,
        )?;
        Ok(out)
    };
    let translation = run(models.translation.as_mut(), &translation)?;
    let rotation = run(models.rotation.as_mut(), &rotation)?;
    let mut eps_hat = vec![0.0; batch * length * 6];
    interleave(&translation, &rotation, &mut eps_hat);
    Ok(Traces {
        steps,
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
