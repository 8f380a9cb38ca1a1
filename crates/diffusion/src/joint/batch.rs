//! Batches of noised sequences, and the loss on them.

use super::levels::Levels;
use super::process::{AXES, JointProcess, Noised};
use super::trainer::JointSet;
use crate::error::Error;
use crate::window::normals;
use dose3_model::joint::{CONDITIONS, JointInput};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// `sqrt(1 + e^2) - 1`: a square near 0, so that it is the mean that is learnt, and no more than linear far out, so
/// that the jumps of sound sensors do not decide what is learnt.
fn pseudo_huber(e: f32) -> (f64, f32) {
    let root = (1.0 + e * e).sqrt();
    (f64::from(e * e / (1.0 + root)), e / root)
}

/// A sequence that was drawn, with its levels and the seed of its noise.
pub(super) struct Pick<'a> {
    steps: &'a [[f64; AXES]],
    scale: [f64; AXES],
    step: f64,
    levels: Levels,
    noise: u64,
}

impl<'a> Pick<'a> {
    pub(super) fn draw(
        sets: &'a [JointSet],
        length: usize,
        jitter: f64,
        rng: &mut impl Rng,
    ) -> Self {
        let total: f64 = sets.iter().map(|set| set.weight).sum();
        let mut at = rng.random_range(0.0..total);
        let mut set = &sets[0];
        for next in sets {
            set = next;
            at -= next.weight;
            if at < 0.0 {
                break;
            }
        }
        // Every start is as likely as any other, whichever sequence it is in.
        let starts = |s: &Vec<_>| (s.len() + 1).saturating_sub(length);
        let all: usize = set.sequences.iter().map(starts).sum();
        let mut start = rng.random_range(0..all.max(1));
        let mut steps: &[[f64; AXES]] = &[];
        for sequence in &set.sequences {
            if start < starts(sequence) {
                steps = &sequence[start..start + length];
                break;
            }
            start -= starts(sequence);
        }
        let scale = set.scale.map(|s| match jitter > 0.0 {
            true => s * rng.random_range(-jitter..jitter).exp(),
            false => s,
        });
        Self {
            steps,
            scale,
            step: set.step,
            levels: Levels::draw(rng),
            noise: rng.random(),
        }
    }
}

/// Noised sequences.
pub(crate) struct Batch {
    x: Vec<f32>,
    /// What the network should say: `[batch, length, 6]`.
    pub(crate) target: Vec<f32>,
    conditions: Vec<f32>,
    /// Which axes of each sequence are noised.
    pub(crate) noised: Vec<[bool; AXES]>,
    length: usize,
}

impl Batch {
    pub(super) fn new(picks: &[Pick<'_>], length: usize) -> Result<Self, Error> {
        let one = |pick: &Pick<'_>| -> Result<Noised, Error> {
            let mut rng = ChaCha8Rng::seed_from_u64(pick.noise);
            let noise = normals(&mut rng, length * AXES);
            let mut noised = Noised::default();
            let process = JointProcess::new(pick.steps, pick.scale)?;
            process.noised(&pick.levels, &noise, &mut noised)?;
            Ok(noised)
        };
        let noised: Vec<Noised> = picks.par_iter().map(one).collect::<Result<_, _>>()?;
        let told = picks.iter().flat_map(|p| p.levels.conditions(p.step));
        Ok(Self {
            x: noised
                .iter()
                .flat_map(|n| n.input.iter().copied())
                .collect(),
            target: noised
                .iter()
                .flat_map(|n| n.target.iter().copied())
                .collect(),
            conditions: told.collect(),
            noised: picks.iter().map(|p| p.levels.0.map(|s| s > 0.0)).collect(),
            length,
        })
    }

    pub(crate) fn input(&self) -> JointInput<'_> {
        JointInput {
            x: &self.x,
            conditions: &self.conditions,
            batch: self.conditions.len() / CONDITIONS,
            length: self.length,
        }
    }

    /// Mean error of sequence `index` over its noised axes, and its gradient.
    pub(crate) fn loss(
        &self,
        index: usize,
        output: &[f32],
        mut gradient: Option<&mut [f32]>,
    ) -> f64 {
        let target = &self.target[index * self.length * AXES..][..output.len()];
        let noised = &self.noised[index];
        let count = noised.iter().filter(|n| **n).count().max(1) * self.length;
        let mut sum = 0.0;
        for (i, (f, t)) in output.iter().zip(target).enumerate() {
            if !noised[i % AXES] {
                continue;
            }
            let (loss, slope) = pseudo_huber(f - t);
            sum += loss;
            if let Some(gradient) = &mut gradient {
                gradient[i] = slope / count as f32;
            }
        }
        sum / count as f64
    }
}
