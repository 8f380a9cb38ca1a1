//! Attention over the length, backward.

use crate::attention::QUERY_LENGTH;
use crate::attention_kernels::{
    RowsAt, normalise_rows_backward, pack_rows, pack_transposed, softmax_backward,
    standardise_rows_backward,
};
use crate::backward::Backward;
use crate::forward::{Field, apply};
use crate::gradient::MapGradient;
use crate::matmul::{Add, Operand, Target, multiply, outer};
use crate::ops::Attention;
use crate::workspace::{AttentionScratch, BackwardScratch, Workspace, query_tile};

impl Backward<'_> {
    /// A stage of [`Backward::stage`]: before, between and after the gradients of the output
    /// map and those of the heads.
    pub(crate) fn attention(
        &self,
        attention: &Attention,
        stage: usize,
        ws: &mut Workspace,
        upstream: &[f32],
    ) {
        match stage {
            // The gradient at the output is all that the output map needs.
            0 => return,
            1 => self.through_output(attention, ws, upstream),
            // Head 0 is the first after the output map.
            _ => self.through_head(attention, stage - 2, ws),
        }
        let next = stage - 1;
        if next < attention.heads.len() {
            self.head(attention, next, ws);
        } else {
            self.through_normalisation(attention, ws, upstream);
        }
    }

    /// The attention's part of [`Backward::add`].
    pub(crate) fn add_attention(
        &self,
        attention: &Attention,
        number: usize,
        ws: &mut Workspace,
        upstream: &[f32],
        gradient: &mut MapGradient,
    ) {
        let network = &self.network;
        let tensor = network.tensor(attention.output);
        let (rows, channels) = (tensor.rows(network.length), tensor.channels);
        let b = &mut ws.backward;
        if number == 0 {
            let inner = network.plan.config.attention_width();
            let x = (
                &ws.attended[attention.index][..],
                Field::dense(rows, inner, 0),
            );
            let dy = (upstream, network.field(attention.output, 0));
            let part = &network.map(attention.out).parts[0];
            self.weight_gradient(part, rows, x, dy, &mut b.panel, gradient);
            self.bias_gradient(rows, dy, gradient);
        } else {
            let x = (
                &ws.attention.normalised[..],
                Field::dense(rows, channels, 0),
            );
            let dy = (&b.qkv[..], self.qkv(rows));
            let part = &network.map(attention.heads[number - 1]).parts[0];
            self.weight_gradient(part, rows, x, dy, &mut b.panel, gradient);
        }
    }

    /// Query, key and value of one head.
    fn qkv(&self, rows: usize) -> Field {
        Field::dense(rows, 3 * self.network.plan.config.head_dim, 0)
    }

    /// To the gradient of the heads' outputs; and computes their normalised input again.
    fn through_output(&self, attention: &Attention, ws: &mut Workspace, upstream: &[f32]) {
        let network = &self.network;
        let tensor = network.tensor(attention.output);
        let (rows, channels) = (tensor.rows(network.length), tensor.channels);
        let haloed = network.field(attention.output, 0);
        let attended = Field::dense(rows, network.plan.config.attention_width(), 0);
        let samples = self.steps.len();
        apply(
            network.isa,
            network.backward,
            &network.map(attention.out).parts[0].backward,
            samples,
            rows,
            (upstream, haloed),
            None,
            Add::Nothing,
            (&mut ws.backward.attended, attended),
        );
        let x = &ws.slots[ws.slot_of[attention.input]];
        for s in 0..samples {
            network.normalise(&x[haloed.range(s, rows)], channels, s, &mut ws.attention);
        }
    }

    /// To the gradients of a head's query, key and value.
    fn head(&self, attention: &Attention, head: usize, ws: &mut Workspace) {
        let config = &self.network.plan.config;
        let (dim, inner) = (config.head_dim, config.attention_width());
        let rows = self
            .network
            .tensor(attention.output)
            .rows(self.network.length);
        let scratch = &mut ws.attention;
        for s in 0..self.steps.len() {
            self.network.head(attention.heads[head], s, rows, scratch);
            let at = RowsAt {
                start: s * rows * inner + head * dim,
                row: inner,
            };
            self.head_sample(rows, s, at, scratch, &mut ws.backward);
        }
    }

    /// From there to the gradient of the normalised input, to which every head adds.
    fn through_head(&self, attention: &Attention, head: usize, ws: &mut Workspace) {
        let network = &self.network;
        let tensor = network.tensor(attention.output);
        let rows = tensor.rows(network.length);
        let b = &mut ws.backward;
        let add = if head > 0 { Add::Target } else { Add::Nothing };
        apply(
            network.isa,
            network.backward,
            &network.map(attention.heads[head]).parts[0].backward,
            self.steps.len(),
            rows,
            (&b.qkv, self.qkv(rows)),
            None,
            add,
            (&mut b.normalised, Field::dense(rows, tensor.channels, 0)),
        );
    }

    /// To the gradient at the attention's input, past the heads and through them.
    fn through_normalisation(&self, attention: &Attention, ws: &mut Workspace, upstream: &[f32]) {
        let network = &self.network;
        let tensor = network.tensor(attention.output);
        let (rows, channels) = (tensor.rows(network.length), tensor.channels);
        let haloed = network.field(attention.output, 0);
        let normalised = Field::dense(rows, channels, 0);
        let b = &mut ws.backward;
        let scratch = &ws.attention;
        self.pass(attention.input, upstream, &mut b.slots, &mut b.started);
        let dx = &mut b.slots[network.plan.gradients.of[attention.input]];
        for s in 0..self.steps.len() {
            let range = normalised.range(s, rows);
            standardise_rows_backward(
                network.isa,
                &b.normalised[range.clone()],
                &scratch.normalised[range],
                &scratch.inverse[s * rows..][..rows],
                channels,
                &mut dx[haloed.range(s, rows)],
            );
        }
    }

    /// Backward through one head of one sample: from the gradient of the attended values (at
    /// `upstream` in the attended gradient) to that of query, key and value before their
    /// normalisation. Scores are computed again rather than kept.
    fn head_sample(
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
