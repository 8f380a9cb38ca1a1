//! Passes of the attention over rows of one sample.

use crate::math::exp2;
use crate::matmul::{PANEL, panel_width};
use crate::simd::{Simd, dispatch, load_up_to, store_up_to};

/// Rows inside a buffer: row `r` is contiguous from `start + r * row`.
#[derive(Clone, Copy)]
pub(crate) struct RowsAt {
    pub(crate) start: usize,
    pub(crate) row: usize,
}

impl RowsAt {
    fn check(self, len: usize, rows: usize, columns: usize) {
        assert!(rows == 0 || self.start + (rows - 1) * self.row + columns <= len);
    }
}

dispatch! {
    /// `y = (x - mean) / sqrt(variance + 1e-5)` per row of `channels`; with the inverse
    /// deviation of every row.
    pub(crate) fn standardise_rows(x: &[f32], channels: usize, y: &mut [f32], inverse: &mut [f32])
        = standardise_rows_body
}

dispatch! {
    /// Adds to `dx` the gradient at the input of [`standardise_rows`], from that at `y`.
    pub(crate) fn standardise_rows_backward(
        dy: &[f32], y: &[f32], inverse: &[f32], channels: usize, dx: &mut [f32],
    ) = standardise_rows_backward_body
}

dispatch! {
    /// Scales rows to the Euclidean length `length`; keeps the factors.
    pub(crate) fn normalise_rows(
        data: &mut [f32], at: RowsAt, columns: usize, length: f32, factors: &mut [f32],
    ) = normalise_rows_body
}

dispatch! {
    /// `out = factor * (g - x (x . g) / length^2)` per row: the gradient before
    /// [`normalise_rows`] from the gradient `g` at its result `x`.
    pub(crate) fn normalise_rows_backward(
        g: &[f32], x: &[f32], at: RowsAt, columns: usize, length: f32, factors: &[f32],
        out: &mut [f32],
    ) = normalise_rows_backward_body
}

dispatch! {
    /// `2^score` of every score in place, and the inverse of each row's sum.
    pub(crate) fn exponentials(
        scores: &mut [f32], row: usize, columns: usize, inverse_sums: &mut [f32],
    ) = exponentials_body
}

dispatch! {
    /// Multiplies every row by its factor.
    pub(crate) fn scale_rows(data: &mut [f32], at: RowsAt, columns: usize, factors: &[f32])
        = scale_rows_body
}

dispatch! {
    /// `p = p * factor` (the probabilities), then `d = ln(2) p * (d - sum(p * d))` per row:
    /// the gradient at scores that are exponents of 2.
    pub(crate) fn softmax_backward(
        p: &mut [f32], d: &mut [f32], row: usize, columns: usize, factors: &[f32],
    ) = softmax_backward_body
}

dispatch! {
    /// Packs `count` rows of `columns` as a right side `[columns, count]`: transposed.
    pub(crate) fn pack_transposed(
        data: &[f32], at: RowsAt, count: usize, columns: usize, packed: &mut [f32],
    ) = pack_transposed_body
}

/// # Safety
/// The machine has `S` (as for all bodies here).
#[inline(always)]
unsafe fn pack_transposed_body<S: Simd>(
    data: &[f32],
    at: RowsAt,
    count: usize,
    columns: usize,
    packed: &mut [f32],
) {
    at.check(data.len(), count, columns);
    for first in (0..count).step_by(PANEL) {
        let width = panel_width(count, first);
        let panel = &mut packed[first * columns..][..width * columns];
        let rows = width.min(count - first);
        let whole = (rows / S::LANES * S::LANES, columns / S::LANES * S::LANES);
        for r in (0..whole.0).step_by(S::LANES) {
            for c in (0..whole.1).step_by(S::LANES) {
                // SAFETY: whole blocks within the rows and the panel checked above.
                unsafe {
                    let from = data.as_ptr().add(at.start + (first + r) * at.row + c);
                    S::transpose(from, at.row, panel.as_mut_ptr().add(c * width + r), width);
                }
            }
        }
        for r in 0..rows {
            let row = &data[at.start + (first + r) * at.row..][..columns];
            let from = if r < whole.0 { whole.1 } else { 0 };
            for (column, &value) in row.iter().enumerate().skip(from) {
                panel[column * width + r] = value;
            }
        }
    }
}

