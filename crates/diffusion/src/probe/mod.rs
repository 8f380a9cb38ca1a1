//! Runs the noise estimator along the forward process: the raw material of every statistic.

mod forward;
mod path;

use crate::error::{Error, check_len};
use crate::process::Process;
use crate::window::{Noise, Window};
use dose3_model::{Input, NoiseModel};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The noise estimators of both branches.
pub struct ModelPair {
    /// Translations, 3 channels in, 3 out.
    pub translation: Box<dyn NoiseModel>,
    /// Rotations, 9 channels in, 3 out.
    pub rotation: Box<dyn NoiseModel>,
}

/// Which noise windows are scored with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseSharing {
    /// Every window has a draw of its own, keyed by its content (the paper's evaluation): the
    /// same window gets the same noise wherever it stands.
    #[serde(alias = "per_window")]
    Own,
    /// All windows share the same draws (common random numbers): a statistic is then a fixed
    /// function of the window, and differences between windows are not blurred by the draw.
    #[default]
    #[serde(alias = "common")]
    Shared,
    /// No noise is drawn: the window follows the deterministic DDIM path from itself to noise, along
    /// the network's own estimates (DiffPath, arXiv 2405.11881). Seed and draws change nothing.
    None,
}

/// How windows are noised when they are scored; stored in every detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProbePlan {
    /// Number of diffusion steps used, evenly spread over the process's own.
    pub steps: usize,
    /// Noise draws per window; statistics are averaged over them.
    pub draws: usize,
    /// Seed of the draws.
    pub seed: u64,
    /// Own draws, shared ones, or none.
    pub sharing: NoiseSharing,
}

impl ProbePlan {
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

    /// How many of the draws differ: [`draws`](Self::draws), or 1 where none is drawn.
    pub fn distinct_draws(&self) -> usize {
        match self.sharing {
            NoiseSharing::Own | NoiseSharing::Shared => self.draws,
            NoiseSharing::None => self.draws.min(1),
        }
    }

    /// The noise of draw `draw` for `window`, zero where none is drawn. Draws are independent: antithetic pairs were tried
    /// and told data sets apart less well (docs/RESULTS.md).
    pub fn noise(&self, process: &Process, window: Window<'_>, draw: usize) -> Noise {
        let length = window.translation.len() / 3;
        let key = match self.sharing {
            NoiseSharing::Own => content_key(window),
            NoiseSharing::Shared => 0,
            NoiseSharing::None => return Noise::zeros(length),
        };
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(key.wrapping_add(draw as u64));
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
    /// The noise drawn, `[windows, draws, length, 6]`, shared by all steps; zero where none is.
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
/// in one batch over windows, draws and steps. With [`NoiseSharing::None`] each window follows its
/// DDIM path instead, one batch over windows a step, and the answer holds one draw whatever `draws`
/// asks for, unless it is empty.
///
/// # Errors
/// [`Error::Shape`] where windows differ in length; whatever the networks refuse.
pub fn trace(
    models: &mut ModelPair,
    process: &Process,
    config: &ProbePlan,
    windows: &[Window<'_>],
    draws: Range<usize>,
    branches: Branches,
) -> Result<Traces, Error> {
    let steps = config.step_indices(process.steps());
    let length = match windows.first() {
        Some(first) if !draws.is_empty() => first.length()?,
        _ => 0,
    };
    for window in windows.iter().filter(|_| length > 0) {
        check_len("window translation", length * 3, window.translation.len())?;
        check_len("window rotation", length * 9, window.rotation.len())?;
    }
    let draws = match config.sharing {
        NoiseSharing::Own | NoiseSharing::Shared => draws,
        NoiseSharing::None => 0..draws.len().min(1),
    };
    let task = Task {
        process,
        steps: &steps,
        windows,
        length,
        branches,
    };
    let (eps_hat, eps) = match config.sharing {
        _ if length == 0 => (Vec::new(), Vec::new()),
        NoiseSharing::Own | NoiseSharing::Shared => {
            forward::run(models, &task, config, draws.clone())?
        }
        NoiseSharing::None => (
            path::run(models, &task)?,
            vec![0.0; windows.len() * length * 6],
        ),
    };
    Ok(Traces {
        steps,
        draws: draws.len(),
        length,
        eps_hat,
        eps,
    })
}

/// What a trace is taken of.
struct Task<'a> {
    process: &'a Process,
    /// Steps visited, ascending.
    steps: &'a [usize],
    /// Windows of `length` poses each.
    windows: &'a [Window<'a>],
    length: usize,
    branches: Branches,
}

impl Task<'_> {
    /// The estimate for each of `times.len()` states, `[batch, length, 6]`; `rotation` is not read
    /// where its branch does not run.
    fn estimate(
        &self,
        models: &mut ModelPair,
        translation: &[f32],
        rotation: &[f32],
        times: &[f32],
    ) -> Result<Vec<f32>, Error> {
        let (batch, length) = (times.len(), self.length);
        let run = |model: &mut dyn NoiseModel, x: &[f32], out: &mut [f32]| {
            let input = Input {
                x,
                steps: times,
                batch,
                length,
            };
            model.forward(input, out)
        };
        let mut of_translation = vec![0.0; batch * length * 3];
        let mut of_rotation = vec![0.0; batch * length * 3];
        run(
            models.translation.as_mut(),
            translation,
            &mut of_translation,
        )?;
        if self.branches == Branches::Both {
            run(models.rotation.as_mut(), rotation, &mut of_rotation)?;
        }
        let mut eps_hat = vec![0.0; batch * length * 6];
        interleave(&of_translation, &of_rotation, &mut eps_hat);
        Ok(eps_hat)
    }
}

/// `[n, 3]` and `[n, 3]` to `[n, 6]`.
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
