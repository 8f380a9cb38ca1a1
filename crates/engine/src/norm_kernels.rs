//! Passes over one sample's `[rows, channels]` activations with one coefficient per channel.
//!
//! Group normalisation with its affine part and the block's scale and shift is `x * a + b`
//! per sample and channel, so that normalisation, modulation and SiLU are one pass.

use crate::math::sigmoid;
use crate::simd::{Simd, dispatch, load_up_to, store_up_to};

/// What is added to the activations of a block.
#[derive(Clone, Copy)]
pub(crate) enum Residual<'a> {
    /// Nothing.
    Nothing,
    /// What the output holds already.
    Output,
    /// Other activations of the same shape.
    Other(&'a [f32]),
}

dispatch! {
    /// Mean and variance (biased) of every channel.
    pub(crate) fn moments(x: &[f32], channels: usize, mean: &mut [f32], variance: &mut [f32])
        = moments_body
}

dispatch! {
    /// `out = silu(x * a + b) + residual`.
    pub(crate) fn affine_silu(
        x: &[f32], channels: usize, a: &[f32], b: &[f32], residual: Residual<'_>, out: &mut [f32],
    ) = affine_silu_body
}

dispatch! {
    /// Gradient at `u = x * a + b` of `silu(u)`, from the gradient at its output; and the
    /// sums over rows of it and of its product with `x * xa + xb`.
    pub(crate) fn affine_silu_backward(
        upstream: &[f32], x: &[f32], channels: usize, a: &[f32], b: &[f32],
        xa: &[f32], xb: &[f32], out: &mut [f32], sum: &mut [f32], product: &mut [f32],
    ) = affine_silu_backward_body
}

dispatch! {
    /// `out = du * p + x * q + r`, and its sum over rows added to `sum`.
    pub(crate) fn combine(
        du: &[f32], x: &[f32], channels: usize, p: &[f32], q: &[f32], r: &[f32],
        out: &mut [f32], sum: &mut [f32],
    ) = combine_body
}

dispatch! {
    /// Adds the sum over rows to `sum`.
    pub(crate) fn add_column_sums(x: &[f32], channels: usize, sum: &mut [f32])
        = add_column_sums_body
}

dispatch! {
    /// `out += x`.
    pub(crate) fn add_assign(x: &[f32], out: &mut [f32]) = add_assign_body
}

/// # Safety
/// The machine has `S` (as for all bodies here).
#[inline(always)]
unsafe fn moments_body<S: Simd>(
    x: &[f32],
    channels: usize,
    mean: &mut [f32],
    variance: &mut [f32],
) {
    let rows = x.len() / channels;
    assert!(rows > 0 && channels <= mean.len() && channels <= variance.len());
    let scale = 1.0 / rows as f32;
    for c in (0..channels).step_by(S::LANES) {
        let n = channels - c;
        // SAFETY: rows of `channels` numbers, of which at most `n` from `c` are touched.
        unsafe {
            let x = x.as_ptr().add(c);
            // Sums around the first value: no cancellation when the mean is large.
            let origin = load_up_to::<S>(x, n);
            let (mut sum, mut square) = (S::splat(0.0), S::splat(0.0));
            for row in 0..rows {
                let d = S::sub(load_up_to::<S>(x.add(row * channels), n), origin);
                sum = S::add(sum, d);
                square = S::fma(d, d, square);
            }
            let scale = S::splat(scale);
            let shift = S::mul(sum, scale);
            let spread = S::sub(S::mul(square, scale), S::mul(shift, shift));
            store_up_to::<S>(mean.as_mut_ptr().add(c), n, S::add(origin, shift));
            let spread = S::max(spread, S::splat(0.0));
            store_up_to::<S>(variance.as_mut_ptr().add(c), n, spread);
        }
    }
}

#[inline(always)]
unsafe fn affine_silu_body<S: Simd>(
    x: &[f32],
    channels: usize,
    a: &[f32],
    b: &[f32],
    residual: Residual<'_>,
    out: &mut [f32],
) {
    let rows = x.len() / channels;
    assert!(x.len() <= out.len() && channels <= a.len() && channels <= b.len());
    let residual = match residual {
        Residual::Nothing => std::ptr::null(),
        Residual::Output => out.as_ptr(),
        Residual::Other(other) => {
            assert!(x.len() <= other.len());
            other.as_ptr()
        }
    };
    for c in (0..channels).step_by(S::LANES) {
        let n = channels - c;
        // SAFETY: rows of `channels` numbers, of which at most `n` from `c` are touched.
        unsafe {
            let (a, b) = (
                load_up_to::<S>(a.as_ptr().add(c), n),
                load_up_to::<S>(b.as_ptr().add(c), n),
            );
            for row in 0..rows {
                let at = row * channels + c;
                let u = S::fma(load_up_to::<S>(x.as_ptr().add(at), n), a, b);
                let mut h = S::mul(u, sigmoid::<S>(u));
                if !residual.is_null() {
                    h = S::add(h, load_up_to::<S>(residual.add(at), n));
                }
                store_up_to::<S>(out.as_mut_ptr().add(at), n, h);
            }
        }
    }
}