/// Packs `count` rows of `columns` as a right side `[count, columns]`.
pub(crate) fn pack_rows(
    data: &[f32],
    at: RowsAt,
    count: usize,
    columns: usize,
    packed: &mut [f32],
) {
    at.check(data.len(), count, columns);
    for first in (0..columns).step_by(PANEL) {
        let width = panel_width(columns, first);
        let used = width.min(columns - first);
        let panel = &mut packed[first * count..][..width * count];
        for (r, to) in panel.chunks_exact_mut(width).enumerate() {
            to[..used].copy_from_slice(&data[at.start + r * at.row + first..][..used]);
        }
    }
}

/// The sum over a row of `f(vector at column)`.
#[inline(always)]
unsafe fn row_sum<S: Simd>(columns: usize, f: impl Fn(usize, usize) -> S::V) -> f32 {
    unsafe {
        let mut sum = S::splat(0.0);
        for c in (0..columns).step_by(S::LANES) {
            sum = S::add(sum, f(c, columns - c));
        }
        S::sum(sum)
    }
}

/// # Safety
/// The machine has `S` (as for all bodies here).
#[inline(always)]
unsafe fn standardise_rows_body<S: Simd>(
    x: &[f32],
    channels: usize,
    y: &mut [f32],
    inverse: &mut [f32],
) {
    let rows = x.len() / channels;
    assert!(x.len() <= y.len() && rows <= inverse.len());
    let scale = 1.0 / channels as f32;
    for (row, inverse) in inverse.iter_mut().enumerate().take(rows) {
        // SAFETY: row `row` of `x` and `y`, at most `channels` numbers.
        unsafe {
            let x = x.as_ptr().add(row * channels);
            let y = y.as_mut_ptr().add(row * channels);
            let mean = row_sum::<S>(channels, |c, n| load_up_to::<S>(x.add(c), n)) * scale;
            let mut square = S::splat(0.0);
            for c in (0..channels).step_by(S::LANES) {
                let n = channels - c;
                let d = S::sub(load_up_to::<S>(x.add(c), n), S::splat(mean));
                store_up_to::<S>(y.add(c), n, d);
                // Read back: lanes past the end must not count.
                let d = load_up_to::<S>(y.add(c), n);
                square = S::fma(d, d, square);
            }
            *inverse = 1.0 / (S::sum(square) * scale + 1e-5).sqrt();
            for c in (0..channels).step_by(S::LANES) {
                let n = channels - c;
                let d = S::mul(load_up_to::<S>(y.add(c), n), S::splat(*inverse));
                store_up_to::<S>(y.add(c), n, d);
            }
        }
    }
}

#[inline(always)]
unsafe fn standardise_rows_backward_body<S: Simd>(
    dy: &[f32],
    y: &[f32],
    inverse: &[f32],
    channels: usize,
    dx: &mut [f32],
) {
    let rows = y.len() / channels;
    assert!(y.len() <= dy.len() && y.len() <= dx.len() && rows <= inverse.len());
    let scale = 1.0 / channels as f32;
    for (row, &inverse) in inverse.iter().enumerate().take(rows) {
        // SAFETY: row `row` of all three, at most `channels` numbers.
        unsafe {
            let dy = dy.as_ptr().add(row * channels);
            let y = y.as_ptr().add(row * channels);
            let dx = dx.as_mut_ptr().add(row * channels);
            let mean = row_sum::<S>(channels, |c, n| load_up_to::<S>(dy.add(c), n)) * scale;
            let along = row_sum::<S>(channels, |c, n| {
                S::mul(load_up_to::<S>(dy.add(c), n), load_up_to::<S>(y.add(c), n))
            }) * scale;
            for c in (0..channels).step_by(S::LANES) {
                let n = channels - c;
                let d = S::sub(load_up_to::<S>(dy.add(c), n), S::splat(mean));
                let d = S::fma(S::splat(-along), load_up_to::<S>(y.add(c), n), d);
                let sum = S::fma(d, S::splat(inverse), load_up_to::<S>(dx.add(c), n));
                store_up_to::<S>(dx.add(c), n, sum);
            }
        }
    }
}

#[inline(always)]
unsafe fn normalise_rows_body<S: Simd>(
    data: &mut [f32],
    at: RowsAt,
    columns: usize,
    length: f32,
    factors: &mut [f32],
) {
    at.check(data.len(), factors.len(), columns);
    for (row, factor) in factors.iter_mut().enumerate() {
        // SAFETY: checked above.
        unsafe {
            let x = data.as_mut_ptr().add(at.start + row * at.row);
            let square = row_sum::<S>(columns, |c, n| {
                let x = load_up_to::<S>(x.add(c), n);
                S::mul(x, x)
            });
            *factor = length / square.sqrt().max(1e-12);
            for c in (0..columns).step_by(S::LANES) {
                let n = columns - c;
                let scaled = S::mul(load_up_to::<S>(x.add(c), n), S::splat(*factor));
                store_up_to::<S>(x.add(c), n, scaled);
            }
        }
    }
}

