//! Special functions.

/// ln Gamma(x) for x > 0, relative error below 1e-13: Lanczos approximation, g = 7, 9 terms
/// (Godfrey's coefficients).
pub(crate) fn ln_gamma(x: f64) -> f64 {
    const COEFFICIENTS: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    if x < 0.5 {
        // Reflection.
        let pi = std::f64::consts::PI;
        return (pi / (pi * x).sin()).ln() - ln_gamma(1.0 - x);
    }
    let x = x - 1.0;
    let base = x + 7.5;
    let mut sum = COEFFICIENTS[0];
    for (i, c) in COEFFICIENTS.iter().enumerate().skip(1) {
        sum += c / (x + i as f64);
    }
    0.5 * std::f64::consts::TAU.ln() + (x + 0.5) * base.ln() - base + sum.ln()
}

/// Chance that a Student variable of `freedom >= 2` degrees exceeds `t >= 0`, to about eight digits.
pub(crate) fn student_tail(t: f64, freedom: f64) -> f64 {
    const HALVES: usize = 512;
    if t <= 0.0 {
        return 0.5;
    }
    // Below 1 the other side is integrated: there the substitution x = t / s has nothing far out to reach.
    let constant = ln_gamma(0.5 * (freedom + 1.0))
        - ln_gamma(0.5 * freedom)
        - 0.5 * (freedom * std::f64::consts::PI).ln();
    let density = |x: f64| (constant - 0.5 * (freedom + 1.0) * (x * x / freedom).ln_1p()).exp();
    let simpson = |f: &dyn Fn(f64) -> f64| {
        let step = 1.0 / HALVES as f64;
        let weight = |i: usize| match i {
            0 | HALVES => 1.0,
            _ if i % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let sum: f64 = (0..=HALVES).map(|i| weight(i) * f(i as f64 * step)).sum();
        sum * step / 3.0
    };
    if t < 1.0 {
        return 0.5 - simpson(&|s| t * density(t * s));
    }
    simpson(&|s| match s {
        0.0 => 0.0,
        _ => density(t / s) * t / (s * s),
    })
}

#[cfg(test)]
mod tests {
    use super::{ln_gamma, student_tail};

    #[test]
    fn student_by_closed_forms() {
        // Two degrees of freedom: (1 - t / sqrt(t^2 + 2)) / 2.
        for t in [0.0, 0.3, 1.0, 2.5, 9.0, 40.0] {
            let exact = 0.5 * (1.0 - t / f64::sqrt(t * t + 2.0));
            assert!(
                (student_tail(t, 2.0) - exact).abs() < 1e-6 * exact.max(1e-2),
                "{t}"
            );
        }
        // 2.228 is the 97.5 % point of ten degrees, 3.169 the 99.5 % point.
        assert!((student_tail(2.228_138_85, 10.0) - 0.025).abs() < 1e-8);
        assert!((student_tail(3.169_272_67, 10.0) - 0.005).abs() < 1e-8);
    }

    #[test]
    fn factorials_and_halves() {
        let mut factorial = 0.0_f64;
        for n in 1..60 {
            assert!((ln_gamma(f64::from(n)) - factorial).abs() <= 1e-12 * factorial.max(1.0));
            factorial += f64::from(n).ln();
        }
        assert!((ln_gamma(0.5) - 0.5 * std::f64::consts::PI.ln()).abs() < 1e-13);
        assert!((ln_gamma(1e-3) - 6.907_178_885_383_853).abs() < 1e-12);
    }
}