#[inline(always)]
unsafe fn affine_silu_backward_body<S: Simd>(
    upstream: &[f32],
    x: &[f32],
    channels: usize,
    a: &[f32],
    b: &[f32],
    xa: &[f32],
    xb: &[f32],
    out: &mut [f32],
    sum: &mut [f32],
    product: &mut [f32],
) {
    let rows = x.len() / channels;
    assert!(x.len() <= upstream.len() && x.len() <= out.len());
    for coefficients in [a, b, xa, xb, &*sum, &*product] {
        assert!(channels <= coefficients.len());
    }
    for c in (0..channels).step_by(S::LANES) {
        let n = channels - c;
        // SAFETY: rows of `channels` numbers, of which at most `n` from `c` are touched.
        unsafe {
            let [a, b, xa, xb] = [a, b, xa, xb].map(|v| load_up_to::<S>(v.as_ptr().add(c), n));
            let one = S::splat(1.0);
            let (mut total, mut weighted) = (S::splat(0.0), S::splat(0.0));
            for row in 0..rows {
                let at = row * channels + c;
                let x = load_up_to::<S>(x.as_ptr().add(at), n);
                let u = S::fma(x, a, b);
                let s = sigmoid::<S>(u);
                // d silu(u) / du = s (1 + u (1 - s))
                let slope = S::mul(s, S::fma(u, S::sub(one, s), one));
                let du = S::mul(load_up_to::<S>(upstream.as_ptr().add(at), n), slope);
                total = S::add(total, du);
                weighted = S::fma(du, S::fma(x, xa, xb), weighted);
                store_up_to::<S>(out.as_mut_ptr().add(at), n, du);
            }
            store_up_to::<S>(sum.as_mut_ptr().add(c), n, total);
            store_up_to::<S>(product.as_mut_ptr().add(c), n, weighted);
        }
    }
}

#[inline(always)]
unsafe fn combine_body<S: Simd>(
    du: &[f32],
    x: &[f32],
    channels: usize,
    p: &[f32],
    q: &[f32],
    r: &[f32],
    out: &mut [f32],
    sum: &mut [f32],
) {
    let rows = x.len() / channels;
    assert!(x.len() <= du.len() && x.len() <= out.len());
    for coefficients in [p, q, r, &*sum] {
        assert!(channels <= coefficients.len());
    }
    for c in (0..channels).step_by(S::LANES) {
        let n = channels - c;
        // SAFETY: rows of `channels` numbers, of which at most `n` from `c` are touched.
        unsafe {
            let [p, q, r] = [p, q, r].map(|v| load_up_to::<S>(v.as_ptr().add(c), n));
            let mut total = load_up_to::<S>(sum.as_ptr().add(c), n);
            for row in 0..rows {
                let at = row * channels + c;
                let d = S::fma(load_up_to::<S>(x.as_ptr().add(at), n), q, r);
                let d = S::fma(load_up_to::<S>(du.as_ptr().add(at), n), p, d);
                total = S::add(total, d);
                store_up_to::<S>(out.as_mut_ptr().add(at), n, d);
            }
            store_up_to::<S>(sum.as_mut_ptr().add(c), n, total);
        }
    }
}

#[inline(always)]
unsafe fn add_column_sums_body<S: Simd>(x: &[f32], channels: usize, sum: &mut [f32]) {
    let rows = x.len() / channels;
    assert!(channels <= sum.len());
    for c in (0..channels).step_by(S::LANES) {
        let n = channels - c;
        // SAFETY: rows of `channels` numbers, of which at most `n` from `c` are touched.
        unsafe {
            let mut total = load_up_to::<S>(sum.as_ptr().add(c), n);
            for row in 0..rows {
                total = S::add(
                    total,
                    load_up_to::<S>(x.as_ptr().add(row * channels + c), n),
                );
            }
            store_up_to::<S>(sum.as_mut_ptr().add(c), n, total);
        }
    }
}

#[inline(always)]
unsafe fn add_assign_body<S: Simd>(x: &[f32], out: &mut [f32]) {
    assert!(x.len() <= out.len());
    for at in (0..x.len()).step_by(S::LANES) {
        let n = x.len() - at;
        // SAFETY: both slices have `n` numbers from `at`.
        unsafe {
            let to = out.as_mut_ptr().add(at);
            let sum = S::add(
                load_up_to::<S>(to, n),
                load_up_to::<S>(x.as_ptr().add(at), n),
            );
            store_up_to::<S>(to, n, sum);
        }
    }
}
