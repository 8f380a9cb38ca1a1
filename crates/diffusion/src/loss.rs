//! The losses of Algorithm 1 and their gradients with respect to the network's output.
//!
//! Here both are evaluated on the host in f64, one pose at a time (`device` has them as tensors), and their gradients
//! are closed forms: the derivative of the squared geodesic distance goes through the Jacobians of SO(3),
//! never through an arccos, so it is finite at 0 and at pi. A backend therefore only has to carry
//! a given output gradient back through the network, and every backend trains the same loss.

use crate::process::{Process, RotationProcess};
use crate::window::{read_rotation, read_vector, write_vector};
use dose3_lie::{Rotation, Vector, so3};
use serde::{Deserialize, Serialize};

/// Weights of the two terms of Algorithm 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LossConfig {
    /// Weight of the loss on the noise.
    pub eps_weight: f64,
    /// Weight of the loss on the clean window.
    pub x0_weight: f64,
    /// Ceiling of `sqrt(1 - alpha_bar) / sqrt(alpha_bar)`, the factor by which an error of the
    /// noise grows in `x0_hat`. At the last cosine step it is about 600: without a ceiling the
    /// x0 loss of that one step outweighs all others.
    pub x0_ceiling: f64,
}

impl Default for LossConfig {
    fn default() -> Self {
        Self {
            eps_weight: 1.0,
            x0_weight: 1.0,
            x0_ceiling: 1.0,
        }
    }
}

/// The loss of one sample, split into its terms (before weighting).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleLoss {
    /// Loss on the noise: mean L1 (translation), mean squared geodesic angle (rotation).
    pub eps: f64,
    /// Loss on the clean window, with the ceiling applied.
    pub x0: f64,
    /// The weighted sum that is minimised.
    pub total: f64,
}

/// Squared geodesic distance between `exp(a)` and `exp(b)` (paper, `L_rot`), and its gradient
/// with respect to `a`.
///
/// With `phi = log(exp(a)^T exp(b))` the value is `|phi|^2` and the gradient `-2 J_r(a)^T phi`:
/// a step `d` of `a` turns `exp(a)` by `J_r(a) d` on the right, which moves `phi` by
/// `-J_l(phi)^-1 J_r(a) d`, and `J_l(phi)^-T phi = phi`.
pub fn geodesic_loss(a: &Vector, b: &Vector) -> (f64, Vector) {
    geodesic_to(a, &so3::exp(b))
}

fn geodesic_to(a: &Vector, target: &Rotation) -> (f64, Vector) {
    let phi = so3::log(&(so3::exp(a).inverse() * target));
    (
        phi.norm_squared(),
        so3::right_jacobian(a).transpose() * phi * -2.0,
    )
}

impl Process {
    /// What brings `sqrt(1 - abar) / sqrt(abar)` down to the ceiling.
    fn x0_damping(config: &LossConfig, signal: f64, noise: f64) -> f64 {
        (config.x0_ceiling * signal / noise).min(1.0)
    }

    /// The translation's x0 loss is this times its noise loss at step `t`.
    pub(crate) fn translation_x0_factor(&self, config: &LossConfig, t: usize) -> f64 {
        let (signal, noise) = (self.translation.signal(t), self.translation.noise(t));
        config.x0_weight * noise / signal * Self::x0_damping(config, signal, noise)
    }

    /// What the rotation's x0 loss at step `t` is damped by; squared, because it is a squared angle.
    pub(crate) fn rotation_x0_damping(&self, config: &LossConfig, t: usize) -> f64 {
        Self::x0_damping(config, self.rotation.signal(t), self.rotation.noise(t)).powi(2)
    }

    /// Loss of one translation sample and its gradient.
    ///
    /// `eps_hat`, `eps` and `gradient` are `[length, 3]`. The x0 term of Algorithm 1,
    /// `|trans_0 - trans|`, equals `sqrt(1 - abar) / sqrt(abar)` times the noise term, so the
    /// clean window is not needed.
    pub fn translation_loss(
        &self,
        config: &LossConfig,
        t: usize,
        eps_hat: &[f32],
        eps: &[f32],
        gradient: &mut [f32],
    ) -> SampleLoss {
        let n = eps.len() as f64;
        let x0 = self.translation_x0_factor(config, t);
        let slope = ((config.eps_weight + x0) / n) as f32;
        let mut sum = 0.0;
        for ((g, e), z) in gradient.iter_mut().zip(eps_hat).zip(eps) {
            let d = e - z;
            sum += f64::from(d.abs());
            // signum(0) is 1 in Rust; the subgradient at 0 that changes nothing is 0.
            *g = if d == 0.0 { 0.0 } else { slope * d.signum() };
        }
        let eps_loss = sum / n;
        SampleLoss {
            eps: eps_loss,
            x0: eps_loss * x0,
            total: eps_loss * (config.eps_weight + x0),
        }
    }

    /// Loss of one rotation sample and its gradient.
    ///
    /// `eps_hat`, `eps`, `gradient` are `[length, 3]`; `x_t` and `clean` are `[length, 9]`.
    #[allow(clippy::too_many_arguments)]
    pub fn rotation_loss(
        &self,
        config: &LossConfig,
        t: usize,
        eps_hat: &[f32],
        eps: &[f32],
        x_t: &[f32],
        clean: &[f32],
        gradient: &mut [f32],
    ) -> SampleLoss {
        let length = eps.len() / 3;
        let n = length as f64;
        let x0_weight = config.x0_weight * self.rotation_x0_damping(config, t);
        let mut loss = SampleLoss::default();
        for i in 0..length {
            let e = read_vector(eps_hat, i);
            let (value, mut g) = geodesic_loss(&e, &read_vector(eps, i));
            loss.eps += value / n;
            g *= config.eps_weight;
            if x0_weight > 0.0 {
                let (value, g0) =
                    self.x0_rotation_loss(&e, &read_rotation(x_t, i), &read_rotation(clean, i), t);
                loss.x0 += x0_weight * value / n;
                g += g0 * x0_weight;
            }
            write_vector(&(g / n), &mut gradient[i * 3..i * 3 + 3]);
        }
        loss.total = config.eps_weight * loss.eps + loss.x0;
        loss
    }

    /// Squared geodesic distance between `x0_hat(x_t, eps)` and the clean rotation, and its
    /// gradient with respect to `eps`.
    pub fn x0_rotation_loss(
        &self,
        eps: &Vector,
        x_t: &Rotation,
        clean: &Rotation,
        t: usize,
    ) -> (f64, Vector) {
        let (a, s) = (self.rotation.signal(t), self.rotation.noise(t));
        match self.config().rotation_process {
            RotationProcess::Group => {
                let back = eps * -s;
                let m = so3::log(&(x_t * so3::exp(&back)));
                let (value, du) = geodesic_to(&(m / a), clean);
                let dm = so3::right_jacobian_inverse(&m).transpose() * du / a;
                (value, so3::right_jacobian(&back).transpose() * dm * -s)
            }
            RotationProcess::Tangent => {
                let (value, du) = geodesic_to(&((so3::log(x_t) - eps * s) / a), clean);
                (value, du * (-s / a))
            }
        }
    }
}