#[inline(always)]
unsafe fn normalise_rows_backward_body<S: Simd>(
    g: &[f32],
    x: &[f32],
    at: RowsAt,
    columns: usize,
    length: f32,
    factors: &[f32],
    out: &mut [f32],
) {
    let rows = factors.len();
    assert!(rows * columns <= g.len());
    at.check(x.len(), rows, columns);
    at.check(out.len(), rows, columns);
    for (row, &factor) in factors.iter().enumerate() {
        // SAFETY: checked above.
        unsafe {
            let g = g.as_ptr().add(row * columns);
            let x = x.as_ptr().add(at.start + row * at.row);
            let out = out.as_mut_ptr().add(at.start + row * at.row);
            let along = row_sum::<S>(columns, |c, n| {
                S::mul(load_up_to::<S>(g.add(c), n), load_up_to::<S>(x.add(c), n))
            });
            // A row shorter than 1e-12 was divided by that constant, not by its length.
            let clamped = factor >= length * 1e12;
            let along = if clamped {
                0.0
            } else {
                -along / (length * length)
            };
            for c in (0..columns).step_by(S::LANES) {
                let n = columns - c;
                let d = load_up_to::<S>(g.add(c), n);
                let d = S::fma(S::splat(along), load_up_to::<S>(x.add(c), n), d);
                store_up_to::<S>(out.add(c), n, S::mul(d, S::splat(factor)));
            }
        }
    }
}

#[inline(always)]
unsafe fn exponentials_body<S: Simd>(
    scores: &mut [f32],
    row: usize,
    columns: usize,
    inverse_sums: &mut [f32],
) {
    let at = RowsAt { start: 0, row };
    at.check(scores.len(), inverse_sums.len(), columns);
    for (r, inverse) in inverse_sums.iter_mut().enumerate() {
        // SAFETY: checked above.
        unsafe {
            let x = scores.as_mut_ptr().add(r * row);
            let mut sum = S::splat(0.0);
            for c in (0..columns).step_by(S::LANES) {
                let n = columns - c;
                let e = exp2::<S>(load_up_to::<S>(x.add(c), n));
                store_up_to::<S>(x.add(c), n, e);
                // Lanes past the end are 2^0.
                let e = if n < S::LANES {
                    S::load_part(x.add(c), n)
                } else {
                    e
                };
                sum = S::add(sum, e);
            }
            *inverse = 1.0 / S::sum(sum);
        }
    }
}

#[inline(always)]
unsafe fn scale_rows_body<S: Simd>(data: &mut [f32], at: RowsAt, columns: usize, factors: &[f32]) {
    at.check(data.len(), factors.len(), columns);
    for (r, &factor) in factors.iter().enumerate() {
        // SAFETY: checked above.
        unsafe {
            let x = data.as_mut_ptr().add(at.start + r * at.row);
            for c in (0..columns).step_by(S::LANES) {
                let n = columns - c;
                let scaled = S::mul(load_up_to::<S>(x.add(c), n), S::splat(factor));
                store_up_to::<S>(x.add(c), n, scaled);
            }
        }
    }
}

#[inline(always)]
unsafe fn softmax_backward_body<S: Simd>(
    p: &mut [f32],
    d: &mut [f32],
    row: usize,
    columns: usize,
    factors: &[f32],
) {
    let at = RowsAt { start: 0, row };
    at.check(p.len(), factors.len(), columns);
    at.check(d.len(), factors.len(), columns);
    for (r, &factor) in factors.iter().enumerate() {
        // SAFETY: checked above.
        unsafe {
            let (p, d) = (p.as_mut_ptr().add(r * row), d.as_mut_ptr().add(r * row));
            let mut sum = S::splat(0.0);
            for c in (0..columns).step_by(S::LANES) {
                let n = columns - c;
                let probability = S::mul(load_up_to::<S>(p.add(c), n), S::splat(factor));
                store_up_to::<S>(p.add(c), n, probability);
                sum = S::fma(probability, load_up_to::<S>(d.add(c), n), sum);
            }
            let mean = S::splat(S::sum(sum));
            for c in (0..columns).step_by(S::LANES) {
                let n = columns - c;
                let centred = S::sub(load_up_to::<S>(d.add(c), n), mean);
                let s = S::mul(load_up_to::<S>(p.add(c), n), centred);
                let s = S::mul(s, S::splat(std::f32::consts::LN_2));
                store_up_to::<S>(d.add(c), n, s);
            }
        }
    }
}
