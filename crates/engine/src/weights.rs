//! From flat parameters to packed matrices, and from their gradients back.

use crate::buffer::Buffer;
use crate::linear_map::{LinearMap, Matrix, Part};
use crate::matmul::{PANEL, panel_width};
use crate::plan::Plan;

/// Added to the variance of a standardised weight.
const EPSILON: f64 = 1e-5;

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
    pub(crate) fn pack_forward(&mut self, plan: &Plan, values: &[f32]) {
        let mut row = Vec::new();
        for map in &plan.maps {
            for (o, source) in map.weight_rows().enumerate() {
                effective_row(map, values, source, &mut row);
                for part in &map.parts {
                    for matrix in &part.forward {
                        scatter_forward(map, part, matrix, o, &row, &mut self.forward);
                    }
                }
            }
        }
    }

    /// Packs the matrices of the backward pass.
    pub(crate) fn pack_backward(&mut self, plan: &Plan, values: &[f32]) {
        self.backward.grow(plan.backward_len);
        let mut row = Vec::new();
        for map in &plan.maps {
            for (o, source) in map.weight_rows().enumerate() {
                effective_row(map, values, source, &mut row);
                for part in &map.parts {
                    for matrix in &part.backward {
                        scatter_backward(map, part, matrix, o, &row, &mut self.backward);
                    }
                }
            }
        }
    }
}

/// Mean and `1 / sqrt(variance + 1e-5)` of a weight row.
fn moments(row: &[f32]) -> (f64, f64) {
    let count = row.len() as f64;
    let mean = row.iter().map(|&w| f64::from(w)).sum::<f64>() / count;
    let variance = row
        .iter()
        .map(|&w| (f64::from(w) - mean).powi(2))
        .sum::<f64>()
        / count;
    (mean, 1.0 / (variance + EPSILON).sqrt())
}

/// The weights of one output as they act: `[inputs, taps]`, standardised or with the gain.
fn effective_row(map: &LinearMap, values: &[f32], source: usize, row: &mut Vec<f32>) {
    let taps = map.form.taps();
    let size = map.inputs * taps;
    let weight = &values[map.weight + source * size..][..size];
    row.clear();
    if map.standardised {
        let (mean, inverse) = moments(weight);
        row.extend(
            weight
                .iter()
                .map(|&w| ((f64::from(w) - mean) * inverse) as f32),
        );
    } else if let Some(gain) = map.gain {
        let gains = values[gain..gain + map.inputs]
            .iter()
            .flat_map(|g| std::iter::repeat_n(g, taps));
        row.extend(weight.iter().zip(gains).map(|(w, g)| w * g));
    } else {
        row.extend_from_slice(weight);
    }
}

/// The sum of the taps in `mask`.
fn masked(taps: &[f32], mask: u32) -> f32 {
    let chosen = taps.iter().enumerate().filter(|(t, _)| mask >> t & 1 == 1);
    chosen.map(|(_, w)| w).sum()
}

fn scatter_forward(
    map: &LinearMap,
    part: &Part,
    matrix: &Matrix,
    output: usize,
    row: &[f32],
    packed: &mut [f32],
) {
    let taps = map.form.taps();
    let panel = output / PANEL * PANEL;
    let width = panel_width(matrix.n, panel);
    let base = matrix.offset + panel * matrix.k + (output - panel);
    for (t, &mask) in matrix.application.taps.iter().enumerate() {
        for ci in 0..part.channels {
            let source = &row[(part.first + ci) * taps..][..taps];
            packed[base + (t * part.channels + ci) * width] = masked(source, mask);
        }
    }
}

fn scatter_backward(
    map: &LinearMap,
    part: &Part,
    matrix: &Matrix,
    output: usize,
    row: &[f32],
    packed: &mut [f32],
) {
    let taps = map.form.taps();
    for (t, &mask) in matrix.application.taps.iter().enumerate() {
        let k = t * map.outputs + output;
        for ci in 0..part.channels {
            let panel = ci / PANEL * PANEL;
            let width = panel_width(matrix.n, panel);
            let source = &row[(part.first + ci) * taps..][..taps];
            packed[matrix.offset + panel * matrix.k + k * width + (ci - panel)] =
                masked(source, mask);
        }
    }
}

/// Adds the gradient of a map's matrices, as they act, to that of its stored weight (and gain).
pub(crate) fn unpack_gradient(map: &LinearMap, values: &[f32], matrices: &[f32], flat: &mut [f32]) {
    let taps = map.form.taps();
    let size = map.inputs * taps;
    let mut row = vec![0.0f32; size];
    for (o, source) in map.weight_rows().enumerate() {
        row.fill(0.0);
        for part in &map.parts {
            for (matrix, &offset) in part.forward.iter().zip(&part.gradient) {
                for (t, &mask) in matrix.application.taps.iter().enumerate() {
                    for ci in 0..part.channels {
                        let g = matrices[offset + (t * part.channels + ci) * matrix.n + o];
                        let to = &mut row[(part.first + ci) * taps..][..taps];
                        for (tap, to) in to.iter_mut().enumerate() {
                            if mask >> tap & 1 == 1 {
                                *to += g;
                            }
                        }
                    }
                }
            }
        }
        let at = map.weight + source * size;
        let weight = &values[at..at + size];
        if map.standardised {
            standardise_backward(weight, &mut row);
        } else if let Some(gain) = map.gain {
            for ci in 0..map.inputs {
                for t in ci * taps..(ci + 1) * taps {
                    flat[gain + ci] += row[t] * weight[t];
                    row[t] *= values[gain + ci];
                }
            }
        }
        flat[at..at + size].copy_from_slice(&row);
    }
}

/// From the gradient at a standardised weight row to that at the stored one.
fn standardise_backward(weight: &[f32], gradient: &mut [f32]) {
    let (mean, inverse) = moments(weight);
    let count = weight.len() as f64;
    let (mut sum, mut product) = (0.0, 0.0);
    for (&w, &g) in weight.iter().zip(&*gradient) {
        sum += f64::from(g);
        product += f64::from(g) * (f64::from(w) - mean) * inverse;
    }
    for (&w, g) in weight.iter().zip(gradient) {
        let unit = (f64::from(w) - mean) * inverse;
        *g = (inverse * (f64::from(*g) - sum / count - unit * product / count)) as f32;
    }
}
