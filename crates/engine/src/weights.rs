//! From flat parameters to packed matrices, and from their gradients back.
//!
//! Sixteen outputs at a time go through a small block `[inputs * taps, 16]`: there the taps of
//! a weight are rows of contiguous outputs, as in the packed forward matrices and in the
//! gradients.

use crate::buffer::Buffer;
use crate::linear_map::{LinearMap, Matrix, Part};
use crate::matmul::{PANEL, panel_width};
use crate::plan::Plan;
use crate::row_moments::{row_moments, standardise, standardise_backward};
use crate::simd::{Isa, Simd, dispatch};
use crate::workers::Workers;

/// Outputs that are turned over together; divides [`PANEL`].
const OUTPUTS: usize = 16;

/// The packed weights of one parameter set.
pub(crate) struct Weights {
    pub(crate) forward: Buffer,
    pub(crate) backward: Buffer,
}

impl Weights {
    pub(crate) fn new(plan: &Plan) -> Self {
        Self {
            forward: Buffer::zeros(plan.forward_len),
            backward: Buffer::default(),
        }
    }

    /// Packs the matrices of the forward pass.
    pub(crate) fn pack_forward(&mut self, workers: Workers, isa: Isa, plan: &Plan, values: &[f32]) {
        let first = |part: &Part| part.forward[0].offset;
        let tasks = by_map(&plan.maps, first, &mut self.forward);
        workers.for_each(tasks, |(map, base, packed)| {
            pack_forward(isa, map, values, base, packed)
        });
    }

    /// Packs the matrices of the backward pass.
    pub(crate) fn pack_backward(
        &mut self,
        workers: Workers,
        isa: Isa,
        plan: &Plan,
        values: &[f32],
    ) {
        self.backward.grow(plan.backward_len);
        let first = |part: &Part| part.backward[0].offset;
        let tasks = by_map(&plan.maps, first, &mut self.backward);
        workers.for_each(tasks, |(map, base, packed)| {
            pack_backward(isa, map, values, base, packed)
        });
    }
}

/// Cuts packed weights into those of each map, with the offset at which they begin.
fn by_map<'a>(
    maps: &'a [LinearMap],
    first: impl Fn(&Part) -> usize,
    mut packed: &'a mut [f32],
) -> Vec<(&'a LinearMap, usize, &'a mut [f32])> {
    let starts: Vec<usize> = maps.iter().map(|map| first(&map.parts[0])).collect();
    let mut tasks = Vec::with_capacity(maps.len());
    for (i, map) in maps.iter().enumerate() {
        let size = starts
            .get(i + 1)
            .map_or(packed.len(), |next| next - starts[i]);
        let (own, rest) = packed.split_at_mut(size);
        tasks.push((map, starts[i], own));
        packed = rest;
    }
    tasks
}

/// Writes the weights of one output as they act, `[inputs, taps]`: standardised, or with the
/// gain.
fn effective_row(isa: Isa, map: &LinearMap, values: &[f32], source: usize, row: &mut [f32]) {
    let taps = map.form.taps();
    let weight = &values[map.weight + source * row.len()..][..row.len()];
    if map.standardised {
        let (mean, inverse) = row_moments(isa, weight);
        standardise(isa, weight, mean, inverse, row);
    } else if let Some(gain) = map.gain {
        let gains = values[gain..gain + map.inputs].iter();
        for ((row, weight), gain) in row
            .chunks_exact_mut(taps)
            .zip(weight.chunks_exact(taps))
            .zip(gains)
        {
            row.iter_mut()
                .zip(weight)
                .for_each(|(row, weight)| *row = weight * gain);
        }
    } else {
        row.copy_from_slice(weight);
    }
}

dispatch! {
    /// `block[j][r] = rows[r][j]` for up to 16 rows of `size`.
    fn turn(rows: &[f32], size: usize, block: &mut [[f32; OUTPUTS]]) = turn_body
}

dispatch! {
    /// The inverse of [`turn`].
    fn turn_back(block: &[[f32; OUTPUTS]], size: usize, rows: &mut [f32]) = turn_back_body
}

