//! A residual block, backward.

use crate::backward::Backward;
use crate::forward::{Field, apply, clear_halo};
use crate::gradient::MapGradient;
use crate::group_norm::{self, Gradients};
use crate::matmul::Add;
use crate::norm_kernels::add_assign;
use crate::ops::Block;
use crate::workspace::Workspace;

impl Backward<'_> {
    /// A stage of [`Backward::stage`]: before, between and after the gradients of the second
    /// convolution, the first, and the residual.
    pub(crate) fn block(
        &self,
        block: &Block,
        stage: usize,
        ws: &mut Workspace,
        upstream: &[f32],
        time: &mut [f32],
    ) {
        match stage {
            0 => self.through_norm2(block, ws, upstream),
            1 => {
                self.through_conv2(block, ws);
                self.through_norm1(block, ws, time);
            }
            2 => {
                self.through_conv1(block, ws);
                if block.residual.is_none() {
                    let b = &mut ws.backward;
                    self.pass(block.inputs[0], upstream, &mut b.slots, &mut b.started);
                }
            }
            _ => self.through_residual(block, ws, upstream),
        }
    }

    /// The block's part of [`Backward::add`].
    pub(crate) fn add_block(
        &self,
        block: &Block,
        number: usize,
        ws: &mut Workspace,
        upstream: &[f32],
        gradient: &mut MapGradient,
    ) {
        let network = &self.network;
        let rows = network.tensor(block.output).rows(network.length);
        let haloed = network.field(block.output, 0);
        match (number, block.residual) {
            (0, _) => {
                let b = &mut ws.backward;
                let x = (&ws.blocks[block.index].hidden[..], haloed);
                let dy = (&b.upstream[..], haloed);
                let part = &network.map(block.conv2).parts[0];
                self.weight_gradient(part, rows, x, dy, &mut b.panel, gradient);
                self.vector_gradients(&b.vectors, gradient);
            }
            (1, _) => {
                let inner = std::mem::take(&mut ws.backward.upstream);
                let dy = (&inner[..], haloed);
                self.map_gradient(block.conv1, &block.inputs, rows, ws, dy, gradient);
                ws.backward.upstream = inner;
                self.vector_gradients(&ws.backward.vectors, gradient);
            }
            (_, residual) => {
                let dy = (upstream, haloed);
                if let Some(map) = residual {
                    self.map_gradient(map, &block.inputs, rows, ws, dy, gradient);
                }
                self.bias_gradient(rows, dy, gradient);
            }
        }
    }

    /// To the gradient at the second convolution's output.
    fn through_norm2(&self, block: &Block, ws: &mut Workspace, upstream: &[f32]) {
        let network = &self.network;
        let tensor = network.tensor(block.output);
        let (rows, channels) = (tensor.rows(network.length), tensor.channels);
        let (haloed, dense) = (
            network.field(block.output, 0),
            Field::dense(rows, channels, 0),
        );
        let groups = 2 * network.plan.config.groups;
        let store = &ws.blocks[block.index];
        let b = &mut ws.backward;
        b.vectors.iter_mut().for_each(|v| v.fill(0.0));
        let [bias, gain, offset] = &mut b.vectors;
        for s in 0..self.steps.len() {
            group_norm::backward(
                network.isa,
                &network.affine(block.norm2, channels),
                &upstream[haloed.range(s, rows)],
                &store.second[dense.range(s, rows)],
                &store.statistics[(2 * s + 1) * groups..][..groups],
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
        clear_halo(tensor, network.length, self.steps.len(), &mut b.upstream);
    }

    /// To the gradient at the hidden activations.
    fn through_conv2(&self, block: &Block, ws: &mut Workspace) {
        let network = &self.network;
        let tensor = network.tensor(block.output);
        let rows = tensor.rows(network.length);
        let b = &mut ws.backward;
        apply(
            network.isa,
            network.backward,
            &network.map(block.conv2).parts[0].backward,
            self.steps.len(),
            rows,
            (&b.upstream, network.field(block.output, 0)),
            None,
            Add::Nothing,
            (&mut b.hidden, Field::dense(rows, tensor.channels, 0)),
        );
    }

    /// To the gradient at the first convolution's output, and those of scale and shift.
    fn through_norm1(&self, block: &Block, ws: &mut Workspace, time: &mut [f32]) {
        let network = &self.network;
        let tensor = network.tensor(block.output);
        let (rows, channels) = (tensor.rows(network.length), tensor.channels);
        let (haloed, dense) = (
            network.field(block.output, 0),
            Field::dense(rows, channels, 0),
        );
        let groups = 2 * network.plan.config.groups;
        let store = &ws.blocks[block.index];
        let b = &mut ws.backward;
        b.vectors.iter_mut().for_each(|v| v.fill(0.0));
        let [bias, gain, offset] = &mut b.vectors;
        for (s, &step) in self.steps.iter().enumerate() {
            let at = s * network.plan.time.columns + block.time_column;
            let (scale, shift) = time[at..at + 2 * channels].split_at_mut(channels);
            group_norm::backward(
                network.isa,
                &network.modulated(block, channels, step),
                &b.hidden[dense.range(s, rows)],
                &store.first[dense.range(s, rows)],
                &store.statistics[2 * s * groups..][..groups],
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
    }

    /// To the gradients at the block's inputs.
    fn through_conv1(&self, block: &Block, ws: &mut Workspace) {
        let b = &mut ws.backward;
        let dy = (&b.upstream[..], self.network.field(block.output, 0));
        self.input_gradients(block.conv1, &block.inputs, dy, &mut b.slots, &mut b.started);
    }

    /// Around the convolutions, where the block changes the number of channels.
    fn through_residual(&self, block: &Block, ws: &mut Workspace, upstream: &[f32]) {
        let Some(map) = block.residual else { return };
        let b = &mut ws.backward;
        let dy = (upstream, self.network.field(block.output, 0));
        self.input_gradients(map, &block.inputs, dy, &mut b.slots, &mut b.started);
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
