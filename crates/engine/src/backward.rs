//! The backward pass of one chunk of samples.

use crate::buffer::Buffer;
use crate::forward::{Field, Network, apply};
use crate::gradient::MapGradient;
use crate::linear_map::Part;
use crate::matmul::{Add, outer};
use crate::norm_kernels::{add_assign, add_column_sums};
use crate::ops::Op;
use crate::workspace::{BackwardScratch, Workspace};

/// A chunk on its way back.
///
/// An operation goes in stages, between which it adds to the gradients of its maps: after
/// stage `k` to that of the `k`-th of [`Op::maps_backward`], which it may only do when the chunk
/// before it has. What later stages need is in the workspace, so that a chunk may be laid
/// aside after any stage.
#[derive(Clone, Copy)]
pub(crate) struct Backward<'a> {
    pub(crate) network: Network<'a>,
    /// Number of the chunk in the batch.
    pub(crate) chunk: usize,
    /// Row of the time table, per sample.
    pub(crate) steps: &'a [usize],
}

impl Backward<'_> {
    /// Begins with the gradient at the output (in the workspace).
    pub(crate) fn start(&self, ws: &mut Workspace) {
        ws.backward.started.fill(false);
        self.seed(ws);
    }

    /// Computes a stage. `time` gets the gradient at every sample's scales and shifts,
    /// `[samples, columns]`.
    pub(crate) fn stage(&self, op: &Op, stage: usize, ws: &mut Workspace, time: &mut [f32]) {
        let slot = self.network.plan.gradients.of[op.output()];
        let upstream = std::mem::take(&mut ws.backward.slots[slot]);
        match op {
            Op::Map { input, output, map } => {
                // Nothing asks for the gradient at the network's input.
                if stage > 0 && *input != 0 {
                    let dy = (&upstream[..], self.network.field(*output, 0));
                    let b = &mut ws.backward;
                    self.input_gradients(*map, &[*input], dy, &mut b.slots, &mut b.started);
                }
            }
            Op::Block(block) => self.block(block, stage, ws, &upstream, time),
            Op::Attention(attention) => self.attention(attention, stage, ws, &upstream),
        }
        ws.backward.slots[slot] = upstream;
    }

    /// Adds this chunk's part to the gradient of the `number`-th of [`Op::maps_backward`].
    pub(crate) fn add(
        &self,
        op: &Op,
        number: usize,
        ws: &mut Workspace,
        gradient: &mut MapGradient,
    ) {
        let slot = self.network.plan.gradients.of[op.output()];
        let upstream = std::mem::take(&mut ws.backward.slots[slot]);
        match op {
            Op::Map { map, input, output } => {
                let rows = self.network.tensor(*output).rows(self.network.length);
                let dy = (&upstream[..], self.network.field(*output, 0));
                self.map_gradient(*map, &[*input], rows, ws, dy, gradient);
                self.bias_gradient(rows, dy, gradient);
            }
            Op::Block(block) => self.add_block(block, number, ws, &upstream, gradient),
            Op::Attention(attention) => {
                self.add_attention(attention, number, ws, &upstream, gradient);
            }
        }
        ws.backward.slots[slot] = upstream;
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

    /// Adds the gradient of a map's matrices, each part of which reads a tensor of its own.
    pub(crate) fn map_gradient(
        &self,
        map: usize,
        inputs: &[usize],
        rows: usize,
        ws: &mut Workspace,
        dy: (&[f32], Field),
        gradient: &mut MapGradient,
    ) {
        let network = &self.network;
        let panel = &mut ws.backward.panel;
        for (part, &input) in network.map(map).parts.iter().zip(inputs) {
            let x = (&ws.slots[ws.slot_of[input]][..], network.field(input, 0));
            self.weight_gradient(part, rows, x, dy, panel, gradient);
        }
    }

    /// Adds the gradient of one part's matrices.
    pub(crate) fn weight_gradient(
        &self,
        part: &Part,
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
                self.steps.len(),
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

    pub(crate) fn bias_gradient(
        &self,
        rows: usize,
        dy: (&[f32], Field),
        gradient: &mut MapGradient,
    ) {
        let (isa, count) = (self.network.isa, gradient.bias.len());
        for s in 0..self.steps.len() {
            add_column_sums(isa, &dy.0[dy.1.range(s, rows)], count, &mut gradient.bias);
        }
    }

    /// Adds to (or begins) the gradients of the tensors that a map's parts read.
    pub(crate) fn input_gradients(
        &self,
        map: usize,
        inputs: &[usize],
        dy: (&[f32], Field),
        slots: &mut [Buffer],
        started: &mut [bool],
    ) {
        let network = &self.network;
        for (part, &tensor) in network.map(map).parts.iter().zip(inputs) {
            let add = if started[tensor] {
                Add::Target
            } else {
                Add::Nothing
            };
            let to = &mut slots[network.plan.gradients.of[tensor]][..];
            apply(
                network.isa,
                network.backward,
                &part.backward,
                self.steps.len(),
                network.tensor(tensor).rows(network.length),
                dy,
                None,
                add,
                (to, network.field(tensor, 0)),
            );
            self.finish(tensor, slots, started);
        }
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
    pub(crate) fn pass(
        &self,
        tensor: usize,
        upstream: &[f32],
        slots: &mut [Buffer],
        started: &mut [bool],
    ) {
        let size = self.network.tensor(tensor).size(self.network.length) * self.steps.len();
        let to = &mut slots[self.network.plan.gradients.of[tensor]][..size];
        if started[tensor] {
            add_assign(self.network.isa, &upstream[..size], to);
        } else {
            to.copy_from_slice(&upstream[..size]);
            started[tensor] = true;
        }
    }
}
