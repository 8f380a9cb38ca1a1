//! How many windows beyond the threshold a trusted log may show.
//!
//! With n trusted logs no per-log p-value is below 1/(n+1); a finer alpha needs a model. Windows of
//! one log go beyond the threshold together (one log is bumpier than another), so their number is
//! not binomial: a limit from a binomial would flag every second log. The model is the simplest one
//! that knows this, a beta-binomial: each log has its own chance q of a window beyond the threshold,
//! q is drawn from a beta distribution with mean `rate` and correlation `rho` between two windows of
//! one log, and the number beyond among m windows is binomial. Both parameters are integrated out
//! over a grid, given what the held-out trusted logs showed, which makes the limit wide where there are
//! few logs (one included) and close to the observed shares where there are many.
//!
//! Priors: `rate` ~ Beta(1, 1/alpha - 1), whose mean is the alpha that the threshold was set for, by
//! construction; `rho` ~ Beta(1, 2), which leans towards logs that are alike. In simulations (60
//! windows, rate 0.05, alpha 0.05) false alarms per log were 2 to 4 % for rho = 0.1 and 5 to 7 % for
//! rho = 0.3 with 1 to 40 trusted logs; a uniform prior gave 2 to 4 % and 5 to 6 %, a Beta(1, 5) up
//! to 9 %.

use crate::density::log_sum_exp;
use crate::error::Error;
use crate::special::ln_gamma;

/// Points of the grid in each parameter.
const GRID: usize = 32;
/// Ends of the grid in logits: 0.0009 to 0.9991.
const LOGIT: f64 = 7.0;

/// The predicted number of windows beyond the threshold in a log like the trusted ones.
#[derive(Clone, Debug, PartialEq)]
pub struct SharePrediction {
    /// (ln posterior weight, a, b) of each beta distribution of the grid.
    grid: Vec<(f64, f64, f64)>,
}

impl SharePrediction {
    /// From `(beyond, windows)` of each held-out trusted log, counted in windows that do not
    /// overlap. `alpha` in (0, 1) is the share that the window threshold was set for.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an alpha outside of (0, 1), [`Error::Shape`] where more windows are
    /// beyond than there are.
    pub fn new(logs: &[(usize, usize)], alpha: f64) -> Result<Self, Error> {
        if !(alpha > 0.0 && alpha < 1.0) {
            return Err(Error::Parameter {
                name: "alpha of the window threshold",
                value: alpha.to_string(),
                expected: "must lie in (0, 1)",
            });
        }
        if let Some(&(beyond, windows)) = logs.iter().find(|(beyond, windows)| beyond > windows) {
            return Err(Error::Shape {
                what: "windows beyond the threshold (at most)",
                expected: windows,
                found: beyond,
            });
        }
        let mut grid = Vec::with_capacity(GRID * GRID);
        for rate in logit_grid() {
            for rho in logit_grid() {
                let (a, b) = (rate * (1.0 - rho) / rho, (1.0 - rate) * (1.0 - rho) / rho);
                // Both Jacobians of the even grid in logits, and the two prior densities.
                let jacobian = (rate * (1.0 - rate) * rho * (1.0 - rho)).ln();
                let prior = (1.0 / alpha - 2.0) * (1.0 - rate).ln() + (1.0 - rho).ln();
                let likelihood: f64 = logs.iter().map(|&(k, m)| ln_choose_beta(k, m, a, b)).sum();
                grid.push((jacobian + prior + likelihood, a, b));
            }
        }
        let terms: Vec<f64> = grid.iter().map(|g| g.0).collect();
        let total = log_sum_exp(&terms);
        for point in &mut grid {
            point.0 -= total;
        }
        Ok(Self { grid })
    }

    /// `P(K >= k)` for k = 0..=windows: the chance that a log like the trusted ones has so many of
    /// `windows` beyond the threshold.
    #[must_use]
    pub fn tails(&self, windows: usize) -> Vec<f64> {
        let mut mass = vec![0.0; windows + 1];
        for &(weight, a, b) in &self.grid {
            // Less than a billionth of the posterior cannot change a decision.
            if weight < -21.0 {
                continue;
            }
            let m = windows as f64;
            let mut term = weight + ln_beta(a, b + m) - ln_beta(a, b);
            for (k, sum) in mass.iter_mut().enumerate() {
                *sum += term.exp();
                let k = k as f64;
                if k < m {
                    term += ((m - k) * (k + a) / ((k + 1.0) * (m - k - 1.0 + b))).ln();
                }
            }
        }
        let mut tail = 0.0;
        for value in mass.iter_mut().rev() {
            tail += *value;
            *value = tail;
        }
        let whole = mass[0];
        mass.iter().map(|v| (v / whole).min(1.0)).collect()
    }

    /// The smallest number of `windows` beyond the threshold whose chance is at most `alpha`; `None`
    /// where even all of them are not rare enough.
    #[must_use]
    pub fn limit(&self, windows: usize, alpha: f64) -> Option<usize> {
        self.tails(windows).iter().position(|&tail| tail <= alpha)
    }
}

fn logit_grid() -> impl Iterator<Item = f64> {
    (0..GRID).map(|i| {
        let logit = LOGIT * (2.0 * i as f64 / (GRID - 1) as f64 - 1.0);
        1.0 / (1.0 + (-logit).exp())
    })
}

fn ln_beta(a: f64, b: f64) -> f64 {
    ln_gamma(a) + ln_gamma(b) - ln_gamma(a + b)
}

