//! Student's t distribution.

use crate::special::ln_gamma;

/// Chance of a value at least as far from zero as `t`, either side; `degrees` above 0.
///
/// The regularised incomplete beta function `I_x(degrees / 2, 1 / 2)` at `x = degrees / (degrees + t^2)`, by its
/// continued fraction (Abramowitz and Stegun 26.5.8, evaluated as Lentz does).
pub(super) fn two_sided(t: f64, degrees: f64) -> f64 {
    let (a, b) = (degrees / 2.0, 0.5);
    let x = degrees / (degrees + t * t);
    // The fraction converges fast only below the mean of the distribution.
    let chance = if x < (a + 1.0) / (a + b + 2.0) {
        incomplete(x, a, b)
    } else {
        1.0 - incomplete(1.0 - x, b, a)
    };
    chance.clamp(0.0, 1.0)
}

fn incomplete(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let front = ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (-x).ln_1p();
    front.exp() / a * fraction(x, a, b)
}

fn fraction(x: f64, a: f64, b: f64) -> f64 {
    const SMALLEST: f64 = 1e-300;
    let guard = |v: f64| if v.abs() < SMALLEST { SMALLEST } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / guard(1.0 - (a + b) * x / (a + 1.0));
    let mut value = d;
    for i in 1..200 {
        let m = f64::from(i);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let mut change = 1.0;
        for term in [even, odd] {
            d = 1.0 / guard(1.0 + term * d);
            c = guard(1.0 + term / c);
            value *= c * d;
            change = c * d;
        }
        if (change - 1.0_f64).abs() < 1e-15 {
            break;
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::two_sided;

    #[test]
    fn closed_forms() {
        for t in [0.0, 0.3, 1.0, 2.5, 12.0, 1e3] {
            // One degree is Cauchy's distribution, two have a root.
            let cauchy = 1.0 - 2.0 / std::f64::consts::PI * f64::atan(t);
            assert!((two_sided(t, 1.0) - cauchy).abs() < 1e-12, "{t}");
            let two = 1.0 - t / (2.0 + t * t).sqrt();
            assert!((two_sided(t, 2.0) - two).abs() < 1e-12, "{t}");
            assert_eq!(two_sided(t, 5.0), two_sided(-t, 5.0));
        }
        // Table of the distribution, 10 degrees.
        assert!((two_sided(2.228_138_851_964_939, 10.0) - 0.05).abs() < 1e-9);
        // Nearly normal.
        assert!((two_sided(1.959_963_984_540_054, 1e6) - 0.05).abs() < 1e-5);
    }
}
