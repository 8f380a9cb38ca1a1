//! Many logs in one call: how many of the rejected ones are false alarms.
//!
//! Of a hundred sound logs five are rejected at alpha 0.05. Benjamini and Hochberg (1995) bound the
//! expected share of false alarms *among the rejected* instead, for p-values that are independent or
//! positively dependent.

/// Which of the p-values are rejected at the false discovery rate `level`: those up to the largest
/// `p_(i) <= i level / n`.
#[must_use]
pub fn benjamini_hochberg(p_values: &[f64], level: f64) -> Vec<bool> {
    q_values(p_values).iter().map(|&q| q <= level).collect()
}

/// Adjusted p-values, in the order given: the smallest level at which each is rejected,
/// `min_{j >= i} n p_(j) / j`, at most 1. A p-value that is not a number counts as 1.
#[must_use]
pub fn q_values(p_values: &[f64]) -> Vec<f64> {
    let n = p_values.len();
    let known = |i: usize| {
        if p_values[i].is_nan() {
            1.0
        } else {
            p_values[i]
        }
    };
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| known(a).total_cmp(&known(b)));
    let mut adjusted = vec![1.0; n];
    let mut smallest = 1.0_f64;
    for (rank, &i) in order.iter().enumerate().rev() {
        smallest = smallest.min(known(i) * n as f64 / (rank + 1) as f64);
        adjusted[i] = smallest;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn q_values_by_hand() {
        // Sorted .01, .02, .03, .5: times 4/1, 4/2, 4/3, 1 gives .04, .04, .04, .5.
        let q = q_values(&[0.5, 0.01, 0.03, 0.02]);
        for (found, expected) in q.iter().zip([0.5, 0.04, 0.04, 0.04]) {
            assert!((found - expected).abs() < 1e-12, "{q:?}");
        }
        assert_eq!(
            benjamini_hochberg(&[0.5, 0.01, 0.03, 0.02], 0.05),
            [false, true, true, true]
        );
        assert_eq!(q_values(&[f64::NAN, 0.01]), [1.0, 0.02]);
        assert!(q_values(&[]).is_empty());
    }

    proptest! {
        #![proptest_config(crate::property_cases::cases(256))]

        #[test]
        fn between_bonferroni_and_no_correction(
            p in prop::collection::vec(0.0_f64..=1.0, 1..40),
            level in 0.001_f64..0.5,
        ) {
            let n = p.len() as f64;
            let q = q_values(&p);
            for (p, q) in p.iter().zip(&q) {
                prop_assert!(*q >= *p - 1e-15 && *q <= (n * p).min(1.0) + 1e-15);
            }
            let rejected = benjamini_hochberg(&p, level);
            for i in 0..p.len() {
                for j in 0..p.len() {
                    prop_assert!(p[i] > p[j] || q[i] <= q[j]);
                }
                // The step-up rule itself: the largest k with p_(k) <= k level / n.
                let mut sorted = p.clone();
                sorted.sort_by(f64::total_cmp);
                let step_up = |k: &usize| sorted[*k] * n / (*k + 1) as f64 <= level;
                let last = (0..p.len()).rev().find(step_up);
                prop_assert_eq!(rejected[i], last.is_some_and(|k| p[i] <= sorted[k]));
            }
        }
    }
}
