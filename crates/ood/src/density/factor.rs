//! Cholesky factors of covariances, inverted.
//!
//! A fit factors a covariance for every component and iteration, so the loops run over whole rows, which
//! the compiler turns into vector instructions without changing the order of any sum.

use ndarray::Array2;

/// `L^-1` of `A = L L^T`, lower triangle, and `ln det L`; `lower` is the lower triangle of A, row by row.
/// `None` where A is not positive definite.
pub(super) fn inverse_factor(lower: &[f64], dimension: usize) -> Option<(Array2<f64>, f64)> {
    let transposed = cholesky(lower, dimension)?;
    let log_det = (0..dimension)
        .map(|i| transposed[i * dimension + i].ln())
        .sum();
    let inverse = invert(&transposed, dimension);
    let inverse = Array2::from_shape_vec((dimension, dimension), inverse).ok()?;
    Some((inverse, log_det))
}

/// `U = L^T` row by row, outer-product form: each pivot's row is taken off all rows below.
fn cholesky(lower: &[f64], d: usize) -> Option<Vec<f64>> {
    let mut upper = vec![0.0; d * d];
    for i in 0..d {
        for j in i..d {
            upper[i * d + j] = lower[j * (j + 1) / 2 + i];
        }
    }
    for k in 0..d {
        let (done, rest) = upper.split_at_mut((k + 1) * d);
        let pivot_row = &mut done[k * d..];
        let pivot = pivot_row[k];
        // Written so that NaN fails as well.
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        let root = pivot.sqrt();
        for value in &mut pivot_row[k..] {
            *value /= root;
        }
        for (below, row) in rest.chunks_exact_mut(d).enumerate() {
            let i = k + 1 + below;
            let factor = pivot_row[i];
            for (value, pivot) in row[i..].iter_mut().zip(&pivot_row[i..]) {
                *value -= factor * pivot;
            }
        }
    }
    Some(upper)
}

/// `L^-1` row by row, forward substitution on the rows of the identity.
fn invert(upper: &[f64], d: usize) -> Vec<f64> {
    let mut inverse = vec![0.0; d * d];
    for i in 0..d {
        let (done, rest) = inverse.split_at_mut(i * d);
        let row = &mut rest[..d];
        for k in 0..i {
            // L[i][k], the transposed entry.
            let factor = upper[k * d + i];
            for (value, above) in row[..=k].iter_mut().zip(&done[k * d..=k * d + k]) {
                *value -= factor * above;
            }
        }
        row[i] = 1.0;
        let pivot = upper[i * d + i];
        for value in &mut row[..=i] {
            *value /= pivot;
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::inverse_factor;
    use proptest::prelude::*;

    #[test]
    fn by_hand() {
        // [[4, 2], [2, 3]] = L L^T with L = [[2, 0], [1, sqrt 2]].
        let (inverse, log_det) = inverse_factor(&[4.0, 2.0, 3.0], 2).unwrap();
        assert!((log_det - 0.5 * 8.0_f64.ln()).abs() < 1e-15);
        assert_eq!(inverse[[0, 0]], 0.5);
        assert_eq!(inverse[[0, 1]], 0.0);
        assert!((inverse[[1, 0]] + 0.5 / 2.0_f64.sqrt()).abs() < 1e-15);
        assert!((inverse[[1, 1]] - 0.5_f64.sqrt()).abs() < 1e-15);
        assert!(inverse_factor(&[1.0, 2.0, 1.0], 2).is_none());
        assert!(inverse_factor(&[f64::NAN], 1).is_none());
        assert!(inverse_factor(&[f64::INFINITY], 1).is_none());
        assert!(inverse_factor(&[0.0], 1).is_none());
    }

    proptest! {
        #![proptest_config(crate::property_cases::cases(64))]

        #[test]
        fn it_whitens_its_covariance(
            d in 1_usize..9,
            entries in prop::collection::vec(-1.0_f64..1.0, 100),
        ) {
            let b = |i: usize, j: usize| entries[i * 10 + j] + if i == j { 2.0 } else { 0.0 };
            let a = |i: usize, j: usize| (0..d).map(|k| b(i, k) * b(j, k)).sum::<f64>();
            let lower: Vec<f64> = (0..d).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|(i, j)| a(i, j)).collect();
            prop_assume!(inverse_factor(&lower, d).is_some());
            let (inverse, _) = inverse_factor(&lower, d).unwrap();
            // L^-1 A L^-T is the identity.
            for i in 0..d {
                for j in 0..d {
                    let mut sum = 0.0;
                    for k in 0..d {
                        for l in 0..d {
                            sum += inverse[[i, k]] * a(k, l) * inverse[[j, l]];
                        }
                    }
                    let expected = f64::from(u8::from(i == j));
                    prop_assert!((sum - expected).abs() < 1e-6, "{} {} {}", i, j, sum);
                }
            }
        }
    }
}
