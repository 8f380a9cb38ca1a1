//! The diffusion process over SE(3) windows: Euclidean for positions, on SO(3) for rotations.
//!
//! The paper writes the rotation's forward process twice: as a group product (equation of
//! `q(x_t | x_0)`) and as a sum in the tangent space (Algorithm 1). They agree only near the
//! identity, so [`RotationProcess`] names the one in use, and forward, `x0_hat` and sampling all
//! follow it.

use crate::error::{Error, check_len};
use crate::schedule::{NoiseSchedule, Schedule};
use crate::window::{
    Noise, RotationNoise, Window, read_rotation, read_vector, write_rotation, write_vector,
};
use dose3_lie::{Rotation, Vector, so3};
use serde::{Deserialize, Serialize};

/// Which of the paper's two readings rotations diffuse by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RotationProcess {
    /// `x_t = (sqrt(abar) (x) x_0) (+) (sqrt(1 - abar) (x) eps)`, the group product of the
    /// equations. `x0_hat` undoes it exactly for every rotation and noise.
    #[default]
    Group,
    /// `x_t = exp(sqrt(abar) log x_0 + sqrt(1 - abar) eps)`, the tangent-space sum of
    /// Algorithm 1. `x0_hat` undoes it where the sum's norm stays below pi.
    Tangent,
}

/// Everything that defines the process; stored in every model file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProcessConfig {
    /// Number of diffusion steps `T`.
    pub steps: usize,
    /// Schedule of the translation branch.
    pub translation: NoiseSchedule,
    /// Schedule of the rotation branch.
    pub rotation: NoiseSchedule,
    /// Group product or tangent sum.
    pub rotation_process: RotationProcess,
    /// Tangent Gaussian or IG_SO(3).
    pub rotation_noise: RotationNoise,
}

impl Default for ProcessConfig {
    /// 30 steps, cosine schedules for both branches, group product, tangent noise.
    fn default() -> Self {
        Self {
            steps: 30,
            translation: NoiseSchedule::COSINE,
            rotation: NoiseSchedule::COSINE,
            rotation_process: RotationProcess::default(),
            rotation_noise: RotationNoise::default(),
        }
    }
}

/// A window after some forward steps, or on its way back.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// `[length, 3]`
    pub translation: Vec<f32>,
    /// Rotation matrices, row-major, `[length, 9]`.
    pub rotation: Vec<f32>,
}

impl State {
    /// A state of `length` poses at the origin with zero matrices, to be written into.
    pub fn zeros(length: usize) -> Self {
        Self {
            translation: vec![0.0; length * 3],
            rotation: vec![0.0; length * 9],
        }
    }

    /// The state as a window.
    pub fn as_window(&self) -> Window<'_> {
        Window {
            translation: &self.translation,
            rotation: &self.rotation,
        }
    }
}

/// The network's answer for one window at one step: predicted noise.
#[derive(Clone, Copy, Debug)]
pub struct Estimate<'a> {
    /// `[length, 3]`
    pub translation: &'a [f32],
    /// Tangent vectors, `[length, 3]`.
    pub rotation: &'a [f32],
}

/// The process with its tables.
#[derive(Clone, Debug)]
pub struct Process {
    config: ProcessConfig,
    /// Table of the translation branch.
    pub translation: Schedule,
    /// Table of the rotation branch.
    pub rotation: Schedule,
}

impl Process {
    /// Tabulates both branches.
    ///
    /// # Errors
    /// As [`Schedule::new`].
    pub fn new(config: ProcessConfig) -> Result<Self, Error> {
        Ok(Self {
            config,
            translation: Schedule::new(config.translation, config.steps)?,
            rotation: Schedule::new(config.rotation, config.steps)?,
        })
    }

    /// What the process was made from.
    pub fn config(&self) -> ProcessConfig {
        self.config
    }

    /// Number of steps `T`.
    pub fn steps(&self) -> usize {
        self.config.steps
    }

    /// Noises `window` to step `t` (paper, `q(x_t | x_0)` with `sqrt(1 - alpha_bar)`).
    ///
    /// # Errors
    /// [`Error::Shape`] where the slices disagree.
    pub fn forward(&self, window: Window<'_>, noise: &Noise, t: usize) -> Result<State, Error> {
        let length = window.length()?;
        let mut state = State::zeros(length);
        let logs = rotation_logs(window.rotation);
        self.forward_into(
            window.translation,
            &logs,
            noise,
            t,
            &mut state.translation,
            &mut state.rotation,
        )?;
        Ok(state)
    }

