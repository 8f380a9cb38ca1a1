//! One score of several groups of statistics.
//!
//! A joint density over many weak columns loses what one strong column knew. The alternatives give
//! each group its own density, turn its score into a p-value under held-out trusted windows, and
//! combine those. The groups depend on each other, so the combined number is no p-value; it is
//! calibrated again, as any score.

use crate::density::log_sum_exp_of;
use crate::error::Error;
use crate::score::Score;
use crate::special::ln_gamma;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Terms of the exponential series for arguments below 1: the next one is below f64's precision.
const SERIES: usize = 20;

/// How groups become one score.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Combination {
    /// One density over all columns: the paper's way.
    #[default]
    Joint,
    /// Fisher's method: minus the logarithm of the chance that `-2 sum ln p` of k independent
    /// groups is as high (chi-square, 2k degrees of freedom). Strong where many groups move a bit.
    Fisher,
    /// Harmonic mean of the p-values (Wilson 2019). Robust to dependence between groups.
    HarmonicMean,
    /// The smallest p-value, times the number of groups (Bonferroni). Strong where one group moves.
    Maximum,
}

impl Combination {
    /// All ways.
    pub const ALL: [Combination; 4] = [
        Combination::Joint,
        Combination::Fisher,
        Combination::HarmonicMean,
        Combination::Maximum,
    ];

    /// The name used in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Combination::Joint => "joint",
            Combination::Fisher => "fisher",
            Combination::HarmonicMean => "harmonic-mean",
            Combination::Maximum => "maximum",
        }
    }

    /// The score of the groups' `ln p`. `Joint` has no p-values to combine and behaves as
    /// `Maximum`; the lowest score for no groups.
    #[must_use]
    pub fn score(self, ln_p: &[f64]) -> Score {
        let groups = ln_p.len() as f64;
        let combined = match self {
            _ if ln_p.is_empty() => 0.0,
            Combination::Fisher => ln_chi_square_tail(-ln_p.iter().sum::<f64>(), ln_p.len()),
            Combination::HarmonicMean => groups.ln() - log_sum_exp_of(ln_p.iter().map(|p| -p)),
            Combination::Joint | Combination::Maximum => {
                groups.ln() + ln_p.iter().copied().fold(f64::INFINITY, f64::min)
            }
        };
        Score::new(-combined)
    }
}

/// ln of the chance that a chi-square of 2k degrees of freedom is at least `2 half`, `half >= 0`:
/// `e^-half sum_{i < k} half^i / i!`. Near 0, where that is 1 to all digits, the rest of the exponential
/// series keeps them: `1 - e^-half sum_{i >= k} half^i / i!`.
fn ln_chi_square_tail(half: f64, k: usize) -> f64 {
    let term = |i: usize| power_ln(half, i) - ln_gamma(i as f64 + 1.0);
    if half < 1.0 {
        let rest: f64 = (k..k + SERIES).map(|i| (term(i) - half).exp()).sum();
        return (-rest).ln_1p();
    }
    log_sum_exp_of((0..k).map(term)) - half
}

/// ln(x^i) for x >= 0, with 0^0 = 1.
fn power_ln(x: f64, i: usize) -> f64 {
    if i == 0 { 0.0 } else { i as f64 * x.ln() }
}

impl fmt::Display for Combination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Combination {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let found = Self::ALL.into_iter().find(|c| c.name() == text.trim());
        found.ok_or_else(|| Error::Parameter {
            name: "combination",
            value: text.to_owned(),
            expected: "one of joint, fisher, harmonic-mean, maximum",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: Score, expected: f64) {
        assert!(
            (found.value() - expected).abs() < 1e-12,
            "{found:?} {expected}"
        );
    }

    #[test]
    fn combinations_by_hand() {
        let ln_p = [0.1_f64.ln(), 0.5_f64.ln()];
        // Two groups, h = ln 20: e^-h (1 + h) = (1 + ln 20) / 20.
        near(
            Combination::Fisher.score(&ln_p),
            -((1.0 + 20.0_f64.ln()) / 20.0).ln(),
        );
        // 2 / (10 + 2).
        near(Combination::HarmonicMean.score(&ln_p), 6.0_f64.ln());
        near(Combination::Maximum.score(&ln_p), 5.0_f64.ln());
        for way in [
            Combination::Fisher,
            Combination::HarmonicMean,
            Combination::Maximum,
        ] {
            // A single group keeps its p-value.
            near(way.score(&[0.03_f64.ln()]), -0.03_f64.ln());
        }
        near(Combination::Fisher.score(&[0.0, 0.0]), 0.0);
        // h = 0.3 lies on the other side of the series: e^-h (1 + h).
        let half = 0.3_f64;
        near(
            Combination::Fisher.score(&[-0.1, -0.2]),
            half - half.ln_1p(),
        );
    }

    #[test]
    fn fisher_keeps_p_values_near_one_apart() {
        // -ln(e^-h (1 + h)) = h^2 / 2 - h^3 / 3 + ..., which 1 - h^2 / 2 could not hold.
        let score = |h: f64| Combination::Fisher.score(&[-h, 0.0]).value();
        assert!((score(1e-20) / 0.5e-40 - 1.0).abs() < 1e-12);
        for k in 1..5 {
            let at = |h: f64| ln_chi_square_tail(h, k);
            assert!((at(1.0 - 1e-12) - at(1.0)).abs() < 1e-11, "{k}");
            for step in 0..400 {
                let h = 10.0_f64.powf(f64::from(step - 300) / 10.0);
                assert!(at(h * 1.01) < at(h) && at(h) < 0.0, "{k} {h}");
            }
        }
    }

    #[test]
    fn a_smaller_p_value_never_lowers_the_score_and_tiny_ones_stay_finite() {
        for way in [
            Combination::Fisher,
            Combination::HarmonicMean,
            Combination::Maximum,
        ] {
            let mut before = way.score(&[-0.1, -0.2, -0.3]);
            for step in 1..60 {
                let next = way.score(&[-0.1, -0.2 - f64::from(step), -0.3]);
                assert!(next >= before, "{way}");
                before = next;
            }
            assert!(way.score(&[-1e200, -1.0, -2.0]).value() > 1e100, "{way}");
        }
    }

    #[test]
    fn names_round_trip() {
        for way in Combination::ALL {
            assert_eq!(way.to_string().parse::<Combination>().unwrap(), way);
        }
        assert!("mean".parse::<Combination>().is_err());
    }
}
