//! Matrix products on strided activations.
//!
//! Activations are channels-last with zero rows between the samples, so a convolution is a
//! product whose left rows overlap: rows of `taps * channels` contiguous numbers, one row
//! stride apart. The left side is read where it lies, broadcasting one number at a time; the
//! right side (weights) is packed once per parameter set into panels of columns. What remains
//! is one register tile over the whole depth, with bias and addend in its epilogue. Nothing
//! is allocated.

use crate::simd::{Simd, dispatch, load_up_to, store_up_to};

/// Columns of a packed panel; the last one may have half as many.
pub(crate) const PANEL: usize = 32;
const HALF: usize = PANEL / 2;

/// Width of the panel that begins at `column` of `n`.
pub(crate) fn panel_width(n: usize, column: usize) -> usize {
    if n - column > HALF { PANEL } else { HALF }
}

/// Size of a packed `[k, n]` matrix.
pub(crate) fn packed_len(k: usize, n: usize) -> usize {
    k * n.next_multiple_of(HALF)
}

/// A matrix per sample inside a buffer: row `r` of sample `s` is contiguous from
/// `start + s * sample + r * row`.
#[derive(Clone, Copy)]
pub(crate) struct Operand<'a> {
    pub(crate) data: &'a [f32],
    pub(crate) start: usize,
    pub(crate) sample: usize,
    pub(crate) row: usize,
}

/// As [`Operand`], to be written.
pub(crate) struct Target<'a> {
    pub(crate) data: &'a mut [f32],
    pub(crate) start: usize,
    pub(crate) sample: usize,
    pub(crate) row: usize,
}

/// What is added to a product.
#[derive(Clone, Copy)]
pub(crate) enum Add<'a> {
    /// Nothing: the target is overwritten.
    Nothing,
    /// The target's present values.
    Target,
    /// Another matrix of the target's shape.
    Other(Operand<'a>),
}

/// One past the last number that `samples` matrices of `[rows, columns]` reach.
fn reach(start: usize, sample: usize, row: usize, shape: [usize; 3]) -> usize {
    let [samples, rows, columns] = shape;
    if samples == 0 || rows == 0 {
        return 0;
    }
    start + (samples - 1) * sample + (rows - 1) * row + columns
}

impl Operand<'_> {
    fn check(&self, shape: [usize; 3]) {
        assert!(reach(self.start, self.sample, self.row, shape) <= self.data.len());
    }
}

impl Target<'_> {
    fn check(&self, shape: [usize; 3]) {
        assert!(reach(self.start, self.sample, self.row, shape) <= self.data.len());
    }
}

dispatch! {
    /// `out = lhs * packed + bias + add` for every sample: `[rows, k] * [k, n]`.
    pub(crate) fn multiply(
        samples: usize, rows: usize, k: usize, n: usize,
        lhs: Operand<'_>, packed: &[f32], bias: Option<&[f32]>, add: Add<'_>, out: Target<'_>,
    ) = multiply_body
}

dispatch! {
    /// `out (+)= sum over samples and rows of lhs^T * rhs`: `[k, n]` row-major from
    /// `[rows, k]` and `[rows, n]`. `scratch` holds `samples * rows * 32` numbers.
    pub(crate) fn outer(
        samples: usize, rows: usize, k: usize, n: usize,
        lhs: Operand<'_>, rhs: Operand<'_>, scratch: &mut [f32], accumulate: bool, out: &mut [f32],
    ) = outer_body
}

/// Register tile: adds the products over `k` to `R x (V * LANES)` sums, for lhs element `(row, depth)` at
/// `row * row_stride + depth * depth_stride`.
#[inline(always)]
unsafe fn tile<S: Simd, const R: usize, const V: usize>(
    mut sums: [[S::V; V]; R],
    k: usize,
    lhs: *const f32,
    row_stride: usize,
    depth_stride: usize,
    rhs: *const f32,
    rhs_stride: usize,
    ahead: *const f32,
) -> [[S::V; V]; R] {
    unsafe {
        for depth in 0..k {
            if depth % 4 == 0 {
                S::prefetch(ahead.wrapping_add(depth * 4));
            }
            let mut right = [S::splat(0.0); V];
            for (v, right) in right.iter_mut().enumerate() {
                *right = S::load(rhs.add(depth * rhs_stride + v * S::LANES));
            }
            let left = lhs.add(depth * depth_stride);
            for (r, sums) in sums.iter_mut().enumerate() {
                let left = S::splat(*left.add(r * row_stride));
                for (sum, right) in sums.iter_mut().zip(right) {
                    *sum = S::fma(left, right, *sum);
                }
            }
        }
        sums
    }
}

/// Where a strip of columns of one product lies.
#[derive(Clone, Copy)]
struct Strip {
    k: usize,
    /// Columns that exist; the tile may be wider.
    columns: usize,
    lhs: *const f32,
    lhs_row: usize,
    rhs: *const f32,
    rhs_row: usize,
    bias: *const f32,
    add: *const f32,
    add_row: usize,
    out: *mut f32,
    out_row: usize,
    /// Weights that are needed next; every tile asks for its share of them.
    ahead: *const f32,
    ahead_step: usize,
}

