//! Noise schedules: how much of the signal is left after `t` forward steps.

use crate::error::Error;
use serde::{Deserialize, Serialize};

/// A rule that gives every step its noise rate `beta_t`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseSchedule {
    /// `alpha_bar(u) = cos^2((u + s) / (1 + s) * pi / 2)`, `beta` clipped at 0.999
    /// (Nichol and Dhariwal 2021, equation 17).
    Cosine {
        /// The offset that keeps the first steps from being too small; 0.008 in the literature.
        offset: f64,
    },
    /// `beta` rises linearly (Ho et al. 2020). The authors' code uses 1e-4 to 0.02 for rotations,
    /// which at 30 steps leaves `alpha_bar = 0.74`: such a process never reaches the prior.
    Linear {
        /// `beta` of the first step.
        first: f64,
        /// `beta` of the last step.
        last: f64,
    },
    /// The ratio of noise to signal, `sqrt(1 - alpha_bar) / sqrt(alpha_bar)`, grows by the same
    /// factor at every step: noise levels evenly spaced in log sigma (Song and Ermon 2019), in the
    /// variance-preserving form used here. Faults of a sensor live at its own noise floor, far below
    /// the signal; a cosine schedule of 30 steps hardly looks there.
    LogSigma {
        /// Ratio of the first step.
        first: f64,
        /// Ratio of the last step.
        last: f64,
    },
}

impl NoiseSchedule {
    /// The cosine schedule with the usual offset 0.008.
    pub const COSINE: Self = Self::Cosine { offset: 0.008 };
    /// The linear schedule of the authors' code for rotations.
    pub const LINEAR: Self = Self::Linear {
        first: 1e-4,
        last: 0.02,
    };

    /// From far below what a sensor resolves, at data of unit size, to nothing but noise.
    pub const LOG_SIGMA: Self = Self::LogSigma {
        first: 0.003,
        last: 20.0,
    };

    fn betas(self, steps: usize) -> Vec<f64> {
        match self {
            Self::LogSigma { first, last } => {
                let alpha_bar = |t: usize| {
                    let u = if steps > 1 {
                        t as f64 / (steps - 1) as f64
                    } else {
                        0.0
                    };
                    let ratio = first * (last / first).powf(u);
                    1.0 / (1.0 + ratio * ratio)
                };
                (0..steps)
                    .map(|t| {
                        let before = if t == 0 { 1.0 } else { alpha_bar(t - 1) };
                        1.0 - alpha_bar(t) / before
                    })
                    .collect()
            }
            Self::Cosine { offset } => {
                let alpha_bar = |u: f64| {
                    let angle = (u + offset) / (1.0 + offset) * std::f64::consts::FRAC_PI_2;
                    angle.cos().powi(2)
                };
                (0..steps)
                    .map(|t| {
                        let (a, b) = (t as f64 / steps as f64, (t + 1) as f64 / steps as f64);
                        (1.0 - alpha_bar(b) / alpha_bar(a)).min(0.999)
                    })
                    .collect()
            }
            Self::Linear { first, last } => (0..steps)
                .map(|t| {
                    let u = if steps > 1 {
                        t as f64 / (steps - 1) as f64
                    } else {
                        0.0
                    };
                    first + u * (last - first)
                })
                .collect(),
        }
    }
}

/// More steps than any published process has; a file that asks for more is damaged.
const MAX_STEPS: usize = 100_000;

/// The numbers of one schedule for `t = 0 .. steps`; step 0 is the least noised one
/// (the paper's `t = 1`).
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    kind: NoiseSchedule,
    beta: Vec<f64>,
    alpha_bar: Vec<f64>,
}

impl Schedule {
    /// Tabulates `kind` over `steps` steps.
    ///
    /// # Errors
    /// [`Error::Schedule`] without a step, or where a `beta` is not inside (0, 1).
    pub fn new(kind: NoiseSchedule, steps: usize) -> Result<Self, Error> {
        if steps == 0 {
            return Err(Error::Schedule("needs at least one step".into()));
        }
        if steps > MAX_STEPS {
            return Err(Error::Schedule(format!(
                "{steps} steps, expected at most {MAX_STEPS}"
            )));
        }
        if let NoiseSchedule::Cosine { offset } = kind
            && !(offset.is_finite() && offset >= 0.0)
        {
            return Err(Error::Schedule(format!(
                "cosine offset {offset}, expected a number of 0 or more"
            )));
        }
        if let NoiseSchedule::LogSigma { first, last } = kind
            && !(first > 0.0 && first < last && last.is_finite())
        {
            return Err(Error::Schedule(format!(
                "ratios of noise to signal from {first} to {last}, expected positive ones that rise"
            )));
        }
        let beta = kind.betas(steps);
        if let Some((t, b)) = beta
            .iter()
            .enumerate()
            .find(|(_, b)| !(**b > 0.0 && **b < 1.0))
        {
            return Err(Error::Schedule(format!(
                "beta of step {t} is {b}, expected a number between 0 and 1 ({kind:?})"
            )));
        }
        let alpha_bar = beta
            .iter()
            .scan(1.0, |product, b| {
                *product *= 1.0 - b;
                Some(*product)
            })
            .collect();
        Ok(Self {
            kind,
            beta,
            alpha_bar,
        })
    }

