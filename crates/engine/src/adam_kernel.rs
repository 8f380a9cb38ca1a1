//! The passes of [`Adam`](crate::Adam) over a block of parameters.

use crate::simd::{Simd, dispatch, load_up_to, store_up_to};

/// One step's numbers that are the same for all parameters.
#[derive(Clone, Copy)]
pub(crate) struct Coefficients {
    /// Factor of the gradient.
    pub(crate) clip: f32,
    pub(crate) beta1: f32,
    pub(crate) beta2: f32,
    /// Learning rate over the first moment's bias correction.
    pub(crate) rate: f32,
    /// Inverse root of the second moment's bias correction.
    pub(crate) scale: f32,
    pub(crate) epsilon: f32,
    /// One minus the decay of the averaged weights.
    pub(crate) ema: f32,
}

/// The same range of all vectors.
pub(crate) struct Slices<'a> {
    pub(crate) values: &'a mut [f32],
    pub(crate) gradient: &'a [f32],
    pub(crate) m: &'a mut [f32],
    pub(crate) v: &'a mut [f32],
    pub(crate) ema: &'a mut [f32],
}

dispatch! {
    /// Sum of squares. Short sums in f32, these in f64: the rounding of a whole gradient stays
    /// at that of a few numbers.
    pub(crate) fn square_sum(x: &[f32]) -> f64 = square_sum_body
}

dispatch! {
    /// One step of Adam and of the averaged weights.
    pub(crate) fn update(coefficients: Coefficients, slices: Slices<'_>) = update_body
}

/// # Safety
/// The machine has `S` (as for all bodies here).
#[inline(always)]
unsafe fn square_sum_body<S: Simd>(x: &[f32]) -> f64 {
    let mut total = 0.0;
    for part in x.chunks(256) {
        // SAFETY: at most `n` numbers from `at` are read; missing lanes are zero.
        unsafe {
            let mut sum = S::splat(0.0);
            for at in (0..part.len()).step_by(S::LANES) {
                let x = load_up_to::<S>(part.as_ptr().add(at), part.len() - at);
                sum = S::fma(x, x, sum);
            }
            total += f64::from(S::sum(sum));
        }
    }
    total
}

#[inline(always)]
unsafe fn update_body<S: Simd>(c: Coefficients, slices: Slices<'_>) {
    let Slices {
        values,
        gradient,
        m,
        v,
        ema,
    } = slices;
    let count = values.len();
    for other in [gradient, m, v, ema] {
        assert_eq!(other.len(), count, "slices of one range");
    }
    let (values, gradient) = (values.as_mut_ptr(), gradient.as_ptr());
    let (m, v, ema) = (m.as_mut_ptr(), v.as_mut_ptr(), ema.as_mut_ptr());
    for at in (0..count).step_by(S::LANES) {
        let n = count - at;
        // SAFETY: all slices have `n` numbers from `at`.
        unsafe {
            let g = S::mul(load_up_to::<S>(gradient.add(at), n), S::splat(c.clip));
            let first = S::mul(load_up_to::<S>(m.add(at), n), S::splat(c.beta1));
            let first = S::fma(S::splat(1.0 - c.beta1), g, first);
            store_up_to::<S>(m.add(at), n, first);
            let second = S::mul(load_up_to::<S>(v.add(at), n), S::splat(c.beta2));
            let second = S::fma(S::mul(S::splat(1.0 - c.beta2), g), g, second);
            store_up_to::<S>(v.add(at), n, second);
            let root = S::fma(S::sqrt(second), S::splat(c.scale), S::splat(c.epsilon));
            let step = S::div(S::mul(S::splat(c.rate), first), root);
            let value = S::sub(load_up_to::<S>(values.add(at), n), step);
            store_up_to::<S>(values.add(at), n, value);
            let mean = load_up_to::<S>(ema.add(at), n);
            let mean = S::fma(S::splat(c.ema), S::sub(value, mean), mean);
            store_up_to::<S>(ema.add(at), n, mean);
        }
    }
}
