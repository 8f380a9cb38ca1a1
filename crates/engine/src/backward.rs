//! The backward pass of one chunk of samples.

use std::sync::atomic::AtomicBool;

use crate::attention_kernels::{
    RowsAt, normalise_rows_backward, pack_rows, pack_transposed, softmax_backward,
    standardise_rows_backward,
};
use crate::buffer::Buffer;
use crate::forward::{Field, Network, QUERY_LENGTH, apply};
use crate::gradient::{MapGradient, OrderedGradient};
use crate::group_norm::{self, Affine, Gradients};
use crate::linear_map::Part;
use crate::matmul::{Add, Operand, Target, multiply, outer};
use crate::norm_kernels::{add_assign, add_column_sums};
use crate::plan::{Attention, Block, Op};
use crate::workspace::{AttentionScratch, BackwardScratch, Workspace, query_tile};

/// Another chunk gave up; so does this one.
pub(crate) struct Stopped;

/// A chunk on its way back.
pub(crate) struct Backward<'a> {
    pub(crate) network: Network<'a>,
    /// Number of the chunk in the batch: its turn at every gradient.
    pub(crate) chunk: usize,
    /// Row of the time table, per sample.
    pub(crate) steps: &'a [usize],
    pub(crate) gradients: &'a [OrderedGradient],
    pub(crate) stop: &'a AtomicBool,
}

