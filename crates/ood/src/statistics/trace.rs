//! What the noise estimator said along the diffusion steps, and the sums that all statistics share.

use super::bands::{BANDS, band};
use super::quantile::quantile_sorted;
use crate::error::{Error, expect_len};
use serde::{Deserialize, Serialize};

/// Channels of a noise estimate: translation x, y, z, then the rotation tangent x, y, z.
pub const CHANNELS: usize = 6;

/// The estimator's answers for one window and one noise draw.
#[derive(Clone, Copy, Debug)]
pub struct Trace<'a> {
    /// Diffusion steps used, in order of increasing noise.
    pub steps: usize,
    /// Poses of the window.
    pub length: usize,
    /// `[steps, length, 6]`: the estimated noise.
    pub eps_hat: &'a [f32],
    /// The noise drawn: `[length, 6]` where all steps share it, else `[steps, length, 6]`.
    pub eps: &'a [f32],
}

/// Means over the poses of a window at one diffusion step, per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepMoments {
    /// `eps[p - 1]` is the mean of eps_hat^p, p = 1, 2, 3: the paper's `<eps>_p` on each axis.
    pub eps: [[f64; CHANNELS]; 3],
    /// Mean of (eps_hat - eps)^2.
    pub residual: [f64; CHANNELS],
    /// Powers of the difference to the step before, as in `eps`; zero at the first step.
    pub change: [[f64; CHANNELS]; 3],
}

/// Everything that the statistics take from one trace. One summary serves every set of statistics,
/// and takes about 29 kB for 30 steps of 128 poses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceSummary {
    /// Poses of the window.
    pub length: usize,
    /// One entry per diffusion step, in order of increasing noise.
    pub steps: Vec<StepMoments>,
    /// Per noise band: the 0.9 quantile over poses of the denoising error, per channel; empty where
    /// the trace has fewer than [`BANDS`] steps.
    pub residual_q90: Vec<[f64; CHANNELS]>,
    /// Per noise band: the maximum over poses of the denoising error, per channel.
    pub residual_max: Vec<[f64; CHANNELS]>,
    /// Per noise band and pose: mean over the band's steps of (eps_hat - eps)^2, per channel. It points
    /// at the poses that the estimator found hard.
    pub pose_residual: Vec<Vec<[f32; CHANNELS]>>,
}

impl TraceSummary {
    /// Summarises a stored trace.
    ///
    /// # Errors
    /// [`Error::Shape`] for slices that do not fit `steps` and `length`, [`Error::TooFew`] for none,
    /// [`Error::NotFinite`] for NaN or an infinity in either slice.
    pub fn of(trace: &Trace<'_>) -> Result<Self, Error> {
        let per_step = trace.length * CHANNELS;
        expect_len(
            "eps_hat of a trace",
            trace.steps * per_step,
            trace.eps_hat.len(),
        )?;
        let shared = trace.eps.len() == per_step;
        if !shared {
            expect_len("eps of a trace", trace.steps * per_step, trace.eps.len())?;
        }
        let mut accumulator = Accumulator::new(trace.steps, trace.length)?;
        for (step, eps_hat) in trace.eps_hat.chunks_exact(per_step).enumerate() {
            let start = if shared { 0 } else { step * per_step };
            accumulator.push_step(eps_hat, &trace.eps[start..start + per_step])?;
        }
        accumulator.finish()
    }
}

/// Builds a [`TraceSummary`] step by step, so that a trace need not be stored.
#[derive(Clone, Debug)]
pub struct Accumulator {
    expected: usize,
    length: usize,
    previous: Vec<f32>,
    steps: Vec<StepMoments>,
    /// Sum over the steps of the open band of the denoising error, `[length]`.
    open_band: Vec<[f64; CHANNELS]>,
    open_steps: usize,
    residual_q90: Vec<[f64; CHANNELS]>,
    residual_max: Vec<[f64; CHANNELS]>,
    pose_residual: Vec<Vec<[f32; CHANNELS]>>,
}