/// `R` rows from `row` of a strip.
#[inline(always)]
unsafe fn rows<S: Simd, const R: usize, const V: usize>(strip: &Strip, row: usize) {
    unsafe {
        let number = row / R;
        let lhs = strip.lhs.add(row * strip.lhs_row);
        let zeros = [[S::splat(0.0); V]; R];
        let sums = tile::<S, R, V>(
            zeros,
            strip.k,
            lhs,
            strip.lhs_row,
            1,
            strip.rhs,
            strip.rhs_row,
            strip.ahead.wrapping_add(number * strip.ahead_step),
        );
        for v in 0..V {
            let column = v * S::LANES;
            if column >= strip.columns {
                break;
            }
            let left = strip.columns - column;
            let mut bias = S::splat(0.0);
            if !strip.bias.is_null() {
                bias = load_up_to::<S>(strip.bias.add(column), left);
            }
            for (r, sums) in sums.iter().enumerate() {
                let mut sum = S::add(sums[v], bias);
                if !strip.add.is_null() {
                    let add = strip.add.add((row + r) * strip.add_row + column);
                    sum = S::add(sum, load_up_to::<S>(add, left));
                }
                store_up_to::<S>(strip.out.add((row + r) * strip.out_row + column), left, sum);
            }
        }
    }
}

/// All rows of a strip, in tiles of `R` and then smaller ones.
#[inline(always)]
unsafe fn strip<S: Simd, const R: usize, const V: usize>(count: usize, strip: &Strip) {
    unsafe {
        let mut row = 0;
        while row + R <= count {
            rows::<S, R, V>(strip, row);
            row += R;
        }
        if R > 8 && row + 8 <= count {
            rows::<S, 8, V>(strip, row);
            row += 8;
        }
        if R > 4 && row + 4 <= count {
            rows::<S, 4, V>(strip, row);
            row += 4;
        }
        while row + 2 <= count {
            rows::<S, 2, V>(strip, row);
            row += 2;
        }
        if row < count {
            rows::<S, 1, V>(strip, row);
        }
    }
}

/// # Safety
/// The machine has `S`.
#[inline(always)]
unsafe fn multiply_body<S: Simd>(
    samples: usize,
    rows: usize,
    k: usize,
    n: usize,
    lhs: Operand<'_>,
    packed: &[f32],
    bias: Option<&[f32]>,
    add: Add<'_>,
    out: Target<'_>,
) {
    lhs.check([samples, rows, k]);
    out.check([samples, rows, n]);
    assert!(packed_len(k, n) <= packed.len());
    let bias = bias.map_or(std::ptr::null(), |bias| {
        assert!(n <= bias.len());
        bias.as_ptr()
    });
    let base = out.data.as_mut_ptr();
    let (add, add_start, add_sample, add_row) = match add {
        Add::Nothing => (std::ptr::null(), 0, 0, 0),
        Add::Target => (base.cast_const(), out.start, out.sample, out.row),
        Add::Other(add) => {
            add.check([samples, rows, n]);
            (add.data.as_ptr(), add.start, add.sample, add.row)
        }
    };
    let step = if S::LANES == 16 { PANEL } else { HALF };
    let mut column = 0;
    while column < n {
        let first = column / PANEL * PANEL;
        let width = panel_width(n, first);
        // Not past the panel, whose width may be half a step.
        let columns = (n - column).min(step).min(first + width - column);
        // The next panel follows this one, and the next matrix the last panel.
        let ahead = packed.as_ptr().wrapping_add((first + width) * k);
        let (share, tiles) = (width * k / samples, (rows / 8).max(1));
        for sample in 0..samples {
            // SAFETY: the checks above bound every row of `k` and `n` numbers; a panel is
            // padded to its width, which is a multiple of the tile's.
            unsafe {
                let piece = Strip {
                    k,
                    columns,
                    lhs: lhs.data.as_ptr().add(lhs.start + sample * lhs.sample),
                    lhs_row: lhs.row,
                    rhs: packed.as_ptr().add(first * k + (column - first)),
                    rhs_row: width,
                    bias: if bias.is_null() {
                        bias
                    } else {
                        bias.add(column)
                    },
                    add: match add.is_null() {
                        true => add,
                        false => add.add(add_start + sample * add_sample + column),
                    },
                    add_row,
                    out: base.add(out.start + sample * out.sample + column),
                    out_row: out.row,
                    ahead: ahead.wrapping_add(sample * share),
                    ahead_step: share / tiles,
                };
                match S::LANES {
                    16 if width == PANEL => strip::<S, 8, 2>(rows, &piece),
                    16 => strip::<S, 16, 1>(rows, &piece),
                    8 => strip::<S, 6, 2>(rows, &piece),
                    _ => strip::<S, 4, 4>(rows, &piece),
                }
            }
        }
        column += step;
    }
}

