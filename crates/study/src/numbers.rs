//! Numbers of several seeds.

/// Mean and standard deviation over seeds.
pub fn spread(values: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    (mean, variance.sqrt())
}

/// At most `limit` of `items`, evenly spread, first and last among them.
pub fn evenly<T: Copy>(items: &[T], limit: usize) -> Vec<T> {
    let count = items.len().min(limit);
    (0..count)
        .map(|i| items[i * (items.len() - 1) / (count - 1).max(1)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_by_hand() {
        assert_eq!(spread(&[1.0, 3.0]), (2.0, 2.0_f64.sqrt()));
        assert_eq!(spread(&[0.5]), (0.5, 0.0));
    }

    #[test]
    fn an_even_choice_keeps_both_ends() {
        let items: Vec<usize> = (0..10).collect();
        assert_eq!(evenly(&items, 4), [0, 3, 6, 9]);
        assert_eq!(evenly(&items, 20), items);
        assert_eq!(evenly(&items, 1), [0]);
        assert!(evenly::<usize>(&[], 3).is_empty());
    }
}