impl Accumulator {
    /// For `steps` diffusion steps of a window of `length` poses.
    ///
    /// # Errors
    /// [`Error::TooFew`] where either is zero.
    pub fn new(steps: usize, length: usize) -> Result<Self, Error> {
        for (what, found) in [("diffusion steps", steps), ("poses of a window", length)] {
            if found == 0 {
                return Err(Error::TooFew {
                    what,
                    needed: 1,
                    found,
                    hint: "an empty trace says nothing",
                });
            }
        }
        Ok(Self {
            expected: steps,
            length,
            previous: Vec::new(),
            steps: Vec::with_capacity(steps),
            open_band: vec![[0.0; CHANNELS]; length],
            open_steps: 0,
            residual_q90: Vec::new(),
            residual_max: Vec::new(),
            pose_residual: Vec::new(),
        })
    }

    /// Adds the next step, in order of increasing noise: both slices are `[length, 6]`.
    ///
    /// # Errors
    /// [`Error::Shape`] for a wrong length or one step too many, [`Error::NotFinite`].
    pub fn push_step(&mut self, eps_hat: &[f32], eps: &[f32]) -> Result<(), Error> {
        expect_len("eps_hat of a step", self.length * CHANNELS, eps_hat.len())?;
        expect_len("eps of a step", self.length * CHANNELS, eps.len())?;
        if self.steps.len() == self.expected {
            return Err(Error::Shape {
                what: "steps of a trace",
                expected: self.expected,
                found: self.expected + 1,
            });
        }
        check_finite("eps_hat", eps_hat)?;
        check_finite("eps", eps)?;

        let mut moments = StepMoments::default();
        for (pose, (hat, drawn)) in eps_hat
            .chunks_exact(CHANNELS)
            .zip(eps.chunks_exact(CHANNELS))
            .enumerate()
        {
            for axis in 0..CHANNELS {
                let value = f64::from(hat[axis]);
                add_powers(&mut moments.eps, axis, value);
                if let Some(&before) = self.previous.get(pose * CHANNELS + axis) {
                    add_powers(&mut moments.change, axis, value - f64::from(before));
                }
                let error = (value - f64::from(drawn[axis])).powi(2);
                moments.residual[axis] += error;
                self.open_band[pose][axis] += error;
            }
        }
        moments.divide(self.length as f64);
        self.steps.push(moments);
        self.previous.clear();
        self.previous.extend_from_slice(eps_hat);
        self.open_steps += 1;
        self.close_band();
        Ok(())
    }

    /// Pools the poses of a noise band once its last step is in.
    fn close_band(&mut self) {
        let done = self.steps.len();
        let ends =
            done == self.expected || band(done, self.expected) != band(done - 1, self.expected);
        if self.expected < BANDS || !ends {
            return;
        }
        let scale = 1.0 / self.open_steps as f64;
        let (mut q90, mut max) = ([0.0; CHANNELS], [0.0; CHANNELS]);
        for axis in 0..CHANNELS {
            let mut errors: Vec<f64> = self.open_band.iter().map(|e| e[axis] * scale).collect();
            errors.sort_by(f64::total_cmp);
            q90[axis] = quantile_sorted(&errors, 0.9);
            max[axis] = errors[errors.len() - 1];
        }
        self.residual_q90.push(q90);
        self.residual_max.push(max);
        let means = self.open_band.iter();
        self.pose_residual
            .push(means.map(|e| e.map(|x| (x * scale) as f32)).collect());
        self.open_band.fill([0.0; CHANNELS]);
        self.open_steps = 0;
    }

    /// The summary, once all steps are in.
    ///
    /// # Errors
    /// [`Error::Shape`] where steps are missing.
    pub fn finish(self) -> Result<TraceSummary, Error> {
        expect_len("steps of a trace", self.expected, self.steps.len())?;
        Ok(TraceSummary {
            length: self.length,
            steps: self.steps,
            residual_q90: self.residual_q90,
            residual_max: self.residual_max,
            pose_residual: self.pose_residual,
        })
    }
}

impl StepMoments {
    fn divide(&mut self, count: f64) {
        let powers = self.eps.iter_mut().chain(self.change.iter_mut());
        for row in powers.chain(std::iter::once(&mut self.residual)) {
            for value in row {
                *value /= count;
            }
        }
    }
}

