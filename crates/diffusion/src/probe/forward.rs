//! Estimates at windows noised by drawn noise.

use super::{Branches, ModelPair, ProbePlan, Task, interleave};
use crate::error::Error;
use crate::process::rotation_logs;
use rayon::prelude::*;
use std::ops::Range;

/// `(eps_hat, eps)` as in [`Traces`](super::Traces).
pub(super) fn run(
    models: &mut ModelPair,
    task: &Task<'_>,
    config: &ProbePlan,
    draws: Range<usize>,
) -> Result<(Vec<f32>, Vec<f32>), Error> {
    let &Task {
        process,
        steps,
        windows,
        length,
        branches,
    } = task;
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
    let eps_hat = task.estimate(models, &translation, &rotation, &times)?;
    Ok((eps_hat, eps))
}
