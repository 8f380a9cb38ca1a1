//! Empirical quantiles.

/// The `q` quantile, `q` in [0, 1], of values in ascending order, by linear interpolation between
/// order statistics (Hyndman and Fan 1996, type 7). NaN for no values.
#[must_use]
pub fn quantile_sorted(sorted: &[f64], q: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let position = q.clamp(0.0, 1.0) * last as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(last);
    let weight = position - below as f64;
    sorted[below] + weight * (sorted[above] - sorted[below])
}

#[cfg(test)]
mod tests {
    use super::quantile_sorted;

    #[test]
    fn interpolates_between_order_statistics() {
        let values = [1.0, 2.0, 4.0, 8.0];
        assert_eq!(quantile_sorted(&values, 0.0), 1.0);
        assert_eq!(quantile_sorted(&values, 0.5), 3.0);
        assert_eq!(quantile_sorted(&values, 1.0), 8.0);
        assert!((quantile_sorted(&values, 0.9) - 6.8).abs() < 1e-12);
        assert_eq!(quantile_sorted(&[5.0], 0.3), 5.0);
        assert!(quantile_sorted(&[], 0.5).is_nan());
    }
}