    /// As [`Process::forward`] with the rotations' logarithms at hand ([`rotation_logs`]), which
    /// all steps of one window share.
    ///
    /// # Errors
    /// [`Error::Shape`] where the slices disagree.
    pub fn forward_into(
        &self,
        translation: &[f32],
        rotation_logs: &[Vector],
        noise: &Noise,
        t: usize,
        translation_out: &mut [f32],
        rotation_out: &mut [f32],
    ) -> Result<(), Error> {
        check_len("translation", rotation_logs.len() * 3, translation.len())?;
        self.noise_translations(translation, noise, t, translation_out)?;
        self.noise_rotations(rotation_logs, noise, t, rotation_out)
    }

    /// The translations of [`Process::forward_into`] alone.
    ///
    /// # Errors
    /// [`Error::Shape`] where the slices disagree.
    pub fn noise_translations(
        &self,
        translation: &[f32],
        noise: &Noise,
        t: usize,
        out: &mut [f32],
    ) -> Result<(), Error> {
        check_len(
            "translation noise",
            translation.len(),
            noise.translation.len(),
        )?;
        check_len("noised translation", translation.len(), out.len())?;
        let (a, s) = (
            self.translation.signal(t) as f32,
            self.translation.noise(t) as f32,
        );
        for ((out, x), z) in out.iter_mut().zip(translation).zip(&noise.translation) {
            *out = a * x + s * z;
        }
        Ok(())
    }

    /// The rotations of [`Process::forward_into`] alone.
    ///
    /// # Errors
    /// [`Error::Shape`] where the slices disagree.
    pub fn noise_rotations(
        &self,
        logs: &[Vector],
        noise: &Noise,
        t: usize,
        out: &mut [f32],
    ) -> Result<(), Error> {
        check_len("rotation noise", logs.len() * 3, noise.rotation.len())?;
        check_len("noised rotation", logs.len() * 9, out.len())?;
        for (i, log) in logs.iter().enumerate() {
            let x_t = self.noise_rotation(log, &read_vector(&noise.rotation, i), t);
            write_rotation(&x_t, &mut out[i * 9..i * 9 + 9]);
        }
        Ok(())
    }

    /// The noised rotation of one pose, from the logarithm of the clean one.
    pub fn noise_rotation(&self, log: &Vector, z: &Vector, t: usize) -> Rotation {
        let (a, s) = (self.rotation.signal(t), self.rotation.noise(t));
        match self.config.rotation_process {
            RotationProcess::Group => so3::exp(&(log * a)) * so3::exp(&(z * s)),
            RotationProcess::Tangent => so3::exp(&(log * a + z * s)),
        }
    }

    /// The clean rotation that `eps` stands for at step `t` (paper, equation of `x0_hat`).
    pub fn x0_rotation(&self, x_t: &Rotation, eps: &Vector, t: usize) -> Rotation {
        let (a, s) = (self.rotation.signal(t), self.rotation.noise(t));
        match self.config.rotation_process {
            RotationProcess::Group => so3::exp(&(so3::log(&(x_t * so3::exp(&(eps * -s)))) / a)),
            RotationProcess::Tangent => so3::exp(&((so3::log(x_t) - eps * s) / a)),
        }
    }

    /// The clean window that `estimate` stands for at step `t`.
    ///
    /// # Errors
    /// [`Error::Shape`] where the slices disagree.
    pub fn x0_hat(
        &self,
        state: Window<'_>,
        estimate: Estimate<'_>,
        t: usize,
    ) -> Result<State, Error> {
        let length = state.length()?;
        check_len(
            "translation estimate",
            length * 3,
            estimate.translation.len(),
        )?;
        check_len("rotation estimate", length * 3, estimate.rotation.len())?;
        let mut out = State::zeros(length);
        let (a, s) = (self.translation.signal(t), self.translation.noise(t));
        for ((o, x), e) in out
            .translation
            .iter_mut()
            .zip(state.translation)
            .zip(estimate.translation)
        {
            *o = ((f64::from(*x) - s * f64::from(*e)) / a) as f32;
        }
        for i in 0..length {
            let x_t = read_rotation(state.rotation, i);
            let x0 = self.x0_rotation(&x_t, &read_vector(estimate.rotation, i), t);
            write_rotation(&x0, &mut out.rotation[i * 9..i * 9 + 9]);
        }
        Ok(out)
    }

