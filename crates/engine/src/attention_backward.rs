//! Attention over the length, backward.

use crate::attention::QUERY_LENGTH;
use crate::attention_kernels::{
    RowsAt, normalise_rows_backward, pack_rows, pack_transposed, softmax_backward,
    standardise_rows_backward,
};
use crate::backward::{Backward, Stopped};
use crate::forward::{Field, apply};
use crate::matmul::{Add, Operand, Target, multiply, outer};
use crate::plan::Attention;
use crate::workspace::{AttentionScratch, BackwardScratch, Workspace, query_tile};

impl Backward<'_> {
    /// From the gradient at the output of an attention to those before it.
    pub(crate) fn attention(
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