/// # Safety
/// The machine has `S`.
#[inline(always)]
unsafe fn turn_body<S: Simd>(rows: &[f32], size: usize, block: &mut [[f32; OUTPUTS]]) {
    let count = rows.len() / size;
    assert!(count <= OUTPUTS && size <= block.len());
    let whole = [count, size].map(|n| n / S::LANES * S::LANES);
    for j in (0..whole[1]).step_by(S::LANES) {
        for r in (0..whole[0]).step_by(S::LANES) {
            // SAFETY: a whole block of `LANES` rows and columns on both sides.
            unsafe {
                let to = block.as_flattened_mut().as_mut_ptr().add(j * OUTPUTS + r);
                S::transpose(rows.as_ptr().add(r * size + j), size, to, OUTPUTS);
            }
        }
    }
    for (r, row) in rows.chunks_exact(size).enumerate() {
        let from = if r < whole[0] { whole[1] } else { 0 };
        for (to, &value) in block[from..].iter_mut().zip(&row[from..]) {
            to[r] = value;
        }
    }
}

/// # Safety
/// The machine has `S`.
#[inline(always)]
unsafe fn turn_back_body<S: Simd>(block: &[[f32; OUTPUTS]], size: usize, rows: &mut [f32]) {
    let count = rows.len() / size;
    assert!(count <= OUTPUTS && size <= block.len());
    let whole = [count, size].map(|n| n / S::LANES * S::LANES);
    for r in (0..whole[0]).step_by(S::LANES) {
        for j in (0..whole[1]).step_by(S::LANES) {
            // SAFETY: a whole block of `LANES` rows and columns on both sides.
            unsafe {
                let from = block.as_flattened().as_ptr().add(j * OUTPUTS + r);
                S::transpose(from, OUTPUTS, rows.as_mut_ptr().add(r * size + j), size);
            }
        }
    }
    for (r, row) in rows.chunks_exact_mut(size).enumerate() {
        let from = if r < whole[0] { whole[1] } else { 0 };
        for (value, from) in row[from..].iter_mut().zip(&block[from..]) {
            *value = from[r];
        }
    }
}

/// Taps in a mask.
fn set_bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let tap = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (tap < 32).then_some(tap)
    })
}

fn pack_forward(isa: Isa, map: &LinearMap, values: &[f32], base: usize, packed: &mut [f32]) {
    let taps = map.form.taps();
    let size = map.inputs * taps;
    let mut rows = vec![0.0; OUTPUTS * size];
    let mut block = vec![[0.0; OUTPUTS]; size];
    let sources: Vec<usize> = map.weight_rows().collect();
    for (b, sources) in sources.chunks(OUTPUTS).enumerate() {
        let rows = &mut rows[..sources.len() * size];
        for (row, &source) in rows.chunks_exact_mut(size).zip(sources) {
            effective_row(isa, map, values, source, row);
        }
        turn(isa, rows, size, &mut block);
        let output = b * OUTPUTS;
        for part in &map.parts {
            for matrix in &part.forward {
                let panel = output / PANEL * PANEL;
                let width = panel_width(matrix.n, panel);
                let start = matrix.offset - base + panel * matrix.k + (output - panel);
                for (t, &mask) in matrix.application.taps.iter().enumerate() {
                    for ci in 0..part.channels {
                        let to = start + (t * part.channels + ci) * width;
                        let from = &block[(part.first + ci) * taps..][..taps];
                        packed[to..to + OUTPUTS].copy_from_slice(&sum_taps(from, mask));
                    }
                }
            }
        }
    }
}

/// The sum of the chosen taps' rows of a block.
fn sum_taps(taps: &[[f32; OUTPUTS]], mask: u32) -> [f32; OUTPUTS] {
    if mask.is_power_of_two() {
        return taps[mask.trailing_zeros() as usize];
    }
    let mut sum = [0.0; OUTPUTS];
    for tap in set_bits(mask) {
        sum.iter_mut().zip(taps[tap]).for_each(|(sum, w)| *sum += w);
    }
    sum
}

