//! Smoothed histograms.

use dose3_ood::statistics::quantile_sorted;
use std::f64::consts::TAU;
use std::ops::Range;

/// Points of a curve.
const POINTS: usize = 400;
/// Kernels are cut off at so many bandwidths.
const REACH: f64 = 5.0;

/// A Gaussian kernel density estimate of `values` at evenly spaced points of `range`. Values beyond the range
/// count, so that the area under the curve is the share of the values within it. Empty for no values or an
/// empty range.
pub fn density(values: &[f64], range: &Range<f64>) -> Vec<(f64, f64)> {
    let step = (range.end - range.start) / (POINTS - 1) as f64;
    if values.is_empty() || !(step.is_finite() && step > 0.0) {
        return Vec::new();
    }
    let width = bandwidth(values).max(step);
    let reach = (REACH * width / step).ceil() as usize;
    let kernel: Vec<f64> = (0..=reach)
        .map(|i| (-0.5 * (i as f64 * step / width).powi(2)).exp() / (width * TAU.sqrt()))
        .collect();
    let counts = bins(
        values,
        range.start - reach as f64 * step,
        step,
        POINTS + 2 * reach,
    );
    (0..POINTS)
        .map(|i| {
            let around = &counts[i..=i + 2 * reach];
            let weighted = around.iter().enumerate();
            let sum: f64 = weighted.map(|(j, n)| n * kernel[j.abs_diff(reach)]).sum();
            (range.start + i as f64 * step, sum / values.len() as f64)
        })
        .collect()
}

/// Silverman's rule of thumb with the smaller of the two scales, which a few far values do not blow up.
fn bandwidth(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let quartiles = quantile_sorted(&sorted, 0.75) - quantile_sorted(&sorted, 0.25);
    let (_, deviation) = mean_and_deviation(values);
    let scale = match quartiles / 1.349 {
        robust if robust > 0.0 => robust.min(deviation),
        _ => deviation,
    };
    0.9 * scale * n.powf(-0.2)
}

/// Mean and standard deviation; (0, 0) for no values.
pub fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (squares / n).sqrt())
}

/// Each value is shared between the two nearest points of a grid; those beyond the grid are left out.
fn bins(values: &[f64], start: f64, step: f64, points: usize) -> Vec<f64> {
    let mut counts = vec![0.0; points];
    for value in values {
        let position = (value - start) / step;
        if position >= 0.0 && position < (points - 1) as f64 {
            let below = position as usize;
            let share = position - below as f64;
            counts[below] += 1.0 - share;
            counts[below + 1] += share;
        }
    }
    counts
}

/// Density of a normal distribution on `range`.
pub fn normal(mean: f64, deviation: f64, range: &Range<f64>) -> Vec<(f64, f64)> {
    let step = (range.end - range.start) / (POINTS - 1) as f64;
    (0..POINTS)
        .map(|i| {
            let x = range.start + i as f64 * step;
            let z = (x - mean) / deviation;
            (x, (-0.5 * z * z).exp() / (deviation * TAU.sqrt()))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(curve: &[(f64, f64)]) -> f64 {
        let trapezoid = |p: &[(f64, f64)]| (p[1].0 - p[0].0) * (p[0].1 + p[1].1) / 2.0;
        curve.windows(2).map(trapezoid).sum()
    }

    #[test]
    fn two_values_make_two_bumps_of_half_the_area() {
        let curve = density(&[-1.0, -1.0, -1.0, 1.0, 1.0, 1.0], &(-6.0..6.0));
        assert!((area(&curve) - 1.0).abs() < 1e-4, "{}", area(&curve));
        let left: Vec<_> = curve.iter().copied().filter(|p| p.0 < 0.0).collect();
        assert!((area(&left) - 0.5).abs() < 0.01, "{}", area(&left));
        // Silverman: 0.9 times the deviation, 1, over the fifth root of 6.
        let width = 0.9 * 6f64.powf(-0.2);
        let kernel = |d: f64| (-0.5 * (d / width).powi(2)).exp() / (width * TAU.sqrt());
        for (x, found) in curve {
            let expected = (kernel(x - 1.0) + kernel(x + 1.0)) / 2.0;
            assert!((found - expected).abs() < 1e-3, "{x}: {found}, {expected}");
        }
    }

    #[test]
    fn one_value_is_the_kernel_itself() {
        // Without spread the bandwidth is the step of the grid.
        let curve = density(&[0.0], &(-1.0..1.0));
        assert!((area(&curve) - 1.0).abs() < 1e-3);
        assert!(curve.iter().all(|p| p.1.is_finite()));
    }

    #[test]
    fn values_beyond_the_range_take_their_share_away() {
        let mut values = vec![100.0; 10];
        values.extend((0..90).map(|i| f64::from(i) / 90.0 - 0.5));
        let curve = density(&values, &(-3.0..3.0));
        assert!((area(&curve) - 0.9).abs() < 1e-3, "{}", area(&curve));
    }

    #[test]
    fn nothing_gives_nothing() {
        assert!(density(&[], &(0.0..1.0)).is_empty());
        assert!(density(&[1.0], &(1.0..1.0)).is_empty());
        assert!((area(&normal(1.0, 2.0, &(-15.0..17.0))) - 1.0).abs() < 1e-6);
    }
}