    /// The rule the schedule was made from.
    pub fn kind(&self) -> NoiseSchedule {
        self.kind
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.beta.len()
    }

    /// `beta_t`, the noise rate of step `t`.
    pub fn beta(&self, t: usize) -> f64 {
        self.beta[t]
    }

    /// `alpha_bar_t`, the product of `1 - beta` up to and with step `t`.
    pub fn alpha_bar(&self, t: usize) -> f64 {
        self.alpha_bar[t]
    }

    /// `sqrt(alpha_bar_t)`, the share of the signal in `x_t`.
    pub fn signal(&self, t: usize) -> f64 {
        self.alpha_bar[t].sqrt()
    }

    /// `sqrt(1 - alpha_bar_t)`, the size of the noise in `x_t`.
    pub fn noise(&self, t: usize) -> f64 {
        (1.0 - self.alpha_bar[t]).sqrt()
    }

    /// The weights of `x0_hat` and `x_t` in the posterior mean `mu_t`
    /// (paper, equation of `mu_t`, in the consistent reading:
    /// `sqrt(alpha_bar_{t-1}) beta_t / (1 - alpha_bar_t)` and
    /// `sqrt(alpha_t) (1 - alpha_bar_{t-1}) / (1 - alpha_bar_t)`).
    pub fn posterior_weights(&self, t: usize) -> (f64, f64) {
        let previous = if t == 0 { 1.0 } else { self.alpha_bar[t - 1] };
        let rest = 1.0 - self.alpha_bar[t];
        (
            previous.sqrt() * self.beta[t] / rest,
            (1.0 - self.beta[t]).sqrt() * (1.0 - previous) / rest,
        )
    }

    /// Variance of the noise that ancestral sampling adds after step `t`: `beta_t` as in the
    /// paper, and none after step 0, whose posterior mean is `x0_hat` itself.
    pub fn sampling_variance(&self, t: usize) -> f64 {
        if t == 0 { 0.0 } else { self.beta[t] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cosine_reaches_the_prior_and_linear_does_not() {
        let cosine = Schedule::new(NoiseSchedule::COSINE, 30).unwrap();
        let linear = Schedule::new(NoiseSchedule::LINEAR, 30).unwrap();
        assert!(cosine.alpha_bar(29) < 1e-4);
        assert!(
            (linear.alpha_bar(29) - 0.74).abs() < 0.005,
            "{}",
            linear.alpha_bar(29)
        );
    }

    #[test]
    fn log_sigma_spaces_the_ratio_of_noise_to_signal_evenly() {
        let kind = NoiseSchedule::LogSigma {
            first: 0.002,
            last: 20.0,
        };
        let s = Schedule::new(kind, 5).unwrap();
        for (t, expected) in [0.002, 0.02, 0.2, 2.0, 20.0].into_iter().enumerate() {
            let ratio = s.noise(t) / s.signal(t);
            assert!((ratio / expected - 1.0).abs() < 1e-9, "step {t}: {ratio}");
        }
        for (first, last) in [
            (0.0, 1.0),
            (1.0, 0.5),
            (f64::NAN, 1.0),
            (0.1, f64::INFINITY),
        ] {
            assert!(Schedule::new(NoiseSchedule::LogSigma { first, last }, 5).is_err());
        }
    }

    #[test]
    fn signal_falls_and_noise_rises() {
        let log_sigma = NoiseSchedule::LogSigma {
            first: 0.002,
            last: 20.0,
        };
        for kind in [NoiseSchedule::COSINE, NoiseSchedule::LINEAR, log_sigma] {
            for steps in [1, 5, 30, 1000] {
                let s = Schedule::new(kind, steps).unwrap();
                for t in 1..steps {
                    assert!(s.alpha_bar(t) < s.alpha_bar(t - 1));
                }
                for t in 0..steps {
                    assert!((s.signal(t).powi(2) + s.noise(t).powi(2) - 1.0).abs() < 1e-12);
                }
            }
        }
    }

    /// Bayes' rule for Gaussians: the posterior mean of `x_{t-1}` given the true `x_0` and an
    /// `x_t` that equals its own expectation is the expectation of `x_{t-1}`.
    #[test]
    fn posterior_weights_keep_the_expectation() {
        let s = Schedule::new(NoiseSchedule::COSINE, 30).unwrap();
        for t in 1..30 {
            let (w0, wt) = s.posterior_weights(t);
            let expectation = w0 + wt * s.signal(t);
            assert!((expectation - s.signal(t - 1)).abs() < 1e-9, "step {t}");
        }
        assert_eq!(s.posterior_weights(0), (1.0, 0.0));
    }

    #[test]
    fn impossible_schedules_are_refused() {
        assert!(Schedule::new(NoiseSchedule::COSINE, 0).is_err());
        assert!(Schedule::new(NoiseSchedule::COSINE, usize::MAX).is_err());
        for offset in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(Schedule::new(NoiseSchedule::Cosine { offset }, 10).is_err());
        }
        assert!(
            Schedule::new(
                NoiseSchedule::Linear {
                    first: 0.5,
                    last: 1.5
                },
                10
            )
            .is_err()
        );
        assert!(
            Schedule::new(
                NoiseSchedule::Linear {
                    first: f64::NAN,
                    last: 0.5
                },
                10
            )
            .is_err()
        );
    }
}
