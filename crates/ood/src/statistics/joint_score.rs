//! Which way the joint network would change a window: the slope of its log-likelihood along changes that sensors make.
//!
//! With a little noise the mean error of the noise estimate is, up to a factor, the score: the gradient of the
//! log-likelihood (Vincent 2011). Its product with how a pose moves under a change, averaged over the window, is
//! the slope of the log-likelihood along that change: the statistic of a score test (Rao 1948). Sound motion has
//! slopes about those of the trusted windows, whatever its size; where position and attitude no longer belong together,
//! they have a sign that lasts, while a squared error only grows. The changes are
//!
//! - one axis mixed into another, 36 of them: turned mountings, lever arms, wrong scales;
//! - each axis a little later than the others, 6: delays.

use super::trace::CHANNELS;
use super::{AXES, Column};
use crate::error::{Error, expect_len};

/// Numbers of each axis: one for each axis mixed in, one for a delay.
const OF_AXIS: usize = CHANNELS + 1;
/// A single error counts as no more than this, and a step as no longer than `LARGEST_STEP` scales, so that one jump of a
/// sensor does not decide a mean over the window.
const LARGEST_ERROR: f64 = 3.0;
const LARGEST_STEP: f64 = 6.0;

/// Signed errors of the joint network in one view, with the steps that it saw.
#[derive(Clone, Debug, PartialEq)]
pub struct JointScore {
    /// `[pose][axis]`
    errors: Vec<f32>,
    /// `[pose][axis]`, in units of the axes' scales.
    steps: Vec<[f64; CHANNELS]>,
}

impl JointScore {
    /// Of mean signed errors `[pose][axis]` and of the steps in units of the axes' scales.
    ///
    /// # Errors
    /// [`Error::Shape`]; [`Error::TooFew`] for fewer than two steps.
    pub fn new(errors: Vec<f32>, steps: Vec<[f64; CHANNELS]>) -> Result<Self, Error> {
        if steps.len() < 2 {
            return Err(Error::TooFew {
                what: "increments of a window",
                needed: 2,
                found: steps.len(),
                hint: "a delay shows in how steps differ",
            });
        }
        let expected = steps.len() * CHANNELS;
        expect_len("signed errors of the joint network", expected, errors.len())?;
        Ok(Self { errors, steps })
    }

    /// Half the difference of the steps after and before, or of the nearer one at an end.
    fn change(&self, step: usize, axis: usize) -> f64 {
        let (before, after) = (step.saturating_sub(1), (step + 1).min(self.steps.len() - 1));
        (self.steps[after][axis] - self.steps[before][axis]) / (after - before) as f64
    }
}

pub(super) fn columns() -> Vec<Column> {
    let mut columns = Vec::with_capacity(CHANNELS * OF_AXIS);
    for part in AXES {
        let mixed = AXES.map(|other| format!("{part}.score.{other}"));
        let names = mixed.into_iter().chain([format!("{part}.score.late")]);
        columns.extend(names.map(|name| Column { part, name }));
    }
    columns
}

pub(super) fn values(score: &JointScore, out: &mut Vec<f64>) {
    let mut sums = [[0.0; OF_AXIS]; CHANNELS];
    let near = |x: f64| x.clamp(-LARGEST_STEP, LARGEST_STEP);
    for (t, (step, errors)) in score
        .steps
        .iter()
        .zip(score.errors.chunks_exact(CHANNELS))
        .enumerate()
    {
        for (axis, (sums, error)) in sums.iter_mut().zip(errors).enumerate() {
            let error = f64::from(*error).clamp(-LARGEST_ERROR, LARGEST_ERROR);
            for (sum, x) in sums.iter_mut().zip(step) {
                *sum += error * near(*x);
            }
            sums[CHANNELS] += error * near(score.change(t, axis));
        }
    }
    let count = score.steps.len() as f64;
    out.extend(sums.iter().flatten().map(|sum| sum / count));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_by_hand() {
        // Yaw is 1, 2, 4; only the second step has an error, of 0.5 sideways and of 9, which counts as 3, in yaw.
        let mut steps = vec![[0.0; CHANNELS]; 3];
        (steps[0][5], steps[1][5], steps[2][5]) = (1.0, 2.0, 4.0);
        let mut errors = vec![0.0; 3 * CHANNELS];
        (errors[CHANNELS + 1], errors[CHANNELS + 5]) = (0.5, 9.0);
        let score = JointScore::new(errors, steps.clone()).unwrap();
        let mut out = Vec::new();
        values(&score, &mut out);
        assert_eq!(out.len(), columns().len());
        let at = |name: &str| out[columns().iter().position(|c| c.name == name).unwrap()];
        assert_eq!(at("translation_y.score.rotation_z"), 0.5 * 2.0 / 3.0);
        assert_eq!(at("rotation_z.score.rotation_z"), 3.0 * 2.0 / 3.0);
        assert_eq!(at("rotation_z.score.late"), 3.0 * 1.5 / 3.0);
        assert_eq!(at("translation_y.score.late"), 0.0);
        assert_eq!(out.iter().filter(|x| **x != 0.0).count(), 3);
        assert!(JointScore::new(vec![0.0; 6], steps).is_err());
        assert!(JointScore::new(vec![0.0; 6], vec![[0.0; 6]]).is_err());
    }
}
