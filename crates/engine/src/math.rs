//! Elementary functions on vectors.

use crate::simd::Simd;

/// `2^x`, relative error below 1e-7, for `|x| <= 126`.
///
/// `2^n * p(x - n)` with `|x - n| <= 1/2` and the minimax polynomial of degree 6 for the
/// relative error.
///
/// # Safety
/// As for [`Simd`].
#[inline(always)]
pub(crate) unsafe fn exp2<S: Simd>(x: S::V) -> S::V {
    const POLYNOMIAL: [f32; 7] = [
        1.534_581_2e-4,
        1.339_993_1e-3,
        9.618_489e-3,
        5.550_328_6e-2,
        2.402_264_6e-1,
        6.931_472e-1,
        1.0,
    ];
    unsafe {
        let n = S::round(x);
        let r = S::sub(x, n);
        let [first, rest @ ..] = POLYNOMIAL;
        let mut p = S::splat(first);
        for c in rest {
            p = S::fma(p, r, S::splat(c));
        }
        S::scale(p, n)
    }
}

/// `1 / (1 + exp(-x))`, absolute error below 2e-7.
///
/// # Safety
/// As for [`Simd`].
#[inline(always)]
pub(crate) unsafe fn sigmoid<S: Simd>(x: S::V) -> S::V {
    unsafe {
        let exponent = S::mul(x, S::splat(-std::f32::consts::LOG2_E));
        let exponent = S::min(S::max(exponent, S::splat(-126.0)), S::splat(126.0));
        let one = S::splat(1.0);
        S::div(one, S::add(one, exp2::<S>(exponent)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Instructions, Isa, dispatch};

    dispatch! { fn exp2_all(x: &[f32], out: &mut [f32]) = exp2_body }
    dispatch! { fn sigmoid_all(x: &[f32], out: &mut [f32]) = sigmoid_body }

    #[inline(always)]
    unsafe fn exp2_body<S: Simd>(x: &[f32], out: &mut [f32]) {
        for (x, out) in x.chunks_exact(S::LANES).zip(out.chunks_exact_mut(S::LANES)) {
            // SAFETY: slices of one vector.
            unsafe { S::store(out.as_mut_ptr(), exp2::<S>(S::load(x.as_ptr()))) }
        }
    }

    #[inline(always)]
    unsafe fn sigmoid_body<S: Simd>(x: &[f32], out: &mut [f32]) {
        for (x, out) in x.chunks_exact(S::LANES).zip(out.chunks_exact_mut(S::LANES)) {
            // SAFETY: slices of one vector.
            unsafe { S::store(out.as_mut_ptr(), sigmoid::<S>(S::load(x.as_ptr()))) }
        }
    }

    #[test]
    fn exponential_and_sigmoid_are_accurate_on_every_instruction_set() {
        let x: Vec<f32> = (0..160_000)
            .map(|i| (i as f32 - 80_000.0) * 1.57e-3)
            .collect();
        let mut found = vec![0.0; x.len()];
        for set in Instructions::ALL {
            let Some(isa) = Isa::new(set) else { continue };
            exp2_all(isa, &x, &mut found);
            for (x, found) in x.iter().zip(&found) {
                let error = f64::from(*found) / f64::from(*x).exp2() - 1.0;
                assert!(error.abs() < 1e-7, "{set:?}: 2^{x}: {error:e}");
            }
            sigmoid_all(isa, &x, &mut found);
            for (x, found) in x.iter().zip(&found) {
                let error = f64::from(*found) - 1.0 / (1.0 + (-f64::from(*x)).exp());
                assert!(error.abs() < 2e-7, "{set:?}: sigmoid({x}): {error:e}");
            }
        }
    }
}
