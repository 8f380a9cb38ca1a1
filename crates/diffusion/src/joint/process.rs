//! Noising of steps on R^3 x SO(3).

use super::levels::Levels;
use crate::error::{Error, check_len};
use crate::window::normals;
use dose3_lie::{Rotation, Vector, so3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Axes of a step: translation x, y, z, rotation tangent x, y, z.
pub const AXES: usize = 6;
/// The network sees no larger input: a jump of a thousand scales is as unknown to it as one of twelve.
const LARGEST_INPUT: f64 = 12.0;
/// A step counts as no larger than this many scales, so that squares stay finite in f32.
const LARGEST_STEP: f64 = 1e6;
/// No coordinate of a rotation tangent is larger, radians.
const LARGEST_TURN: f64 = 10.0;

/// Steps of one sequence in units of a scale, ready to be noised.
#[derive(Clone, Debug)]
pub struct JointProcess {
    scale: [f64; AXES],
    /// Scaled, by step and axis.
    x: Vec<[f64; AXES]>,
    rotations: Vec<Rotation>,
}

/// A noised sequence.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Noised {
    /// What the network sees: `[length, 6]`.
    pub input: Vec<f32>,
    /// What it should say; 0 for clean axes.
    pub target: Vec<f32>,
}

impl JointProcess {
    /// Of `[length, 6]` steps, metres and radians; `scale` is positive.
    ///
    /// # Errors
    /// [`Error::Shape`] where they are no multiple of six numbers, [`Error::Config`] for a scale or a step that is not
    /// finite or not positive.
    pub fn new(steps: &[[f64; AXES]], scale: [f64; AXES]) -> Result<Self, Error> {
        if !scale.iter().all(|s| s.is_finite() && *s > 0.0) {
            return Err(Error::Config {
                name: "scale of the axes",
                found: format!("{scale:?}"),
                expected: "positive numbers",
            });
        }
        if let Some(step) = steps.iter().flatten().find(|x| !x.is_finite()) {
            return Err(Error::Config {
                name: "steps of a body",
                found: step.to_string(),
                expected: "finite numbers",
            });
        }
        let scaled = |step: &[f64; AXES]| {
            std::array::from_fn(|a| (step[a] / scale[a]).clamp(-LARGEST_STEP, LARGEST_STEP))
        };
        let rotation = |step: &[f64; AXES]| {
            // No logarithm of a rotation is longer than pi.
            let at = |axis: usize| step[axis].clamp(-LARGEST_TURN, LARGEST_TURN);
            so3::exp(&Vector::new(at(3), at(4), at(5)))
        };
        Ok(Self {
            scale,
            x: steps.iter().map(scaled).collect(),
            rotations: steps.iter().map(rotation).collect(),
        })
    }

