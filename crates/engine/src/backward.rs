//! The backward pass of one chunk of samples.

use std::sync::atomic::AtomicBool;

use crate::buffer::Buffer;
use crate::forward::{Field, Network, apply};
use crate::gradient::{MapGradient, OrderedGradient};
use crate::group_norm::{self, Affine, Gradients};
use crate::linear_map::Part;
use crate::matmul::{Add, outer};
use crate::norm_kernels::{add_assign, add_column_sums};
use crate::plan::{Block, Op};
use crate::workspace::{BackwardScratch, Workspace};

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
    pub(crate) fn add(
        &self,
        map: usize,
        part: impl FnOnce(&mut MapGradient),
    ) -> Result<(), Stopped> {
        self.gradients[map]
            .add(self.chunk, self.stop, part)
            .ok_or(Stopped)
    }

    /// Adds the gradient of one part's matrices.
    pub(crate) fn weight_gradient(
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

    pub(crate) fn bias_gradient(
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
}