/// # Safety
/// The machine has `S`.
#[inline(always)]
unsafe fn outer_body<S: Simd>(
    samples: usize,
    rows: usize,
    k: usize,
    n: usize,
    lhs: Operand<'_>,
    rhs: Operand<'_>,
    scratch: &mut [f32],
    accumulate: bool,
    out: &mut [f32],
) {
    lhs.check([samples, rows, k]);
    rhs.check([samples, rows, n]);
    assert!(k * n <= out.len());
    assert!(samples * rows * PANEL <= scratch.len());
    let mut column = 0;
    while column < n {
        let width = panel_width(n, column);
        let columns = width.min(n - column);
        // Contiguous columns: rows a power of two apart would fight for the same cache lines.
        for sample in 0..samples {
            for row in 0..rows {
                let from = rhs.start + sample * rhs.sample + row * rhs.row + column;
                let to = (sample * rows + row) * width;
                // SAFETY: a row of `rhs` and of the scratch panel, both checked above.
                unsafe {
                    let from = rhs.data.as_ptr().add(from);
                    let to = scratch.as_mut_ptr().add(to);
                    for at in (0..width).step_by(S::LANES) {
                        let value = match columns.saturating_sub(at) {
                            0 => S::splat(0.0),
                            left => load_up_to::<S>(from.add(at), left),
                        };
                        S::store(to.add(at), value);
                    }
                }
            }
        }
        let piece = Product {
            samples,
            rows,
            k,
            n,
            columns,
            width,
            lhs,
            accumulate,
        };
        // SAFETY: the checks above bound the left rows and the output; the scratch panel has
        // `samples * rows` rows of `width`, a multiple of the tile's.
        unsafe {
            let out = out.as_mut_ptr().add(column);
            let rhs = scratch.as_ptr();
            match S::LANES {
                16 if width == PANEL => piece.run::<S, 8, 2>(rhs, out, columns),
                16 => piece.run::<S, 16, 1>(rhs, out, columns),
                _ => {
                    for half in (0..columns).step_by(HALF) {
                        let left = (columns - half).min(HALF);
                        let (rhs, out) = (rhs.add(half), out.add(half));
                        match S::LANES {
                            8 => piece.run::<S, 6, 2>(rhs, out, left),
                            _ => piece.run::<S, 4, 4>(rhs, out, left),
                        }
                    }
                }
            }
        }
        column += width;
    }
}

/// One panel of columns of an outer product.
struct Product<'a> {
    samples: usize,
    rows: usize,
    k: usize,
    n: usize,
    columns: usize,
    width: usize,
    lhs: Operand<'a>,
    accumulate: bool,
}

impl Product<'_> {
    #[inline(always)]
    unsafe fn run<S: Simd, const R: usize, const V: usize>(
        &self,
        rhs: *const f32,
        out: *mut f32,
        columns: usize,
    ) {
        debug_assert!(columns <= self.columns);
        unsafe {
            let mut row = 0;
            while row + R <= self.k {
                self.tile::<S, R, V>(row, rhs, out, columns);
                row += R;
            }
            while row + 4 <= self.k {
                self.tile::<S, 4, V>(row, rhs, out, columns);
                row += 4;
            }
            while row < self.k {
                self.tile::<S, 1, V>(row, rhs, out, columns);
                row += 1;
            }
        }
    }

    #[inline(always)]
    unsafe fn tile<S: Simd, const R: usize, const V: usize>(
        &self,
        row: usize,
        rhs: *const f32,
        out: *mut f32,
        columns: usize,
    ) {
        unsafe {
            for r in R..2 * R {
                let next = out.wrapping_add((row + r) * self.n).cast_const();
                S::prefetch(next);
                S::prefetch(next.wrapping_add(16));
            }
            let mut sums = [[S::splat(0.0); V]; R];
            for sample in 0..self.samples {
                let lhs = self.lhs.data.as_ptr();
                let lhs = lhs.add(self.lhs.start + sample * self.lhs.sample + row);
                let rhs = rhs.add(sample * self.rows * self.width);
                let ahead = lhs.wrapping_add(self.lhs.sample);
                let (left, right) = (self.lhs.row, self.width);
                sums = tile::<S, R, V>(sums, self.rows, lhs, 1, left, rhs, right, ahead);
            }
            for (r, sums) in sums.iter().enumerate() {
                for (v, &sum) in sums.iter().enumerate() {
                    let column = v * S::LANES;
                    if column >= columns {
                        break;
                    }
                    let left = columns - column;
                    let out = out.add((row + r) * self.n + column);
                    let sum = match self.accumulate {
                        true => S::add(load_up_to::<S>(out, left), sum),
                        false => sum,
                    };
                    store_up_to::<S>(out, left, sum);
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "matmul_tests.rs"]
mod tests;
