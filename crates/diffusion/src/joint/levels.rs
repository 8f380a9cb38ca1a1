//! Noise levels, one for each axis, and what follows from them.

use super::process::AXES;
use dose3_model::joint::CONDITIONS;
use rand::{Rng, RngExt};

/// What a clean axis is told to have: far below every level that is trained.
const CLEAN: f64 = 1e-3;
/// Smallest and largest level of training.
const TRAINED: [f64; 2] = [0.03, 10.0];

/// A noise level for each axis, in units of its scale; 0 for one without noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels(pub [f64; AXES]);

impl Levels {
    /// The same on all axes.
    pub fn all(sigma: f64) -> Self {
        Self([sigma; AXES])
    }

    /// On the axes that `noised` names, the others clean.
    pub fn only(sigma: f64, noised: impl Fn(usize) -> bool) -> Self {
        Self(std::array::from_fn(
            |axis| if noised(axis) { sigma } else { 0.0 },
        ))
    }

    /// As in training: even in log sigma; all axes alike in four of ten cases, else one branch or one axis, the
    /// others clean.
    pub(super) fn draw(rng: &mut impl Rng) -> Self {
        let [least, most] = TRAINED.map(f64::ln);
        let sigma = rng.random_range(least..most).exp();
        match rng.random_range(0..10) {
            0..4 => Self::all(sigma),
            4..7 => {
                let rotation = rng.random_range(0..2) == 1;
                Self::only(sigma, |axis| (axis >= AXES / 2) == rotation)
            }
            _ => {
                let one = rng.random_range(0..AXES);
                Self::only(sigma, |axis| axis == one)
            }
        }
    }

    /// How many axes are noised.
    pub fn noised(&self) -> usize {
        self.0.iter().filter(|sigma| **sigma > 0.0).count()
    }

    /// What the network is told: the levels, and the time between steps in seconds.
    pub fn conditions(&self, step: f64) -> [f32; CONDITIONS] {
        let mut conditions = [time_condition(step); CONDITIONS];
        for (condition, sigma) in conditions.iter_mut().zip(self.0) {
            *condition = (0.5 * sigma.max(CLEAN).ln()) as f32;
        }
        conditions
    }

    /// `c_skip`, `c_in` and `c_out` of an axis.
    pub fn coefficients(&self, axis: usize) -> [f64; 3] {
        let sigma = self.0[axis];
        let scale_in = (1.0 + sigma * sigma).sqrt().recip();
        [scale_in * scale_in, scale_in, sigma * scale_in]
    }
}

/// How a time between steps, in seconds, is told to the network: 0 at 10 Hz.
pub fn time_condition(step: f64) -> f32 {
    (0.5 * (step.clamp(1e-3, 10.0) / 0.1).ln()) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn drawn_levels_are_of_the_three_kinds() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut counts = [0; AXES + 1];
        for _ in 0..2000 {
            let levels = Levels::draw(&mut rng);
            counts[levels.noised()] += 1;
            let top = levels.0.iter().fold(0.0_f64, |m, s| m.max(*s));
            assert!((TRAINED[0]..TRAINED[1]).contains(&top));
            assert!(levels.0.iter().all(|s| *s == 0.0 || *s == top));
        }
        assert_eq!(counts[1] + counts[3] + counts[6], 2000);
        assert!((700..900).contains(&counts[6]), "{counts:?}");
        assert!((500..700).contains(&counts[3]), "{counts:?}");
    }

    #[test]
    fn coefficients_keep_the_size() {
        let levels = Levels::all(2.0);
        let [skip, scale_in, out] = levels.coefficients(0);
        // Input variance (1 + sigma^2) c_in^2; target variance ((1 - c_skip)^2 + (c_skip sigma)^2) / c_out^2.
        assert!(((1.0 + 4.0) * scale_in * scale_in - 1.0).abs() < 1e-12);
        let target = ((1.0 - skip).powi(2) + 4.0 * skip * skip) / (out * out);
        assert!((target - 1.0).abs() < 1e-12);
        assert_eq!(Levels::all(0.0).coefficients(3), [1.0, 1.0, 0.0]);
    }

    #[test]
    fn conditions_lie_within_the_features() {
        let told = Levels::only(10.0, |axis| axis < 3).conditions(0.5);
        assert!(told.iter().all(|c| c.abs() < 4.0), "{told:?}");
        assert!(told[0] > 1.0 && told[5] < -3.0 && told[6] > 0.5);
        assert_eq!(time_condition(0.1), 0.0);
    }
}
