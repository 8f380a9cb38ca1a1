//! Adam with global-norm gradient clipping and a moving average of the weights, over one flat
//! parameter vector.

use rayon::prelude::*;

use crate::adam_kernel::{Coefficients, Slices, square_sum, update};
use crate::simd::Isa;

/// Numbers that are worked on together. It fixes the order in which the norm is summed.
const BLOCK: usize = 1 << 14;

/// Settings of [`Adam`]; the learning rate is given per step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdamConfig {
    /// Decay of the first moment.
    pub beta1: f32,
    /// Decay of the second moment.
    pub beta2: f32,
    /// Added to the root of the second moment.
    pub epsilon: f32,
    /// Gradients with a larger Euclidean norm are scaled down to it.
    pub max_grad_norm: Option<f32>,
}

impl Default for AdamConfig {
    /// 0.9, 0.999, 1e-8, no clipping (Kingma and Ba 2015).
    fn default() -> Self {
        Self {
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-8,
            max_grad_norm: None,
        }
    }
}

/// The optimiser's state: moments, their step count, and the averaged weights.
///
/// Large vectors are worked on by the current rayon pool; the result does not depend on it.
#[derive(Clone, Debug)]
pub struct Adam {
    config: AdamConfig,
    step: u64,
    m: Vec<f32>,
    v: Vec<f32>,
    ema: Vec<f32>,
    isa: Isa,
}

impl Adam {
    /// Starts with zero moments; the average starts at `values`.
    pub fn new(values: &[f32], config: AdamConfig) -> Self {
        let zeros = vec![0.0; values.len()];
        Self {
            config,
            step: 0,
            m: zeros.clone(),
            v: zeros,
            ema: values.to_vec(),
            isa: Isa::detect(),
        }
    }

    /// Steps taken.
    pub fn step_count(&self) -> u64 {
        self.step
    }

    /// Sets the number of steps taken, when state is restored through [`Adam::state_mut`].
    pub fn set_step(&mut self, step: u64) {
        self.step = step;
    }

    /// First moment, second moment, averaged weights.
    pub fn state(&self) -> (&[f32], &[f32], &[f32]) {
        (&self.m, &self.v, &self.ema)
    }

    /// As [`Adam::state`], to be restored from a checkpoint.
    pub fn state_mut(&mut self) -> (&mut [f32], &mut [f32], &mut [f32]) {
        (&mut self.m, &mut self.v, &mut self.ema)
    }

    /// Moves `values` against `gradient` and updates the average
    /// (`ema = decay * ema + (1 - decay) * values`). Answers the gradient's norm before
    /// clipping; where that is not finite, nothing is changed.
    ///
    /// # Panics
    /// Where `values` or `gradient` differ in length from the vector the state was made for.
    pub fn step(&mut self, values: &mut [f32], gradient: &[f32], rate: f32, ema_decay: f32) -> f32 {
        assert_eq!(values.len(), self.m.len(), "values fit the state");
        assert_eq!(gradient.len(), self.m.len(), "gradient fits the state");
        let norm = self.norm(gradient);
        if !norm.is_finite() {
            return norm as f32;
        }
        let AdamConfig {
            beta1,
            beta2,
            epsilon,
            max_grad_norm,
        } = self.config;
        let clip = match max_grad_norm {
            Some(max) if norm > f64::from(max) => (f64::from(max) / norm) as f32,
            _ => 1.0,
        };
        self.step += 1;
        let correction = |beta: f32| 1.0 - f64::from(beta).powf(self.step as f64);
        let coefficients = Coefficients {
            clip,
            beta1,
            beta2,
            rate: (f64::from(rate) / correction(beta1)) as f32,
            scale: (1.0 / correction(beta2).sqrt()) as f32,
            epsilon,
            ema: 1.0 - ema_decay,
        };
        let isa = self.isa;
        let values = values.par_chunks_mut(BLOCK).zip(gradient.par_chunks(BLOCK));
        let moments = self
            .m
            .par_chunks_mut(BLOCK)
            .zip(self.v.par_chunks_mut(BLOCK));
        let blocks = values.zip(moments).zip(self.ema.par_chunks_mut(BLOCK));
        blocks.for_each(|(((values, gradient), (m, v)), ema)| {
            let slices = Slices {
                values,
                gradient,
                m,
                v,
                ema,
            };
            update(isa, coefficients, slices);
        });
        norm as f32
    }

    /// Euclidean norm; block sums are added in f64 and in order, so that it does not depend on
    /// how the work was shared.
    fn norm(&self, gradient: &[f32]) -> f64 {
        let blocks = gradient.par_chunks(BLOCK);
        let sums: Vec<f64> = blocks.map(|block| square_sum(self.isa, block)).collect();
        sums.iter().sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first two steps by hand: bias correction makes the first step `rate * sign(g)`.
    #[test]
    fn first_steps_by_hand() {
        let mut values = vec![1.0, -2.0];
        let mut adam = Adam::new(&values, AdamConfig::default());
        adam.step(&mut values, &[0.5, -3.0], 0.1, 0.5);
        assert!((values[0] - 0.9).abs() < 1e-6 && (values[1] + 1.9).abs() < 1e-6);
        assert!((adam.state().2[0] - 0.95).abs() < 1e-6);
        adam.step(&mut values, &[0.5, 0.0], 0.1, 0.5);
        // Second component: m = 0.9 * -0.3 / (1 - 0.81), v = 0.999 * 0.009 / (1 - 0.998001).
        let m = 0.9 * -0.3 / 0.19_f64;
        let v = (0.999 * 0.009 / (1.0 - 0.998_001_f64)).sqrt();
        assert!(
            (f64::from(values[1]) - (-1.9 - 0.1 * m / v)).abs() < 1e-5,
            "{}",
            values[1]
        );
    }

    #[test]
    fn clipping_scales_the_gradient_to_the_norm() {
        let clipped = AdamConfig {
            max_grad_norm: Some(1.0),
            ..AdamConfig::default()
        };
        let (mut a, mut b) = (vec![0.0; 2], vec![0.0; 2]);
        let mut x = Adam::new(&a, clipped);
        let mut y = Adam::new(&b, AdamConfig::default());
        assert_eq!(x.step(&mut a, &[30.0, 40.0], 0.1, 0.0), 50.0);
        y.step(&mut b, &[0.6, 0.8], 0.1, 0.0);
        for (x, y) in x.state().0.iter().zip(y.state().0) {
            assert!((x - y).abs() < 1e-7);
        }
    }

    #[test]
    fn a_gradient_that_is_not_finite_changes_nothing() {
        let mut values = vec![1.0];
        let mut adam = Adam::new(&values, AdamConfig::default());
        assert!(adam.step(&mut values, &[f32::NAN], 0.1, 0.9).is_nan());
        assert_eq!((values[0], adam.step_count()), (1.0, 0));
    }

    #[test]
    fn finds_the_minimum_of_a_quadratic() {
        let mut values = vec![3.0, -4.0];
        let mut adam = Adam::new(&values, AdamConfig::default());
        for _ in 0..2000 {
            let gradient: Vec<f32> = values.iter().map(|x| 2.0 * (x - 1.0)).collect();
            adam.step(&mut values, &gradient, 0.01, 0.9);
        }
        assert!(values.iter().all(|x| (x - 1.0).abs() < 1e-3), "{values:?}");
    }
}
