//! The forward pass of one chunk of samples.

use crate::buffer::Buffer;
use crate::group_norm::{self, Affine};
use crate::linear_map::{Application, LinearMap, Matrix};
use crate::matmul::{Add, Operand, Target, multiply};
use crate::norm_kernels::Residual;
use crate::ops::{Block, NormAt, Op, Tensor};
use crate::plan::Plan;
use crate::simd::Isa;
use crate::workspace::{Workspace, group_size};

/// What all chunks of a call share.
#[derive(Clone, Copy)]
pub(crate) struct Network<'a> {
    pub(crate) isa: Isa,
    pub(crate) plan: &'a Plan,
    /// Flat parameters.
    pub(crate) values: &'a [f32],
    /// Packed weights of the forward pass.
    pub(crate) forward: &'a [f32],
    /// Packed weights of the backward pass; empty when scoring.
    pub(crate) backward: &'a [f32],
    /// Scale and shift of all blocks: one row per distinct step.
    pub(crate) time: &'a [f32],
    pub(crate) length: usize,
}

/// A chunk of the batch.
#[derive(Clone, Copy)]
pub(crate) struct Chunk<'a> {
    /// `[samples, length, in_channels]`.
    pub(crate) x: &'a [f32],
    /// Row of the time table, per sample.
    pub(crate) steps: &'a [usize],
}

/// Rows of some samples in a buffer, as [`Operand`] has them.
#[derive(Clone, Copy)]
pub(crate) struct Field {
    pub(crate) start: usize,
    pub(crate) sample: usize,
    pub(crate) row: usize,
}

impl Field {
    /// The rows of a tensor from sample `first` on.
    pub(crate) fn of(tensor: Tensor, length: usize, first: usize) -> Self {
        let sample = tensor.size(length);
        let row = tensor.channels;
        Self {
            start: first * sample + tensor.halo * row,
            sample,
            row,
        }
    }

    /// Rows without halo from sample `first` on.
    pub(crate) fn dense(rows: usize, columns: usize, first: usize) -> Self {
        Self {
            start: first * rows * columns,
            sample: rows * columns,
            row: columns,
        }
    }

    pub(crate) fn operand(self, data: &[f32]) -> Operand<'_> {
        Operand {
            data,
            start: self.start,
            sample: self.sample,
            row: self.row,
        }
    }

    pub(crate) fn target(self, data: &mut [f32]) -> Target<'_> {
        Target {
            data,
            start: self.start,
            sample: self.sample,
            row: self.row,
        }
    }

    /// The rows that the left side of an application begins at.
    pub(crate) fn read(self, application: &Application) -> Self {
        let start = self.start as isize + application.first * self.row as isize;
        Self {
            start: start as usize,
            row: self.row * application.input_step,
            ..self
        }
    }

    /// The rows that an application's results go to.
    pub(crate) fn write(self, application: &Application) -> Self {
        Self {
            start: self.start + application.output_first * self.row,
            row: self.row * application.output_step,
            ..self
        }
    }

    /// The rows of one sample, contiguous.
    pub(crate) fn range(self, sample: usize, rows: usize) -> std::ops::Range<usize> {
        let start = self.start + sample * self.sample;
        start..start + rows * self.row
    }
}

/// Applies packed matrices to samples of `rows` output rows.
#[expect(
    clippy::too_many_arguments,
    reason = "a product: two operands, a result, and their sizes"
)]
pub(crate) fn apply(
    isa: Isa,
    packed: &[f32],
    matrices: &[Matrix],
    samples: usize,
    rows: usize,
    input: (&[f32], Field),
    bias: Option<&[f32]>,
    add: Add<'_>,
    output: (&mut [f32], Field),
) {
    for matrix in matrices {
        let application = &matrix.application;
        let add = match add {
            Add::Other(Operand {
                data,
                start,
                sample,
                row,
            }) => Add::Other(
                Field { start, sample, row }
                    .write(application)
                    .operand(data),
            ),
            other => other,
        };
        multiply(
            isa,
            samples,
            rows / application.output_step,
            matrix.k,
            matrix.n,
            input.1.read(application).operand(input.0),
            &packed[matrix.offset..],
            bias,
            add,
            output.1.write(application).target(output.0),
        );
    }
}