impl Backward<'_> {
    /// From the gradient at the output (in the workspace) to those of all parameters.
    /// `time` gets the gradient at every sample's scales and shifts, `[samples, columns]`.
    pub(crate) fn run(&self, ws: &mut Workspace, time: &mut [f32]) -> Result<(), Stopped> {
        let plan = self.network.plan;
        let samples = self.steps.len();
        ws.backward.started.fill(false);
        self.seed(ws);
        for op in plan.ops.iter().rev() {
            let slot = plan.gradients.of[op.output()];
            let upstream = std::mem::take(&mut ws.backward.slots[slot]);
            let done = match op {
                Op::Map { map, input, output } => {
                    self.convolution(*map, *input, *output, samples, ws, &upstream)
                }
                Op::Block(block) => self.block(block, ws, &upstream, time),
                Op::Attention(attention) => self.attention(attention, ws, &upstream),
            };
            ws.backward.slots[slot] = upstream;
            done?;
        }
        Ok(())
    }

    /// Puts the gradient at the output between its halo rows.
    fn seed(&self, ws: &mut Workspace) {
        let plan = self.network.plan;
        let last = plan.tensors.len() - 1;
        let length = self.network.length;
        let field = self.network.field(last, 0);
        let size = length * plan.config.out_channels;
        let BackwardScratch {
            slots,
            output_gradient,
            ..
        } = &mut ws.backward;
        let data = &mut slots[plan.gradients.of[last]];
        crate::forward::clear_halo(self.network.tensor(last), length, self.steps.len(), data);
        for (sample, d) in output_gradient
            .chunks_exact(size)
            .enumerate()
            .take(self.steps.len())
        {
            data[field.range(sample, length)].copy_from_slice(d);
        }
    }

    /// Waits for this chunk's turn at a map's gradient.
    fn add(&self, map: usize, part: impl FnOnce(&mut MapGradient)) -> Result<(), Stopped> {
        self.gradients[map]
            .add(self.chunk, self.stop, part)
            .ok_or(Stopped)
    }

    /// Adds the gradient of one part's matrices.
    fn weight_gradient(
        &self,
        part: &Part,
        samples: usize,
        rows: usize,
        x: (&[f32], Field),
        dy: (&[f32], Field),
        panel: &mut [f32],
        gradient: &mut MapGradient,
    ) {
        for (matrix, &offset) in part.forward.iter().zip(&part.gradient) {
            let application = &matrix.application;
            outer(
                self.network.isa,
                samples,
                rows / application.output_step,
                matrix.k,
                matrix.n,
                x.1.read(application).operand(x.0),
                dy.1.write(application).operand(dy.0),
                panel,
                self.chunk > 0,
                &mut gradient.matrices[offset..],
            );
        }
    }

    /// Adds to (or begins) the gradient of a tensor that a map's part reads.
    fn input_gradient(
        &self,
        part: &Part,
        tensor: usize,
        dy: (&[f32], Field),
        slots: &mut [Buffer],
        started: &mut [bool],
    ) {
        let network = &self.network;
        let rows = network.tensor(tensor).rows(network.length);
        let add = if started[tensor] {
            Add::Target
        } else {
            Add::Nothing
        };
        let to = (
            &mut slots[network.plan.gradients.of[tensor]][..],
            network.field(tensor, 0),
        );
        let samples = self.steps.len();
        apply(
            network.isa,
            network.backward,
            &part.backward,
            samples,
            rows,
            dy,
            None,
            add,
            to,
        );
        self.finish(tensor, slots, started);
    }

    /// Notes that a tensor's gradient has begun.
    fn finish(&self, tensor: usize, slots: &mut [Buffer], started: &mut [bool]) {
        if !started[tensor] {
            let data = &mut slots[self.network.plan.gradients.of[tensor]];
            let (shape, length) = (self.network.tensor(tensor), self.network.length);
            crate::forward::clear_halo(shape, length, self.steps.len(), data);
            started[tensor] = true;
        }
    }

    /// Adds a gradient of the same shape to that of a tensor, or begins it so.
    fn pass(&self, tensor: usize, upstream: &[f32], slots: &mut [Buffer], started: &mut [bool]) {
        let size = self.network.tensor(tensor).size(self.network.length) * self.steps.len();
        let to = &mut slots[self.network.plan.gradients.of[tensor]][..size];
        if started[tensor] {
            add_assign(self.network.isa, &upstream[..size], to);
        } else {
            to.copy_from_slice(&upstream[..size]);
            started[tensor] = true;
        }
    }

    fn convolution(
        &self,
        id: usize,
        input: usize,
        output: usize,
        samples: usize,
        ws: &mut Workspace,
        upstream: &[f32],
    ) -> Result<(), Stopped> {
        let network = &self.network;
        let map = network.map(id);
        let rows = network.tensor(output).rows(network.length);
        let dy = (upstream, network.field(output, 0));
        let x = (&ws.slots[ws.slot_of[input]][..], network.field(input, 0));
        let panel = &mut ws.backward.panel;
        self.add(id, |gradient| {
            self.weight_gradient(&map.parts[0], samples, rows, x, dy, panel, gradient);
            self.bias_gradient(samples, rows, dy, gradient);
        })?;
        // Nothing asks for the gradient at the network's input.
        if input != 0 {
            self.input_gradient(
                &map.parts[0],
                input,
                dy,
                &mut ws.backward.slots,
                &mut ws.backward.started,
            );
        }
        Ok(())
    }

    fn bias_gradient(
        &self,
        samples: usize,
        rows: usize,
        dy: (&[f32], Field),
        gradient: &mut MapGradient,
    ) {
        for s in 0..samples {
            let dy = &dy.0[dy.1.range(s, rows)];
            add_column_sums(
                self.network.isa,
                dy,
                gradient.bias.len(),
                &mut gradient.bias,
            );
        }
    }

    fn block(
        &self,
        block: &Block,
        ws: &mut Workspace,
        upstream: &[f32],
        time: &mut [f32],
    ) -> Result<(), Stopped> {
        let network = &self.network;
        let (isa, length, samples) = (network.isa, network.length, self.steps.len());
        let tensor = network.tensor(block.output);
        let (rows, channels) = (tensor.rows(length), tensor.channels);
        let haloed = network.field(block.output, 0);
        let dense = Field::dense(rows, channels, 0);
        let groups = 2 * network.plan.config.groups;
        let (conv1, conv2) = (network.map(block.conv1), network.map(block.conv2));
        let store = &ws.blocks[block.index];
        let statistics =
            |s: usize, which: usize| &store.statistics[(2 * s + which) * groups..][..groups];
        let b = &mut ws.backward;

        // Through the second normalisation and convolution.
        b.vectors.iter_mut().for_each(|v| v.fill(0.0));
        let [bias, gain, offset] = &mut b.vectors;
        for s in 0..samples {
            group_norm::backward(
                isa,
                &network.affine(block.norm2, channels),
                &upstream[haloed.range(s, rows)],
                &store.second[dense.range(s, rows)],
                statistics(s, 1),
                &mut b.sample,
                &mut b.upstream[haloed.range(s, rows)],
                Gradients {
                    bias,
                    gain,
                    offset,
                    scale_shift: None,
                },
                &mut ws.norm,
            );
        }
        crate::forward::clear_halo(tensor, length, samples, &mut b.upstream);
        self.add(block.conv2, |gradient| {
            let (x, dy) = ((&store.hidden[..], haloed), (&b.upstream[..], haloed));
            self.weight_gradient(
                &conv2.parts[0],
                samples,
                rows,
                x,
                dy,
                &mut b.panel,
                gradient,
            );
            self.vector_gradients(&b.vectors, gradient);
        })?;
        apply(
            isa,
            network.backward,
            &conv2.parts[0].backward,
            samples,
            rows,
            (&b.upstream, haloed),
            None,
            Add::Nothing,
            (&mut b.hidden, dense),
        );

        // Through the first.
        b.vectors.iter_mut().for_each(|v| v.fill(0.0));
        let [bias, gain, offset] = &mut b.vectors;
        for s in 0..samples {
            let affine: Affine<'_> = network.modulated(block, channels, self.steps[s]);
            let at = s * network.plan.time.columns + block.time_column;
            let (scale, shift) = time[at..at + 2 * channels].split_at_mut(channels);
            group_norm::backward(
                isa,
                &affine,
                &b.hidden[dense.range(s, rows)],
                &store.first[dense.range(s, rows)],
                statistics(s, 0),
                &mut b.sample,
                &mut b.upstream[haloed.range(s, rows)],
                Gradients {
                    bias,
                    gain,
                    offset,
                    scale_shift: Some((scale, shift)),
                },
                &mut ws.norm,
            );
        }
        let dy = (&b.upstream[..], haloed);
        let input = |tensor: usize| (&ws.slots[ws.slot_of[tensor]][..], network.field(tensor, 0));
        self.add(block.conv1, |gradient| {
            for (part, &tensor) in conv1.parts.iter().zip(&block.inputs) {
                self.weight_gradient(
                    part,
                    samples,
                    rows,
                    input(tensor),
                    dy,
                    &mut b.panel,
                    gradient,
                );
            }
            self.vector_gradients(&b.vectors, gradient);
        })?;
        for (part, &tensor) in conv1.parts.iter().zip(&block.inputs) {
            self.input_gradient(part, tensor, dy, &mut b.slots, &mut b.started);
        }

        // Around them.
        let Some(residual) = block.residual else {
            self.pass(block.inputs[0], upstream, &mut b.slots, &mut b.started);
            return Ok(());
        };
        let dy = (upstream, haloed);
        let map = network.map(residual);
        self.add(residual, |gradient| {
            for (part, &tensor) in map.parts.iter().zip(&block.inputs) {
                self.weight_gradient(
                    part,
                    samples,
                    rows,
                    input(tensor),
                    dy,
                    &mut b.panel,
                    gradient,
                );
            }
            self.bias_gradient(samples, rows, dy, gradient);
        })?;
        for (part, &tensor) in map.parts.iter().zip(&block.inputs) {
            self.input_gradient(part, tensor, dy, &mut b.slots, &mut b.started);
        }
        Ok(())
    }

    fn vector_gradients(&self, sums: &[Vec<f32>; 3], gradient: &mut MapGradient) {
        let MapGradient {
            bias, gain, offset, ..
        } = gradient;
        for (to, sum) in [bias, gain, offset].into_iter().zip(sums) {
            let count = to.len();
            add_assign(self.network.isa, &sum[..count], to);
        }
    }

    fn attention(
        &self,
        attention: &Attention,
        ws: &mut Workspace,
        upstream: &[f32],
    ) -> Result<(), Stopped> {
        let network = &self.network;
        let (isa, length, samples) = (network.isa, network.length, self.steps.len());
        let tensor = network.tensor(attention.output);
        let (rows, channels) = (tensor.rows(length), tensor.channels);
        let (dim, inner) = (
            network.plan.config.head_dim,
            network.plan.config.attention_width(),
        );
        let out = network.map(attention.out);
        let dy = (upstream, network.field(attention.output, 0));
        let attended = Field::dense(rows, inner, 0);
        let b = &mut ws.backward;
        self.add(attention.out, |gradient| {
            let x = (&ws.attended[attention.index][..], attended);
            self.weight_gradient(&out.parts[0], samples, rows, x, dy, &mut b.panel, gradient);
            self.bias_gradient(samples, rows, dy, gradient);
        })?;
        apply(
            isa,
            network.backward,
            &out.parts[0].backward,
            samples,
            rows,
            dy,
            None,
            Add::Nothing,
            (&mut b.attended, attended),
        );

        let x = &ws.slots[ws.slot_of[attention.input]];
        let scratch = &mut ws.attention;
        for s in 0..samples {
            network.normalise(&x[dy.1.range(s, rows)], channels, s, scratch);
        }
        let qkv = Field::dense(rows, 3 * dim, 0);
        let normalised = Field::dense(rows, channels, 0);
        for (head, &id) in attention.heads.iter().enumerate() {
            for s in 0..samples {
                network.head(id, s, rows, scratch);
                let at = RowsAt {
                    start: s * rows * inner + head * dim,
                    row: inner,
                };
                self.head(rows, s, at, scratch, b);
            }
            let map = network.map(id);
            let dy = (&b.qkv[..], qkv);
            self.add(id, |gradient| {
                let x = (&scratch.normalised[..], normalised);
                self.weight_gradient(&map.parts[0], samples, rows, x, dy, &mut b.panel, gradient);
            })?;
            let add = if head > 0 { Add::Target } else { Add::Nothing };
            let to = (&mut b.normalised[..], normalised);
            let matrices = &map.parts[0].backward;
            apply(
                isa,
                network.backward,
                matrices,
                samples,
                rows,
                dy,
                None,
                add,
                to,
            );
        }

        self.pass(attention.input, upstream, &mut b.slots, &mut b.started);
        let dx = &mut b.slots[network.plan.gradients.of[attention.input]];
        for s in 0..samples {
            let range = normalised.range(s, rows);
            standardise_rows_backward(
                isa,
                &b.normalised[range.clone()],
                &scratch.normalised[range],
                &scratch.inverse[s * rows..][..rows],
                channels,
                &mut dx[dy.1.range(s, rows)],
            );
        }
        Ok(())
    }

    /// Backward through one head of one sample: from the gradient of the attended values (at
    /// `upstream` in the attended gradient) to that of query, key and value before their
    /// normalisation. Scores are computed again rather than kept.
    fn head(
        &self,
        rows: usize,
        s: usize,
        upstream: RowsAt,
        scratch: &mut AttentionScratch,
        b: &mut BackwardScratch,
    ) {
        let isa = self.network.isa;
        let dim = self.network.plan.config.head_dim;
        let width = rows.next_multiple_of(16);
        let at = |start| RowsAt {
            start,
            row: 3 * dim,
        };
        pack_transposed(
            isa,
            &scratch.qkv,
            at(2 * dim),
            rows,
            dim,
            &mut b.values_transposed,
        );
        // Keys as rows; the attention's own room for values is free here.
        pack_rows(&scratch.qkv, at(dim), rows, dim, &mut scratch.values);
        let tile = query_tile(rows);
        for from in (0..rows).step_by(tile) {
            let count = tile.min(rows - from);
            self.network.scores((from, count), rows, scratch);
            let du = Operand {
                data: &b.attended,
                start: upstream.start + from * upstream.row,
                sample: 0,
                row: upstream.row,
            };
            let scores = Target {
                data: &mut b.scores,
                start: 0,
                sample: 0,
                row: width,
            };
            let packed = &b.values_transposed;
            multiply(
                isa,
                1,
                count,
                dim,
                rows,
                du,
                packed,
                None,
                Add::Nothing,
                scores,
            );
            let sums = &scratch.inverse_sums[..count];
            softmax_backward(isa, &mut scratch.scores, &mut b.scores, width, rows, sums);

            let matrix = |data| Operand {
                data,
                start: 0,
                sample: 0,
                row: width,
            };
            let queries = Operand {
                data: &scratch.qkv,
                start: from * 3 * dim,
                sample: 0,
                row: 3 * dim,
            };
            let to = Target {
                data: &mut b.query,
                start: from * dim,
                sample: 0,
                row: dim,
            };
            let ds = matrix(&b.scores);
            multiply(
                isa,
                1,
                count,
                rows,
                dim,
                ds,
                &scratch.values,
                None,
                Add::Nothing,
                to,
            );
            let later = from > 0;
            outer(
                isa,
                1,
                count,
                rows,
                dim,
                ds,
                queries,
                &mut b.panel,
                later,
                &mut b.key,
            );
            let p = matrix(&scratch.scores);
            outer(
                isa,
                1,
                count,
                rows,
                dim,
                p,
                du,
                &mut b.panel,
                later,
                &mut b.value,
            );
        }
        let out = &mut b.qkv[s * rows * 3 * dim..][..rows * 3 * dim];
        let factors = &scratch.query_factors[..rows];
        let x = &scratch.qkv;
        normalise_rows_backward(isa, &b.query, x, at(0), dim, QUERY_LENGTH, factors, out);
        let factors = &scratch.key_factors[..rows];
        normalise_rows_backward(isa, &b.key, x, at(dim), dim, 1.0, factors, out);
        for (row, value) in b.value.chunks_exact(dim).enumerate().take(rows) {
            out[row * 3 * dim + 2 * dim..][..dim].copy_from_slice(value);
        }
    }
}