    /// The mean of `x_{t-1}` given `x_t` and `x_0` (paper, equation of `mu_t`).
    ///
    /// # Errors
    /// [`Error::Shape`] where the slices disagree.
    pub fn posterior_mean(
        &self,
        x0: Window<'_>,
        x_t: Window<'_>,
        t: usize,
    ) -> Result<State, Error> {
        let length = x0.length()?;
        check_len("noised translation", length * 3, x_t.translation.len())?;
        check_len("noised rotation", length * 9, x_t.rotation.len())?;
        let mut out = State::zeros(length);
        let (w0, wt) = self.translation.posterior_weights(t);
        for ((o, x), y) in out
            .translation
            .iter_mut()
            .zip(x0.translation)
            .zip(x_t.translation)
        {
            *o = (w0 * f64::from(*x) + wt * f64::from(*y)) as f32;
        }
        let (w0, wt) = self.rotation.posterior_weights(t);
        for i in 0..length {
            let (clean, noised) = (
                read_rotation(x0.rotation, i),
                read_rotation(x_t.rotation, i),
            );
            let (l0, lt) = (so3::log(&clean), so3::log(&noised));
            let mean = match self.config.rotation_process {
                RotationProcess::Group => so3::exp(&(l0 * w0)) * so3::exp(&(lt * wt)),
                RotationProcess::Tangent => so3::exp(&(l0 * w0 + lt * wt)),
            };
            write_rotation(&mean, &mut out.rotation[i * 9..i * 9 + 9]);
        }
        Ok(out)
    }

    /// One ancestral step from `x_t` to `x_{t-1}` (paper, equation of `x_{t-1}`): the posterior
    /// mean with `x0_hat` in the place of `x_0`, plus `sqrt(beta_t)` of fresh noise; step 0 adds
    /// none.
    ///
    /// # Errors
    /// [`Error::Shape`] where the slices disagree.
    pub fn sample_step(
        &self,
        state: Window<'_>,
        estimate: Estimate<'_>,
        fresh: &Noise,
        t: usize,
    ) -> Result<State, Error> {
        let x0 = self.x0_hat(state, estimate, t)?;
        self.step_from_x0(x0.as_window(), state, fresh, t)
    }

    /// As [`Process::sample_step`] with `x0_hat` at hand (for samplers that clip or guide it).
    ///
    /// # Errors
    /// [`Error::Shape`] where the slices disagree.
    pub fn step_from_x0(
        &self,
        x0: Window<'_>,
        state: Window<'_>,
        fresh: &Noise,
        t: usize,
    ) -> Result<State, Error> {
        let mut next = self.posterior_mean(x0, state, t)?;
        let sigma = self.translation.sampling_variance(t).sqrt() as f32;
        for (x, z) in next.translation.iter_mut().zip(&fresh.translation) {
            *x += sigma * z;
        }
        let sigma = self.rotation.sampling_variance(t).sqrt();
        for i in 0..next.rotation.len() / 9 {
            let mean = read_rotation(&next.rotation, i);
            let moved = mean * so3::exp(&(read_vector(&fresh.rotation, i) * sigma));
            write_rotation(&moved, &mut next.rotation[i * 9..i * 9 + 9]);
        }
        Ok(next)
    }

    /// A draw from the prior `x_T`: pure noise on both factors.
    pub fn prior(&self, noise: &Noise) -> State {
        let length = noise.translation.len() / 3;
        let mut state = State::zeros(length);
        state.translation.copy_from_slice(&noise.translation);
        for i in 0..length {
            let r = so3::exp(&read_vector(&noise.rotation, i));
            write_rotation(&r, &mut state.rotation[i * 9..i * 9 + 9]);
        }
        state
    }
}

/// Logarithms of the `[length, 9]` rotation matrices, radians.
pub fn rotation_logs(rotation: &[f32]) -> Vec<Vector> {
    (0..rotation.len() / 9)
        .map(|i| so3::log(&read_rotation(rotation, i)))
        .collect()
}

/// Tangent vectors of `[length, 9]` rotation matrices as `[length, 3]` numbers.
pub fn rotation_tangents(rotation: &[f32]) -> Vec<f32> {
    let mut out = vec![0.0; rotation.len() / 3];
    for (log, out) in rotation_logs(rotation).iter().zip(out.chunks_exact_mut(3)) {
        write_vector(log, out);
    }
    out
}
