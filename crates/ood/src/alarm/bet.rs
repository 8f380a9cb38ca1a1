//! From p-values to bets.

/// Below this many nats the series of the bet around p = 1 is used.
const NEAR_ONE: f64 = 1e-3;
/// Beyond this many nats e^x - 1 - x is e^x to all digits.
const FAR: f64 = 40.0;

/// The logarithm of the mixture of the calibrators `kappa p^(kappa - 1)` over kappa in (0, 1), `(1 - p + p ln p) /
/// (p ln^2 p)` (Vovk and Wang 2021, "E-values: calibration, combination and applications"): an e-value of a p-value,
/// whatever kappa would have been best. `ln_p` is at most 0; 1/2 at p = 1.
///
/// ```
/// use dose3_ood::alarm::ln_bet;
///
/// assert!((ln_bet(0.0) - 0.5_f64.ln()).abs() < 1e-12);
/// assert!((ln_bet(1e-4_f64.ln()).exp() - 117.8).abs() < 0.1);
/// ```
#[must_use]
pub fn ln_bet(ln_p: f64) -> f64 {
    // With x = -ln p the bet is (e^x - 1 - x) / x^2.
    let x = -ln_p.min(0.0);
    if x < NEAR_ONE {
        return (0.5 + x / 6.0 + x * x / 24.0).ln();
    }
    if x > FAR {
        return x - 2.0 * x.ln();
    }
    (x.exp_m1() - x).ln() - 2.0 * x.ln()
}

#[cfg(test)]
mod tests {
    use super::ln_bet;

    #[test]
    fn its_expectation_under_a_uniform_p_is_one() {
        // p = e^-x: the integral of bet(x) e^-x over x.
        let step = 1e-3;
        let sum: f64 = (0..2_000_000)
            .map(|i| {
                let x = (f64::from(i) + 0.5) * step;
                (ln_bet(-x) - x).exp() * step
            })
            .sum();
        // What lies beyond x = 2000 is 1 / 2000.
        assert!((sum + 1.0 / 2000.0 - 1.0).abs() < 1e-4, "{sum}");
    }

    #[test]
    fn it_rises_and_joins_its_pieces() {
        let mut before = ln_bet(0.0);
        for i in 1..2000 {
            let now = ln_bet(-0.05 * f64::from(i));
            assert!(now > before, "{i}");
            before = now;
        }
        for edge in [super::NEAR_ONE, super::FAR] {
            let jump = ln_bet(-edge * (1.0 + 1e-12)) - ln_bet(-edge * (1.0 - 1e-12));
            assert!(jump.abs() < 1e-6, "{edge}: {jump}");
        }
        assert!(ln_bet(-1e6).is_finite());
    }
}
