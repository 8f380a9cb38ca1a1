//! Adam with global-norm gradient clipping and a moving average of the weights, over one flat
//! parameter vector.

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
#[derive(Clone, Debug)]
pub struct Adam {
    config: AdamConfig,
    step: u64,
    m: Vec<f32>,
    v: Vec<f32>,
    ema: Vec<f32>,
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
        // In f64 and in order: the norm must not depend on how the sum is split.
        let norm = gradient
            .iter()
            .map(|g| f64::from(*g) * f64::from(*g))
            .sum::<f64>()
            .sqrt();
        if !norm.is_finite() {
            return norm as f32;
        }
        let clip = match self.config.max_grad_norm {
            Some(max) if norm > f64::from(max) => (f64::from(max) / norm) as f32,
            _ => 1.0,
        };
        self.step += 1;
        let AdamConfig {
            beta1,
            beta2,
            epsilon,
            ..
        } = self.config;
        let correction = |beta: f32| 1.0 - f64::from(beta).powf(self.step as f64);
        let scale1 = (f64::from(rate) / correction(beta1)) as f32;
        let scale2 = (1.0 / correction(beta2).sqrt()) as f32;
        let state = self.m.iter_mut().zip(&mut self.v).zip(&mut self.ema);
        for ((value, g), ((m, v), ema)) in values.iter_mut().zip(gradient).zip(state) {
            let g = g * clip;
            *m = beta1 * *m + (1.0 - beta1) * g;
            *v = beta2 * *v + (1.0 - beta2) * g * g;
            *value -= scale1 * *m / (v.sqrt() * scale2 + epsilon);
            *ema += (1.0 - ema_decay) * (*value - *ema);
        }
        norm as f32
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
