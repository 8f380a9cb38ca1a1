//! Where windows come from, and batches of them.

use super::learner::{BranchBatch, Target};
use crate::error::Error;
use crate::process::{Process, rotation_logs};
use crate::window::Noise;
use dose3_model::Input;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Where training windows come from.
pub trait WindowSource: Sync {
    /// Number of windows.
    fn len(&self) -> usize;
    /// Whether there is none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Poses a window.
    fn length(&self) -> usize;
    /// Writes window `index`: translation `[length, 3]`, rotation `[length, 9]`.
    ///
    /// # Errors
    /// [`Error::Window`] where the window cannot be represented.
    fn read(
        &self,
        index: usize,
        translation: &mut [f32],
        rotation: &mut [f32],
    ) -> Result<(), Error>;
}

/// One batch of noised windows.
pub(super) struct Batch {
    length: usize,
    steps: Vec<usize>,
    times: Vec<f32>,
    translation: Vec<f32>,
    rotation: Vec<f32>,
    clean_rotation: Vec<f32>,
    translation_noise: Vec<f32>,
    rotation_noise: Vec<f32>,
}

impl Batch {
    /// Noises the windows and steps that are picked, with noise drawn in their order.
    pub(super) fn assemble(
        process: &Process,
        source: &dyn WindowSource,
        picks: &[(usize, usize)],
        rng: &mut ChaCha8Rng,
    ) -> Result<Self, Error> {
        let (length, n) = (source.length(), picks.len());
        let kind = process.config().rotation_noise;
        let noise: Vec<Noise> = picks
            .iter()
            .map(|_| Noise::draw(rng, length, kind))
            .collect();
        let mut batch = Self {
            length,
            steps: picks.iter().map(|p| p.1).collect(),
            times: picks.iter().map(|p| p.1 as f32).collect(),
            translation: vec![0.0; n * length * 3],
            rotation: vec![0.0; n * length * 9],
            clean_rotation: vec![0.0; n * length * 9],
            translation_noise: noise.iter().flat_map(|n| &n.translation).copied().collect(),
            rotation_noise: noise.iter().flat_map(|n| &n.rotation).copied().collect(),
        };
        let noised = batch
            .translation
            .par_chunks_mut(length * 3)
            .zip(batch.rotation.par_chunks_mut(length * 9))
            .zip(batch.clean_rotation.par_chunks_mut(length * 9));
        noised.zip(picks).zip(&noise).try_for_each(
            |((((translation, rotation), clean_rotation), (index, t)), noise)| {
                let mut clean = vec![0.0; length * 3];
                source.read(*index, &mut clean, clean_rotation)?;
                let logs = rotation_logs(clean_rotation);
                process.forward_into(&clean, &logs, noise, *t, translation, rotation)
            },
        )?;
        Ok(batch)
    }

    /// What the translation branch is trained on.
    pub(super) fn translation(&self) -> BranchBatch<'_> {
        BranchBatch {
            input: self.input(&self.translation),
            steps: &self.steps,
            noise: &self.translation_noise,
            target: Target::Translation,
        }
    }

    /// What the rotation branch is trained on.
    pub(super) fn rotation(&self) -> BranchBatch<'_> {
        let clean = &self.clean_rotation;
        BranchBatch {
            input: self.input(&self.rotation),
            steps: &self.steps,
            noise: &self.rotation_noise,
            target: Target::Rotation { clean },
        }
    }

    fn input<'b>(&'b self, x: &'b [f32]) -> Input<'b> {
        Input {
            x,
            steps: &self.times,
            batch: self.times.len(),
            length: self.length,
        }
    }
}
