//! The scalar functions of the rotation angle in the formulas of SO(3) and SE(3).
//!
//! Each is even in the angle and smooth at 0, but its textbook form is 0/0 there; below
//! [`SERIES_BELOW`] a Taylor polynomial replaces it. The switch sits where the polynomial is exact to
//! rounding and the textbook form has not yet lost digits to cancellation.

/// Angle in radians below which the Taylor polynomials are used.
const SERIES_BELOW: f64 = 0.5;

/// Value at `x` of the polynomial with these coefficients, lowest order first.
fn polynomial(x: f64, coefficients: &[f64]) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// `sin(angle) / angle`.
pub(crate) fn sinc(angle: f64) -> f64 {
    // No cancellation here: only 0/0 itself has to be kept away.
    if angle == 0.0 {
        1.0
    } else {
        angle.sin() / angle
    }
}

/// `(1 - cos(angle)) / angle^2`, without cancellation at any angle.
pub(crate) fn versine_ratio(angle: f64) -> f64 {
    let half = sinc(0.5 * angle);
    0.5 * half * half
}

/// `(angle - sin(angle)) / angle^3`.
pub(crate) fn sine_defect_ratio(angle: f64) -> f64 {
    if angle.abs() < SERIES_BELOW {
        // sum over n of (-1)^n angle^(2n) / (2n + 3)!
        polynomial(
            angle * angle,
            &[
                1.0 / 6.0,
                -1.0 / 120.0,
                1.0 / 5_040.0,
                -1.0 / 362_880.0,
                1.0 / 39_916_800.0,
                -1.0 / 6_227_020_800.0,
            ],
        )
    } else {
        (angle - angle.sin()) / (angle * angle * angle)
    }
}

/// `(1 - (angle/2) cot(angle/2)) / angle^2`. Infinite at the non-zero multiples of 2 pi.
pub(crate) fn cotangent_ratio(angle: f64) -> f64 {
    if angle.abs() < SERIES_BELOW {
        // sum over n >= 1 of |B_2n| angle^(2n - 2) / (2n)!, B the Bernoulli numbers
        polynomial(
            angle * angle,
            &[
                1.0 / 12.0,
                1.0 / 720.0,
                1.0 / 30_240.0,
                1.0 / 1_209_600.0,
                1.0 / 47_900_160.0,
                691.0 / 1_307_674_368_000.0,
                1.0 / 74_724_249_600.0,
            ],
        )
    } else {
        let half = 0.5 * angle;
        (1.0 - half / half.tan()) / (angle * angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both sides of the switch must give the same number, or a Taylor coefficient is wrong.
    #[test]
    fn series_meets_closed_form_at_the_switch() {
        let below = SERIES_BELOW * (1.0 - 1e-15);
        for function in [sinc, versine_ratio, sine_defect_ratio, cotangent_ratio] {
            let (left, right) = (function(below), function(SERIES_BELOW));
            assert!((left / right - 1.0).abs() < 1e-14, "{left} {right}");
        }
    }

    #[test]
    fn limits_at_zero() {
        assert_eq!(sinc(0.0), 1.0);
        assert_eq!(versine_ratio(0.0), 0.5);
        assert_eq!(sine_defect_ratio(0.0), 1.0 / 6.0);
        assert_eq!(cotangent_ratio(0.0), 1.0 / 12.0);
    }

    #[test]
    fn values_at_pi() {
        use std::f64::consts::PI;
        assert!(sinc(PI).abs() < 1e-16);
        assert!((versine_ratio(PI) - 2.0 / (PI * PI)).abs() < 1e-16);
        assert!((sine_defect_ratio(PI) - 1.0 / (PI * PI)).abs() < 1e-16);
        assert!((cotangent_ratio(PI) - 1.0 / (PI * PI)).abs() < 1e-16);
    }
}
