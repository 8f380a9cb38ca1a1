//! Elementary functions on vectors.

use crate::simd::Simd;

/// Past these, `exp` would leave the normal numbers.
const EXP_MIN: f32 = -87.0;
const EXP_MAX: f32 = 88.0;
/// `ln 2` in two parts, so that the reduction is exact enough (Cody and Waite).
const LN2_HIGH: f32 = 0.693_359_4;
const LN2_LOW: f32 = -2.121_944_4e-4;

/// `exp(x)`, relative error below 2e-7; `x` is clamped to `[-87, 88]`.
///
/// `2^n * p(r)` with `|r| <= ln(2) / 2` and the polynomial of Cephes `expf`.
///
/// # Safety
/// As for [`Simd`].
#[inline(always)]
pub(crate) unsafe fn exp<S: Simd>(x: S::V) -> S::V {
    unsafe {
        let x = S::min(S::max(x, S::splat(EXP_MIN)), S::splat(EXP_MAX));
        let n = S::round(S::mul(x, S::splat(std::f32::consts::LOG2_E)));
        let r = S::fma(n, S::splat(-LN2_HIGH), x);
        let r = S::fma(n, S::splat(-LN2_LOW), r);
        let mut p = S::splat(1.987_569_1e-4);
        for c in [
            1.398_2e-3,
            8.333_452e-3,
            4.166_579_6e-2,
            1.666_666_5e-1,
            0.5,
        ] {
            p = S::fma(p, r, S::splat(c));
        }
        let p = S::fma(p, S::mul(r, r), S::add(r, S::splat(1.0)));
        S::scale(p, n)
    }
}

/// `1 / (1 + exp(-x))`.
///
/// # Safety
/// As for [`Simd`].
#[inline(always)]
pub(crate) unsafe fn sigmoid<S: Simd>(x: S::V) -> S::V {
    unsafe {
        let one = S::splat(1.0);
        S::div(one, S::add(one, exp::<S>(S::sub(S::splat(0.0), x))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Instructions, Isa, dispatch};

    dispatch! { fn exp_all(x: &[f32], out: &mut [f32]) = exp_body }
    dispatch! { fn sigmoid_all(x: &[f32], out: &mut [f32]) = sigmoid_body }

    #[inline(always)]
    unsafe fn exp_body<S: Simd>(x: &[f32], out: &mut [f32]) {
        for (x, out) in x.chunks_exact(16).zip(out.chunks_exact_mut(16)) {
            for i in (0..16).step_by(S::LANES) {
                unsafe { S::store(out[i..].as_mut_ptr(), exp::<S>(S::load(x[i..].as_ptr()))) }
            }
        }
    }

    #[inline(always)]
    unsafe fn sigmoid_body<S: Simd>(x: &[f32], out: &mut [f32]) {
        for (x, out) in x.chunks_exact(16).zip(out.chunks_exact_mut(16)) {
            for i in (0..16).step_by(S::LANES) {
                unsafe {
                    S::store(
                        out[i..].as_mut_ptr(),
                        sigmoid::<S>(S::load(x[i..].as_ptr())),
                    )
                }
            }
        }
    }

    #[test]
    fn exp_and_sigmoid_are_accurate_on_every_instruction_set() {
        let x: Vec<f32> = (0..160_000).map(|i| (i as f32 - 80_000.0) * 1e-3).collect();
        let mut found = vec![0.0; x.len()];
        for set in [
            Instructions::Portable,
            Instructions::Avx2,
            Instructions::Avx512,
            Instructions::Neon,
        ] {
            let Some(isa) = Isa::new(set) else { continue };
            exp_all(isa, &x, &mut found);
            for (x, found) in x.iter().zip(&found) {
                let truth = f64::from(*x).exp();
                assert!(
                    (f64::from(*found) / truth - 1.0).abs() < 2e-7,
                    "{set:?}: exp({x}) = {found}"
                );
            }
            sigmoid_all(isa, &x, &mut found);
            for (x, found) in x.iter().zip(&found) {
                let truth = 1.0 / (1.0 + (-f64::from(*x)).exp());
                assert!(
                    (f64::from(*found) / truth - 1.0).abs() < 4e-7,
                    "{set:?}: sigmoid({x}) = {found}"
                );
            }
        }
    }
}