/// ln of the beta-binomial chance of k in m.
fn ln_choose_beta(k: usize, m: usize, a: f64, b: f64) -> f64 {
    let (k, m) = (k as f64, m as f64);
    let choose = ln_gamma(m + 1.0) - ln_gamma(k + 1.0) - ln_gamma(m - k + 1.0);
    choose + ln_beta(k + a, m - k + b) - ln_beta(a, b)
}

/// Windows that share no pose, out of overlapping ones: of `windows`, every `overlap`-th. The number
/// beyond the threshold shrinks alike, rounded to the nearest for what is learnt from.
pub(crate) fn thin(beyond: usize, windows: usize, overlap: usize) -> (usize, usize) {
    let thinned = windows.div_ceil(overlap.max(1));
    let share = beyond as f64 / windows.max(1) as f64;
    ((share * thinned as f64).round() as usize, thinned)
}

/// As [`thin`], rounded down for what is decided on: never more evidence than there is.
pub(crate) fn thin_down(beyond: usize, windows: usize, overlap: usize) -> (usize, usize) {
    let thinned = windows.div_ceil(overlap.max(1));
    (beyond * thinned / windows.max(1), thinned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beta_binomial_by_hand() {
        // a = b = 1: uniform on 0..=m.
        for k in 0..=4 {
            assert!((ln_choose_beta(k, 4, 1.0, 1.0) - 0.2_f64.ln()).abs() < 1e-12);
        }
        // a = 2, b = 3, k = 1, m = 2: 2 B(3, 4) / B(2, 3) = 2 (1/60) / (1/12) = 0.4.
        assert!((ln_choose_beta(1, 2, 2.0, 3.0) - 0.4_f64.ln()).abs() < 1e-12);
        assert_eq!(thin(5, 10, 4), (2, 3));
        assert_eq!(thin_down(5, 10, 4), (1, 3));
        assert_eq!(thin_down(10, 10, 4), (3, 3));
        assert_eq!(thin_down(2, 3, 4), (0, 1));
    }

    #[test]
    fn tails_fall_from_one_and_agree_with_the_direct_sum() {
        let prediction = SharePrediction::new(&[(1, 20), (0, 30), (4, 25)], 0.05).unwrap();
        let tails = prediction.tails(7);
        assert_eq!(tails[0], 1.0);
        assert!(tails.windows(2).all(|w| w[1] < w[0]));
        let direct = |from: usize| -> f64 {
            let of = |&(w, a, b): &(f64, f64, f64)| -> f64 {
                (from..=7)
                    .map(|k| (w + ln_choose_beta(k, 7, a, b)).exp())
                    .sum()
            };
            prediction.grid.iter().map(of).sum()
        };
        for (k, tail) in tails.iter().enumerate() {
            assert!((tail - direct(k)).abs() < 1e-7);
        }
    }

    #[test]
    fn more_logs_that_agree_tighten_the_limit() {
        let limit = |logs: usize| {
            let seen = vec![(5, 100); logs];
            SharePrediction::new(&seen, 0.05)
                .unwrap()
                .limit(100, 0.05)
                .unwrap()
        };
        let limits = [limit(1), limit(3), limit(10), limit(40)];
        assert!(limits.windows(2).all(|w| w[1] <= w[0]), "{limits:?}");
        // With many logs it comes to the binomial limit: P(K >= 10 | 100, 0.05) = 0.028.
        assert!((9..=11).contains(&limits[3]), "{limits:?}");
        assert!(limits[0] < 100, "one log can still reject: {limits:?}");
    }

    #[test]
    fn logs_that_differ_widen_it() {
        let alike = SharePrediction::new(&[(5, 100); 8], 0.05).unwrap();
        let unlike = [
            (0, 100),
            (20, 100),
            (0, 100),
            (1, 100),
            (15, 100),
            (0, 100),
            (4, 100),
            (0, 100),
        ];
        let unlike = SharePrediction::new(&unlike, 0.05).unwrap();
        let (a, b) = (
            alike.limit(100, 0.05).unwrap(),
            unlike.limit(100, 0.05).unwrap(),
        );
        assert!(b > a + 5 && b < 40, "{a} {b}");
    }

    #[test]
    fn without_any_log_all_windows_beyond_is_still_rare() {
        let prediction = SharePrediction::new(&[], 0.05).unwrap();
        for windows in [2, 5, 50] {
            assert!(prediction.limit(windows, 0.05).is_some(), "{windows}");
            assert_eq!(prediction.limit(windows, 1e-9), None);
        }
    }

    #[test]
    fn false_alarms_are_near_alpha_when_the_model_holds() {
        use rand::{RngExt, SeedableRng};
        use rand_distr::{Beta, Distribution};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        // rate 0.05, rho 0.1: a = 0.45, b = 8.55.
        let beta = Beta::new(0.45, 8.55).unwrap();
        let mut log = |m: usize| {
            let q = beta.sample(&mut rng);
            ((0..m).filter(|_| rng.random::<f64>() < q).count(), m)
        };
        for logs in [2, 4, 10] {
            let mut alarms = 0;
            for _ in 0..400 {
                let trusted: Vec<_> = (0..logs).map(|_| log(60)).collect();
                let prediction = SharePrediction::new(&trusted, 0.05).unwrap();
                let (beyond, windows) = log(60);
                alarms += usize::from(prediction.tails(windows)[beyond] <= 0.05);
            }
            assert!((4..=28).contains(&alarms), "{logs} logs: {alarms} of 400");
        }
    }

    #[test]
    fn bad_input_is_an_error() {
        assert!(SharePrediction::new(&[(3, 2)], 0.05).is_err());
        for alpha in [0.0, 1.0, f64::NAN] {
            assert!(SharePrediction::new(&[(1, 2)], alpha).is_err());
        }
    }
}
