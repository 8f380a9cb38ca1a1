//! Weight standardisation: `(w - mean) / sqrt(variance + 1e-5)` per output channel.

use crate::simd::{Simd, dispatch, load_up_to, store_up_to};

const EPSILON: f32 = 1e-5;

dispatch! {
    /// Mean and `1 / sqrt(variance + 1e-5)` of a row.
    pub(crate) fn row_moments(row: &[f32]) -> (f32, f32) = row_moments_body
}

dispatch! {
    /// `out = (row - mean) * inverse`.
    pub(crate) fn standardise(row: &[f32], mean: f32, inverse: f32, out: &mut [f32])
        = standardise_body
}

dispatch! {
    /// The gradient at a row from that at the standardised row.
    pub(crate) fn standardise_backward(
        row: &[f32], mean: f32, inverse: f32, gradient: &[f32], out: &mut [f32],
    ) = standardise_backward_body
}

/// Sums of vectors without one long chain of additions.
struct Sums<S: Simd>([S::V; 4]);

impl<S: Simd> Sums<S> {
    #[inline(always)]
    unsafe fn new() -> Self {
        Self([unsafe { S::splat(0.0) }; 4])
    }

    #[inline(always)]
    unsafe fn add(&mut self, x: S::V) {
        let [a, b, c, d] = self.0;
        self.0 = [b, c, d, unsafe { S::add(a, x) }];
    }

    #[inline(always)]
    unsafe fn total(self) -> f32 {
        let [a, b, c, d] = self.0;
        unsafe { S::sum(S::add(S::add(a, b), S::add(c, d))) }
    }
}

/// # Safety
/// The machine has `S` (as for all bodies here).
#[inline(always)]
unsafe fn row_moments_body<S: Simd>(row: &[f32]) -> (f32, f32) {
    let scale = 1.0 / row.len() as f32;
    // SAFETY: at most `n` numbers from `at` are read.
    unsafe {
        let mut sum = Sums::<S>::new();
        for at in (0..row.len()).step_by(S::LANES) {
            sum.add(load_up_to::<S>(row.as_ptr().add(at), row.len() - at));
        }
        let mean = sum.total() * scale;
        let mut square = Sums::<S>::new();
        let whole = row.len() / S::LANES * S::LANES;
        for at in (0..whole).step_by(S::LANES) {
            let d = S::sub(S::load(row.as_ptr().add(at)), S::splat(mean));
            square.add(S::mul(d, d));
        }
        let mut total = square.total();
        for w in &row[whole..] {
            total += (w - mean) * (w - mean);
        }
        (mean, 1.0 / (total * scale + EPSILON).sqrt())
    }
}

#[inline(always)]
unsafe fn standardise_body<S: Simd>(row: &[f32], mean: f32, inverse: f32, out: &mut [f32]) {
    assert!(row.len() <= out.len());
    for at in (0..row.len()).step_by(S::LANES) {
        let n = row.len() - at;
        // SAFETY: at most `n` numbers from `at` are touched.
        unsafe {
            let d = S::sub(load_up_to::<S>(row.as_ptr().add(at), n), S::splat(mean));
            store_up_to::<S>(out.as_mut_ptr().add(at), n, S::mul(d, S::splat(inverse)));
        }
    }
}

#[inline(always)]
unsafe fn standardise_backward_body<S: Simd>(
    row: &[f32],
    mean: f32,
    inverse: f32,
    gradient: &[f32],
    out: &mut [f32],
) {
    assert!(row.len() <= out.len() && row.len() <= gradient.len());
    let scale = 1.0 / row.len() as f32;
    // SAFETY: at most `n` numbers from `at` are touched; lanes past the end of `gradient` are
    // zero and add nothing.
    unsafe {
        let unit = |at: usize, n: usize| {
            let d = S::sub(load_up_to::<S>(row.as_ptr().add(at), n), S::splat(mean));
            S::mul(d, S::splat(inverse))
        };
        let (mut sum, mut product) = (Sums::<S>::new(), Sums::<S>::new());
        for at in (0..row.len()).step_by(S::LANES) {
            let n = row.len() - at;
            let g = load_up_to::<S>(gradient.as_ptr().add(at), n);
            sum.add(g);
            product.add(S::mul(g, unit(at, n)));
        }
        let level = S::splat(sum.total() * scale);
        let slope = S::splat(-product.total() * scale);
        for at in (0..row.len()).step_by(S::LANES) {
            let n = row.len() - at;
            let g = load_up_to::<S>(gradient.as_ptr().add(at), n);
            let d = S::fma(unit(at, n), slope, S::sub(g, level));
            store_up_to::<S>(out.as_mut_ptr().add(at), n, S::mul(d, S::splat(inverse)));
        }
    }
}
