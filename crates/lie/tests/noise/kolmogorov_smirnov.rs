//! The Kolmogorov-Smirnov test.

/// Critical value of `sqrt(n) D` at significance 1e-6, for large `n`: `2 exp(-2 x^2)` is the chance that a
/// sample from the right law exceeds it. So small because the suite asks about 50 times, and no seed is
/// to be picked for passing; the samples are large enough that wrong laws still fail.
const CRITICAL: f64 = 2.7;

/// `sqrt(n)` times the largest distance of the empirical distribution of `sample` from `cdf`.
pub fn statistic(mut sample: Vec<f64>, cdf: impl Fn(f64) -> f64) -> f64 {
    sample.sort_by(f64::total_cmp);
    let count = sample.len() as f64;
    let distance = sample.iter().enumerate().map(|(rank, &value)| {
        let expected = cdf(value);
        let (below, above) = (rank as f64 / count, (rank + 1) as f64 / count);
        (expected - below).max(above - expected)
    });
    count.sqrt() * distance.fold(0.0, f64::max)
}

/// Whether the sample may come from `cdf`, at significance 1e-6.
pub fn fits(sample: Vec<f64>, cdf: impl Fn(f64) -> f64) -> bool {
    statistic(sample, cdf) < CRITICAL
}

#[test]
fn four_points_by_hand() {
    // Empirical cdf: 1/4 at 0.1, 2/4 at 0.2, 3/4 at 0.3, 1 at 0.6. Largest gap from x: 3/4 - 0.3.
    let statistic = statistic(vec![0.6, 0.1, 0.3, 0.2], |x| x);
    assert!((statistic - 2.0 * 0.45).abs() < 1e-15);
}