fn pack_backward(isa: Isa, map: &LinearMap, values: &[f32], base: usize, packed: &mut [f32]) {
    let mut row = vec![0.0; map.inputs * map.form.taps()];
    for (output, source) in map.weight_rows().enumerate() {
        effective_row(isa, map, values, source, &mut row);
        for part in &map.parts {
            for matrix in &part.backward {
                match map.form.taps() {
                    1 => spread::<1>(map, part, matrix, output, &row, base, packed),
                    3 => spread::<3>(map, part, matrix, output, &row, base, packed),
                    4 => spread::<4>(map, part, matrix, output, &row, base, packed),
                    // The first convolution: nothing asks for the gradient at the input.
                    _ => {}
                }
            }
        }
    }
}

/// Puts one output's weights into the rows of a backward matrix that belong to it.
fn spread<const TAPS: usize>(
    map: &LinearMap,
    part: &Part,
    matrix: &Matrix,
    output: usize,
    row: &[f32],
    base: usize,
    packed: &mut [f32],
) {
    for (t, &mask) in matrix.application.taps.iter().enumerate() {
        let k = t * map.outputs + output;
        let on: [f32; TAPS] = std::array::from_fn(|tap| (mask >> tap & 1) as f32);
        for panel in (0..part.channels).step_by(PANEL) {
            let width = panel_width(matrix.n, panel);
            let count = width.min(part.channels - panel);
            let to = &mut packed[matrix.offset - base + panel * matrix.k + k * width..][..count];
            let from = &row[(part.first + panel) * TAPS..][..count * TAPS];
            for (to, from) in to.iter_mut().zip(from.as_chunks::<TAPS>().0) {
                *to = from.iter().zip(on).map(|(w, on)| w * on).sum();
            }
        }
    }
}

/// Adds to the chosen taps' rows of a block.
#[inline(always)]
fn add_to_taps(gradient: &[f32], mask: u32, taps: &mut [[f32; OUTPUTS]]) {
    for tap in set_bits(mask) {
        taps[tap]
            .iter_mut()
            .zip(gradient)
            .for_each(|(to, g)| *to += g);
    }
}

/// The gradient of a map's stored weight from that of its matrices. `flat` is a part of the
/// flat gradient that begins at parameter `base` and holds the weight and its gain.
pub(crate) fn unpack_gradient(
    isa: Isa,
    map: &LinearMap,
    values: &[f32],
    matrices: &[f32],
    base: usize,
    flat: &mut [f32],
) {
    let taps = map.form.taps();
    let size = map.inputs * taps;
    let mut rows = vec![0.0; OUTPUTS * size];
    let mut block = vec![[0.0; OUTPUTS]; size];
    let sources: Vec<usize> = map.weight_rows().collect();
    for (b, sources) in sources.chunks(OUTPUTS).enumerate() {
        let output = b * OUTPUTS;
        block.fill([0.0; OUTPUTS]);
        for part in &map.parts {
            for (matrix, &offset) in part.forward.iter().zip(&part.gradient) {
                for (t, &mask) in matrix.application.taps.iter().enumerate() {
                    for ci in 0..part.channels {
                        let from = offset + (t * part.channels + ci) * matrix.n + output;
                        let to = &mut block[(part.first + ci) * taps..][..taps];
                        match matrices[from..].first_chunk::<OUTPUTS>() {
                            Some(from) if sources.len() == OUTPUTS => add_to_taps(from, mask, to),
                            _ => add_to_taps(&matrices[from..from + sources.len()], mask, to),
                        }
                    }
                }
            }
        }
        let rows = &mut rows[..sources.len() * size];
        turn_back(isa, &block, size, rows);
        for (row, &source) in rows.chunks_exact_mut(size).zip(sources) {
            let at = map.weight + source * size;
            let weight = &values[at..at + size];
            let to = &mut flat[at - base..at - base + size];
            if map.standardised {
                let (mean, inverse) = row_moments(isa, weight);
                standardise_backward(isa, weight, mean, inverse, row, to);
            } else {
                to.copy_from_slice(row);
            }
            if let Some(gain) = map.gain {
                for ci in 0..map.inputs {
                    let gradient = &mut flat[gain - base + ci];
                    *gradient += row[ci] * weight[ci];
                    flat[at - base + ci] = row[ci] * values[gain + ci];
                }
            }
        }
    }
}