/// Adds x, x^2, x^3.
fn add_powers(sums: &mut [[f64; CHANNELS]; 3], axis: usize, x: f64) {
    sums[0][axis] += x;
    sums[1][axis] += x * x;
    sums[2][axis] += x * x * x;
}

fn check_finite(what: &str, values: &[f32]) -> Result<(), Error> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(Error::NotFinite {
            what: what.to_owned(),
            index,
            value: f64::from(values[index]),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// eps_hat[t, i, axis] = t + i + 10 axis; eps = 0.
    fn ramp(steps: usize, length: usize) -> Vec<f32> {
        let mut values = Vec::new();
        for t in 0..steps {
            for i in 0..length {
                for axis in 0..CHANNELS {
                    values.push((t + i + 10 * axis) as f32);
                }
            }
        }
        values
    }

    #[test]
    fn moments_of_a_ramp_by_hand() {
        let eps_hat = ramp(2, 3);
        let trace = Trace {
            steps: 2,
            length: 3,
            eps_hat: &eps_hat,
            eps: &[0.0; 18],
        };
        let summary = TraceSummary::of(&trace).unwrap();
        // Axis 0: step 0 holds 0, 1, 2; step 1 holds 1, 2, 3.
        assert_eq!(summary.steps[0].eps[0][0], 1.0);
        assert_eq!(summary.steps[0].eps[1][0], 5.0 / 3.0);
        assert_eq!(summary.steps[1].eps[2][0], 36.0 / 3.0);
        assert_eq!(summary.steps[1].residual[0], 14.0 / 3.0);
        assert_eq!(summary.steps[0].change, [[0.0; 6]; 3]);
        assert_eq!(summary.steps[1].change, [[1.0; 6]; 3]);
        assert!(summary.residual_max.is_empty() && summary.pose_residual.is_empty());
    }

    #[test]
    fn noise_per_step_and_shared_noise_agree() {
        let eps_hat = ramp(7, 4);
        let shared: Vec<f32> = (0..24).map(|i| i as f32 * 0.1).collect();
        let repeated = shared.repeat(7);
        let of = |eps: &[f32]| {
            TraceSummary::of(&Trace {
                steps: 7,
                length: 4,
                eps_hat: &eps_hat,
                eps,
            })
            .unwrap()
        };
        assert_eq!(of(&shared), of(&repeated));
    }

    #[test]
    fn a_single_bad_pose_shows_in_the_maximum_of_its_band_only() {
        let (steps, length) = (12, 20);
        let mut eps_hat = vec![0.0_f32; steps * length * CHANNELS];
        // Rotation z of pose 7 is off by 3 in step 5, which lies in band 2 (steps 4 and 5).
        eps_hat[(5 * length + 7) * CHANNELS + 5] = 3.0;
        let summary = TraceSummary::of(&Trace {
            steps,
            length,
            eps_hat: &eps_hat,
            eps: &[0.0; 20 * CHANNELS],
        })
        .unwrap();
        assert_eq!(summary.residual_max.len(), BANDS);
        assert_eq!(summary.residual_max[2][5], 4.5);
        assert_eq!(summary.residual_max[1][5], 0.0);
        assert_eq!(summary.residual_q90[2][5], 0.0);
        assert_eq!(summary.pose_residual[2][7][5], 4.5);
        assert_eq!(summary.pose_residual[2][6][5], 0.0);
        assert_eq!(summary.pose_residual[3][7][5], 0.0);
    }

    #[test]
    fn wrong_shapes_and_nan_are_errors() {
        let mut accumulator = Accumulator::new(2, 1).unwrap();
        assert!(accumulator.push_step(&[0.0; 5], &[0.0; 6]).is_err());
        assert!(accumulator.push_step(&[f32::NAN; 6], &[0.0; 6]).is_err());
        accumulator.push_step(&[0.0; 6], &[0.0; 6]).unwrap();
        assert!(accumulator.clone().finish().is_err());
        accumulator.push_step(&[0.0; 6], &[0.0; 6]).unwrap();
        assert!(accumulator.push_step(&[0.0; 6], &[0.0; 6]).is_err());
        assert!(accumulator.finish().is_ok());
        assert!(Accumulator::new(0, 4).is_err());
        assert!(Accumulator::new(4, 0).is_err());
    }
}
