//! The deterministic DDIM path (Song et al. 2021, equation 12 with sigma = 0), followed from a window
//! to noise as in DiffPath (Heng et al. 2024, arXiv 2405.11881):
//!
//! ```text
//! eps_t = eps_hat(x_t, t),   x0_hat = (x_t (-) s_t eps_t) / a_t,   x_u = a_u x0_hat (+) s_u eps_t
//! ```
//!
//! with `a = sqrt(alpha_bar)`, `s = sqrt(1 - alpha_bar)`, `u` the visited step after `t`, and the window
//! itself as `x_t` of the first one. Rotations follow the process's own reading of both equations.
//!
//! `x0_hat` divides by `a_t`, which is 0.05 at the last step but one of a cosine schedule (the last step
//! is never left), but `a_u` follows at once: of `x_t` a share `a_u / a_t < 1` is left, of `eps_t` at
//! most `s_u`. So translations stay as large as the window and the estimates are, and both
//! operations are done in f64. A rotation's `x0_hat` is an element of SO(3), so one that the division
//! turns by more than pi comes back within pi: large estimates make the path of a rotation jump, never
//! grow.

use super::{Branches, ModelPair, Task};
use crate::error::Error;
use crate::process::Process;
use crate::window::{read_rotation, read_vector, write_rotation};
use dose3_lie::so3;
use rayon::prelude::*;

/// `eps_hat` along the path of each window, `[windows, steps, length, 6]`.
pub(super) fn run(models: &mut ModelPair, task: &Task<'_>) -> Result<Vec<f32>, Error> {
    let (steps, windows) = (task.steps, task.windows);
    let (mut translation, mut rotation) = (Vec::new(), Vec::new());
    for window in windows {
        translation.extend_from_slice(window.translation);
        rotation.extend_from_slice(window.rotation);
    }
    let a_window = task.length * 6;
    let mut eps_hat = vec![0.0; windows.len() * steps.len() * a_window];
    for (k, t) in steps.iter().enumerate() {
        let times = vec![*t as f32; windows.len()];
        let estimates = task.estimate(models, &translation, &rotation, &times)?;
        for (w, estimate) in estimates.chunks_exact(a_window).enumerate() {
            let start = (w * steps.len() + k) * a_window;
            eps_hat[start..start + a_window].copy_from_slice(estimate);
        }
        if let Some(next) = steps.get(k + 1) {
            move_translations(task.process, &mut translation, &estimates, *t, *next);
            if task.branches == Branches::Both {
                move_rotations(task.process, &mut rotation, &estimates, *t, *next);
            }
        }
    }
    Ok(eps_hat)
}

/// Takes `[n, 3]` translations from step `t` to step `next` along `[n, 6]` estimates.
fn move_translations(process: &Process, x: &mut [f32], estimates: &[f32], t: usize, next: usize) {
    let schedule = &process.translation;
    let (a, s) = (schedule.signal(t), schedule.noise(t));
    let (a_next, s_next) = (schedule.signal(next), schedule.noise(next));
    for (x, estimate) in x.chunks_exact_mut(3).zip(estimates.chunks_exact(6)) {
        for (x, eps) in x.iter_mut().zip(estimate) {
            let eps = f64::from(*eps);
            let x0_hat = (f64::from(*x) - s * eps) / a;
            *x = (a_next * x0_hat + s_next * eps) as f32;
        }
    }
}

/// Takes `[n, 9]` rotations from step `t` to step `next` along `[n, 6]` estimates.
fn move_rotations(process: &Process, x: &mut [f32], estimates: &[f32], t: usize, next: usize) {
    x.par_chunks_exact_mut(9)
        .zip(estimates.par_chunks_exact(6))
        .for_each(|(x, estimate)| {
            let eps = read_vector(&estimate[3..], 0);
            let x0_hat = process.x0_rotation(&read_rotation(x, 0), &eps, t);
            let x_next = process.noise_rotation(&so3::log(&x0_hat), &eps, next);
            write_rotation(&x_next, x);
        });
}
