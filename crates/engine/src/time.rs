//! From diffusion steps to every block's scale and shift, once per distinct step.

use std::collections::HashMap;

use dose3_model::sinusoidal_into;

use crate::buffer::Buffer;
use crate::forward::{Field, apply};
use crate::gradient::SharedGradient;
use crate::matmul::{Add, PANEL, outer};
use crate::norm_kernels::add_column_sums;
use crate::plan::Plan;
use crate::simd::Isa;

/// More distinct steps than this are forgotten at the next call.
const REMEMBERED: usize = 1024;

/// The time embedding and the table of scales and shifts; a row per distinct step, kept until
/// the parameters change.
#[derive(Default)]
pub(crate) struct TimeTable {
    row_of: HashMap<u32, usize>,
    /// `[rows, width]`.
    features: Buffer,
    /// Before and after the GELU, `[rows, 4 width]`.
    hidden: Buffer,
    gelu: Buffer,
    /// The embedding and its SiLU.
    embedding: Buffer,
    silu: Buffer,
    /// `[rows, columns]`.
    table: Buffer,
    /// Row of each sample of the batch.
    steps: Vec<usize>,
}

impl TimeTable {
    /// Forgets everything: the parameters changed.
    pub(crate) fn clear(&mut self) {
        self.row_of.clear();
    }

    /// `[rows, columns]`.
    pub(crate) fn table(&self) -> &[f32] {
        &self.table
    }

    /// Row of each sample of the last batch.
    pub(crate) fn steps(&self) -> &[usize] {
        &self.steps
    }

    /// Finds the rows of a batch, computing those that are new.
    pub(crate) fn look_up(
        &mut self,
        isa: Isa,
        plan: &Plan,
        values: &[f32],
        packed: &[f32],
        steps: &[f32],
    ) {
        if self.row_of.len() > REMEMBERED {
            self.clear();
        }
        let known = self.row_of.len();
        self.steps.clear();
        let width = plan.config.width;
        for step in steps {
            let next = self.row_of.len();
            let row = *self.row_of.entry(step.to_bits()).or_insert(next);
            if row == next {
                self.features.grow((row + 1) * width);
                sinusoidal_into(*step, &mut self.features[row * width..][..width]);
            }
            self.steps.push(row);
        }
        if self.row_of.len() > known {
            self.compute(isa, plan, values, packed, known);
        }
    }

    /// Computes the rows from `first` on.
    fn compute(&mut self, isa: Isa, plan: &Plan, values: &[f32], packed: &[f32], first: usize) {
        let (rows, time) = (self.row_of.len(), plan.config.time_width());
        let count = rows - first;
        for buffer in [
            &mut self.hidden,
            &mut self.gelu,
            &mut self.embedding,
            &mut self.silu,
        ] {
            buffer.grow(rows * time);
        }
        self.table.grow(rows * plan.time.columns);
        let linear = |map: usize, input: (&[f32], usize), output: (&mut [f32], usize, usize)| {
            let map = &plan.maps[map];
            let (data, column, columns) = output;
            let to = Field {
                start: first * columns + column,
                sample: 0,
                row: columns,
            };
            let from = Field {
                start: first * input.1,
                sample: 0,
                row: input.1,
            };
            let bias = map.bias(values);
            let matrices = &map.parts[0].forward;
            apply(
                isa,
                packed,
                matrices,
                1,
                count,
                (input.0, from),
                bias,
                Add::Nothing,
                (data, to),
            );
        };
        let new = first * time..rows * time;
        linear(
            plan.time.linear1,
            (&self.features, plan.config.width),
            (&mut self.hidden, 0, time),
        );
        for (x, y) in self.hidden[new.clone()]
            .iter()
            .zip(&mut self.gelu[new.clone()])
        {
            *y = gelu(*x);
        }
        linear(
            plan.time.linear2,
            (&self.gelu, time),
            (&mut self.embedding, 0, time),
        );
        for (x, y) in self.embedding[new.clone()].iter().zip(&mut self.silu[new]) {
            *y = x / (1.0 + (-x).exp());
        }
        for &(map, column) in &plan.time.blocks {
            linear(
                map,
                (&self.silu, time),
                (&mut self.table, column, plan.time.columns),
            );
        }
    }