    /// Number of steps.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// The steps in units of the scale.
    pub fn steps(&self) -> &[[f64; AXES]] {
        &self.x
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Noises the steps by `noise`, `[length, 6]` standard normal numbers.
    ///
    /// # Errors
    /// [`Error::Shape`] for another amount of noise.
    pub fn noised(&self, levels: &Levels, noise: &[f32], to: &mut Noised) -> Result<(), Error> {
        check_len("noise of a sequence", self.len() * AXES, noise.len())?;
        let coefficients: [[f64; 3]; AXES] = std::array::from_fn(|a| levels.coefficients(a));
        let turns = levels.0[3..].iter().any(|sigma| *sigma > 0.0);
        to.input.clear();
        to.target.clear();
        for ((x0, rotation), eps) in self.x.iter().zip(&self.rotations).zip(noise.chunks(AXES)) {
            let mut xt = *x0;
            for axis in 0..AXES / 2 {
                xt[axis] += levels.0[axis] * f64::from(eps[axis]);
            }
            if turns {
                let tangent = |i: usize| self.scale[i] * levels.0[i] * f64::from(eps[i]);
                let noise = so3::exp(&Vector::new(tangent(3), tangent(4), tangent(5)));
                let log = so3::log(&(rotation * noise));
                for i in 0..AXES / 2 {
                    // Clean axes of a noised rotation keep their place but for what the product mixes in.
                    xt[3 + i] = log[i] / self.scale[3 + i];
                }
            }
            for axis in 0..AXES {
                let [skip, scale_in, out] = coefficients[axis];
                let input = (scale_in * xt[axis]).clamp(-LARGEST_INPUT, LARGEST_INPUT);
                to.input.push(input as f32);
                let target = match out > 0.0 {
                    true => (x0[axis] - skip * xt[axis]) / out,
                    false => 0.0,
                };
                to.target.push(target as f32);
            }
        }
        Ok(())
    }
}

/// `count` standard normal numbers of a seed; streams of one seed are independent of each other.
pub fn standard_normal(seed: u64, stream: u64, count: usize) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    normals(&mut rng, count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps() -> Vec<[f64; AXES]> {
        let wave = |t: usize, a: usize| ((t * (a + 2)) as f64 * 0.37).sin();
        (0..40)
            .map(|t| std::array::from_fn(|a| wave(t, a) * if a < 3 { 0.8 } else { 0.3 }))
            .collect()
    }

    const SCALE: [f64; AXES] = [0.5, 0.1, 0.2, 0.1, 0.3, 0.2];

    fn noise(length: usize) -> Vec<f32> {
        standard_normal(5, 0, length * AXES)
    }

    #[test]
    fn the_inverse_undoes_the_group_product() {
        let (steps, eps) = (steps(), noise(40));
        let process = JointProcess::new(&steps, SCALE).unwrap();
        let levels = Levels([0.3, 2.0, 0.0, 1.0, 0.0, 3.0]);
        let mut noised = Noised::default();
        process.noised(&levels, &eps, &mut noised).unwrap();
        for (t, step) in steps.iter().enumerate() {
            // From the input back to the noised rotation, then by the inverse noise to the clean one.
            let at = |a: usize| {
                let [_, scale_in, _] = levels.coefficients(a);
                f64::from(noised.input[t * AXES + a]) / scale_in * SCALE[a]
            };
            let e = |a: usize| SCALE[a] * levels.0[a] * f64::from(eps[t * AXES + a]);
            let rotation = so3::exp(&Vector::new(at(3), at(4), at(5)));
            let back = so3::log(&(rotation * so3::exp(&-Vector::new(e(3), e(4), e(5)))));
            for i in 0..3 {
                assert!((back[i] - step[3 + i]).abs() < 1e-5, "{t}: {back}");
                assert!((at(i) - e(i) - step[i]).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn the_target_takes_the_input_to_the_clean_step() {
        let (steps, eps) = (steps(), noise(40));
        let process = JointProcess::new(&steps, SCALE).unwrap();
        let mut noised = Noised::default();
        for levels in [Levels::all(0.7), Levels::only(5.0, |axis| axis >= 3)] {
            process.noised(&levels, &eps, &mut noised).unwrap();
            for (i, (input, target)) in noised.input.iter().zip(&noised.target).enumerate() {
                let axis = i % AXES;
                let [skip, scale_in, out] = levels.coefficients(axis);
                let x0 = steps[i / AXES][axis] / SCALE[axis];
                if out == 0.0 {
                    assert_eq!(*target, 0.0);
                    assert!((f64::from(*input) - x0).abs() < 1e-5);
                } else {
                    let found = skip / scale_in * f64::from(*input) + out * f64::from(*target);
                    assert!((found - x0).abs() < 1e-4, "{found} {x0}");
                }
            }
        }
    }

    #[test]
    fn wild_steps_stay_finite_and_bad_ones_are_refused() {
        let process = JointProcess::new(&[[1e200; AXES]; 3], SCALE).unwrap();
        let mut noised = Noised::default();
        let levels = Levels::all(0.1);
        process.noised(&levels, &noise(3), &mut noised).unwrap();
        let all = noised.input.iter().chain(&noised.target);
        assert!(all.clone().all(|x| x.is_finite()));
        assert!(process.noised(&levels, &noise(2), &mut noised).is_err());
        assert!(JointProcess::new(&[[f64::NAN; AXES]], SCALE).is_err());
        assert!(JointProcess::new(&steps(), [0.0; AXES]).is_err());
    }
}