/// Zeroes the rows around every sample.
pub(crate) fn clear_halo(tensor: Tensor, length: usize, samples: usize, data: &mut [f32]) {
    let (size, halo) = (tensor.size(length), tensor.halo * tensor.channels);
    for sample in data[..samples * size].chunks_exact_mut(size) {
        sample[..halo].fill(0.0);
        sample[size - halo..].fill(0.0);
    }
}

impl Network<'_> {
    pub(crate) fn tensor(&self, id: usize) -> Tensor {
        self.plan.tensors[id]
    }

    pub(crate) fn map(&self, id: usize) -> &LinearMap {
        &self.plan.maps[id]
    }

    pub(crate) fn field(&self, id: usize, first: usize) -> Field {
        Field::of(self.tensor(id), self.length, first)
    }

    /// The affine part of a block's normalisation for one sample.
    pub(crate) fn affine(&self, norm: NormAt, channels: usize) -> Affine<'_> {
        Affine {
            groups: self.plan.config.groups,
            gain: &self.values[norm.gain..][..channels],
            offset: &self.values[norm.offset..][..channels],
            scale_shift: None,
        }
    }

    /// As [`Network::affine`], modulated by the block's scale and shift of a step.
    pub(crate) fn modulated(&self, block: &Block, channels: usize, step: usize) -> Affine<'_> {
        let row = &self.time[step * self.plan.time.columns + block.time_column..];
        Affine {
            scale_shift: Some((&row[..channels], &row[channels..2 * channels])),
            ..self.affine(block.norm1, channels)
        }
    }

    /// Runs the network; the output stays in its tensor.
    pub(crate) fn forward(&self, chunk: Chunk<'_>, ws: &mut Workspace) {
        let samples = chunk.steps.len();
        self.stage(chunk, &mut ws.slots[ws.slot_of[0]]);
        for op in &self.plan.ops {
            let slot = ws.slot_of[op.output()];
            let mut output = std::mem::take(&mut ws.slots[slot]);
            match op {
                Op::Map {
                    map,
                    input,
                    output: to,
                } => {
                    self.convolve(*map, *input, *to, samples, ws, &mut output);
                }
                Op::Block(block) => self.block(block, chunk.steps, ws, &mut output),
                Op::Attention(attention) => self.attend(attention, samples, ws, &mut output),
            }
            clear_halo(self.tensor(op.output()), self.length, samples, &mut output);
            ws.slots[slot] = output;
        }
    }

    /// Copies the network's output, `[samples, length, out_channels]`.
    pub(crate) fn copy_output(&self, samples: usize, ws: &Workspace, output: &mut [f32]) {
        let last = self.plan.tensors.len() - 1;
        let field = self.field(last, 0);
        let size = self.length * self.plan.config.out_channels;
        for (sample, to) in output.chunks_exact_mut(size).enumerate().take(samples) {
            to.copy_from_slice(&ws.slots[ws.slot_of[last]][field.range(sample, self.length)]);
        }
    }

    /// Puts the input between its halo rows.
    fn stage(&self, chunk: Chunk<'_>, staged: &mut Buffer) {
        let tensor = self.tensor(0);
        let samples = chunk.steps.len();
        clear_halo(tensor, self.length, samples, staged);
        let field = self.field(0, 0);
        let size = self.length * tensor.channels;
        for (sample, x) in chunk.x.chunks_exact(size).enumerate().take(samples) {
            staged[field.range(sample, self.length)].copy_from_slice(x);
        }
    }

    fn convolve(
        &self,
        map: usize,
        input: usize,
        output: usize,
        samples: usize,
        ws: &Workspace,
        data: &mut [f32],
    ) {
        let map = self.map(map);
        apply(
            self.isa,
            self.forward,
            &map.parts[0].forward,
            samples,
            self.tensor(output).rows(self.length),
            (&ws.slots[ws.slot_of[input]], self.field(input, 0)),
            map.bias(self.values),
            Add::Nothing,
            (data, self.field(output, 0)),
        );
    }

    /// Applies a map to one or two tensors, as if they were concatenated.
    fn convolve_parts(
        &self,
        map: &LinearMap,
        inputs: &[usize],
        (first, samples): (usize, usize),
        rows: usize,
        ws: (&[Buffer], &[usize]),
        output: (&mut [f32], Field),
    ) {
        let (data, field) = output;
        let mut bias = map.bias(self.values);
        for (part, &input) in map.parts.iter().zip(inputs) {
            let x = (&ws.0[ws.1[input]][..], self.field(input, first));
            let add = if bias.is_some() {
                Add::Nothing
            } else {
                Add::Target
            };
            apply(
                self.isa,
                self.forward,
                &part.forward,
                samples,
                rows,
                x,
                bias.take(),
                add,
                (&mut *data, field),
            );
        }
    }

    fn block(&self, block: &Block, steps: &[usize], ws: &mut Workspace, output: &mut [f32]) {
        let tensor = self.tensor(block.output);
        let (rows, channels) = (tensor.rows(self.length), tensor.channels);
        let (conv1, conv2) = (self.map(block.conv1), self.map(block.conv2));
        let Workspace {
            slots,
            slot_of,
            blocks,
            norm,
            training,
            ..
        } = ws;
        let store = &mut blocks[if *training { block.index } else { 0 }];
        let groups = 2 * self.plan.config.groups;
        for first in (0..steps.len()).step_by(group_size(rows)) {
            let count = group_size(rows).min(steps.len() - first);
            // Only a backward pass needs the intermediates of more than one group.
            let held = if *training { first } else { 0 };
            let dense = Field::dense(rows, channels, held);
            let hidden = Field::of(tensor, self.length, held);
            let at = (first, count);

            let target = (&mut store.first[..], dense);
            self.convolve_parts(conv1, &block.inputs, at, rows, (slots, slot_of), target);
            for s in 0..count {
                let affine = self.modulated(block, channels, steps[first + s]);
                group_norm::forward(
                    self.isa,
                    &affine,
                    &store.first[dense.range(s, rows)],
                    Residual::Nothing,
                    &mut store.hidden[hidden.range(s, rows)],
                    &mut store.statistics[2 * (held + s) * groups..][..groups],
                    norm,
                );
            }
            let size = tensor.size(self.length);
            clear_halo(tensor, self.length, count, &mut store.hidden[held * size..]);

            apply(
                self.isa,
                self.forward,
                &conv2.parts[0].forward,
                count,
                rows,
                (&store.hidden, hidden),
                conv2.bias(self.values),
                Add::Nothing,
                (&mut store.second, dense),
            );
            let to = Field::of(tensor, self.length, first);
            if let Some(residual) = block.residual {
                let map = self.map(residual);
                let target = (&mut *output, to);
                self.convolve_parts(map, &block.inputs, at, rows, (slots, slot_of), target);
            }
            let affine = self.affine(block.norm2, channels);
            for s in 0..count {
                let input = &slots[slot_of[block.inputs[0]]];
                let residual = match block.residual {
                    Some(_) => Residual::Output,
                    None => Residual::Other(&input[to.range(s, rows)]),
                };
                group_norm::forward(
                    self.isa,
                    &affine,
                    &store.second[dense.range(s, rows)],
                    residual,
                    &mut output[to.range(s, rows)],
                    &mut store.statistics[(2 * (held + s) + 1) * groups..][..groups],
                    norm,
                );
            }
        }
    }
}