    /// The gradients of the time layers from those at every sample's scales and shifts,
    /// `[batch, columns]`.
    pub(crate) fn backward(
        &self,
        isa: Isa,
        plan: &Plan,
        packed: &[f32],
        samples: &[f32],
        gradients: &mut [SharedGradient],
    ) {
        let (rows, time, columns) = (
            self.row_of.len(),
            plan.config.time_width(),
            plan.time.columns,
        );
        let mut table = Buffer::zeros(rows * columns);
        for (&row, sample) in self.steps.iter().zip(samples.chunks_exact(columns)) {
            let sum = &mut table[row * columns..][..columns];
            for (sum, g) in sum.iter_mut().zip(sample) {
                *sum += g;
            }
        }
        let mut panel = Buffer::zeros(rows * PANEL);
        let mut layer = |map: usize,
                         x: (&[f32], usize),
                         dy: (&[f32], usize, usize),
                         dx: Option<(&mut [f32], bool)>| {
            let gradient = gradients[map].get();
            let map = &plan.maps[map];
            let (data, start, row) = dy;
            let dy = Field {
                start,
                sample: 0,
                row,
            };
            let from = Field {
                start: 0,
                sample: 0,
                row: x.1,
            };
            outer(
                isa,
                1,
                rows,
                map.inputs,
                map.outputs,
                from.operand(x.0),
                dy.operand(data),
                &mut panel,
                false,
                &mut gradient.matrices,
            );
            gradient.bias.fill(0.0);
            for r in 0..rows {
                let dy = &data[start + r * row..][..map.outputs];
                add_column_sums(isa, dy, map.outputs, &mut gradient.bias);
            }
            if let Some((dx, accumulate)) = dx {
                let add = if accumulate {
                    Add::Target
                } else {
                    Add::Nothing
                };
                let to = Field {
                    start: 0,
                    sample: 0,
                    row: map.inputs,
                };
                let matrices = &map.parts[0].backward;
                apply(
                    isa,
                    packed,
                    matrices,
                    1,
                    rows,
                    (data, dy),
                    None,
                    add,
                    (dx, to),
                );
            }
        };
        let mut dsilu = Buffer::zeros(rows * time);
        for (i, &(map, column)) in plan.time.blocks.iter().enumerate() {
            layer(
                map,
                (&self.silu, time),
                (&table, column, columns),
                Some((&mut dsilu, i > 0)),
            );
        }
        for (d, x) in dsilu.iter_mut().zip(self.embedding.iter()) {
            let s = 1.0 / (1.0 + (-x).exp());
            *d *= s * (1.0 + x * (1.0 - s));
        }
        let mut dgelu = Buffer::zeros(rows * time);
        layer(
            plan.time.linear2,
            (&self.gelu, time),
            (&dsilu, 0, time),
            Some((&mut dgelu, false)),
        );
        for (d, x) in dgelu.iter_mut().zip(self.hidden.iter()) {
            *d *= gelu_slope(*x);
        }
        let width = plan.config.width;
        layer(
            plan.time.linear1,
            (&self.features, width),
            (&dgelu, 0, time),
            None,
        );
    }
}

/// `x (1 + erf(x / sqrt 2)) / 2`.
fn gelu(x: f32) -> f32 {
    let x = f64::from(x);
    (0.5 * x * (1.0 + libm::erf(x * std::f64::consts::FRAC_1_SQRT_2))) as f32
}

fn gelu_slope(x: f32) -> f32 {
    let x = f64::from(x);
    let density = (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
    (0.5 * (1.0 + libm::erf(x * std::f64::consts::FRAC_1_SQRT_2)) + x * density) as f32
}
