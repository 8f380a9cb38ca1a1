//! Attention over the length, forward.
//!
//! Head by head and window by window: query, key and value of one head fit the first-level
//! caches, and no tensor of all heads' scores is ever made.

use crate::attention_kernels::{
    RowsAt, exponentials, normalise_rows, pack_rows, pack_transposed, scale_rows, standardise_rows,
};
use crate::forward::{Field, Network, apply};
use crate::matmul::{Add, Operand, Target, multiply};
use crate::ops::Attention;
use crate::workspace::{AttentionScratch, Workspace, group_size, query_tile};

/// The scores are `10 q . k`, and `exp(s) = 2^(s / ln 2)`: both factors go into the queries.
pub(crate) const QUERY_LENGTH: f32 = 10.0 * std::f32::consts::LOG2_E;

impl Network<'_> {
    /// `output = x + attention(x)`.
    pub(crate) fn attend(
        &self,
        attention: &Attention,
        samples: usize,
        ws: &mut Workspace,
        output: &mut [f32],
    ) {
        let tensor = self.tensor(attention.output);
        let rows = tensor.rows(self.length);
        let (dim, inner) = (
            self.plan.config.head_dim,
            self.plan.config.attention_width(),
        );
        let Workspace {
            slots,
            slot_of,
            attended,
            attention: scratch,
            training,
            ..
        } = ws;
        let attended = &mut attended[if *training { attention.index } else { 0 }];
        let x = &slots[slot_of[attention.input]];
        for first in (0..samples).step_by(group_size(rows)) {
            let count = group_size(rows).min(samples - first);
            let held = if *training { first } else { 0 };
            let to = Field::of(tensor, self.length, first);
            for s in 0..count {
                self.normalise(&x[to.range(s, rows)], tensor.channels, s, scratch);
            }
            for (head, &map) in attention.heads.iter().enumerate() {
                for s in 0..count {
                    self.head(map, s, rows, scratch);
                    let at = ((held + s) * rows * inner) + head * dim;
                    self.weigh(rows, scratch, &mut attended[at..], inner);
                }
            }
            let out = self.map(attention.out);
            apply(
                self.isa,
                self.forward,
                &out.parts[0].forward,
                count,
                rows,
                (attended, Field::dense(rows, inner, held)),
                out.bias(self.values),
                Add::Other(to.operand(x)),
                (&mut *output, to),
            );
        }
    }

    /// Layer normalisation of sample `s` of a group, without the gain (it is in the weights).
    pub(crate) fn normalise(
        &self,
        x: &[f32],
        channels: usize,
        s: usize,
        scratch: &mut AttentionScratch,
    ) {
        let rows = x.len() / channels;
        let y = &mut scratch.normalised[s * x.len()..][..x.len()];
        standardise_rows(
            self.isa,
            x,
            channels,
            y,
            &mut scratch.inverse[s * rows..][..rows],
        );
    }

    /// Query (of length `10 / ln 2`), key (of length 1) and value of one head and sample.
    pub(crate) fn head(&self, map: usize, s: usize, rows: usize, scratch: &mut AttentionScratch) {
        let map = self.map(map);
        let dim = self.plan.config.head_dim;
        apply(
            self.isa,
            self.forward,
            &map.parts[0].forward,
            1,
            rows,
            (&scratch.normalised, Field::dense(rows, map.inputs, s)),
            None,
            Add::Nothing,
            (&mut scratch.qkv, Field::dense(rows, 3 * dim, 0)),
        );
        let at = |start| RowsAt {
            start,
            row: 3 * dim,
        };
        let queries = &mut scratch.query_factors[..rows];
        normalise_rows(
            self.isa,
            &mut scratch.qkv,
            at(0),
            dim,
            QUERY_LENGTH,
            queries,
        );
        let keys = &mut scratch.key_factors[..rows];
        normalise_rows(self.isa, &mut scratch.qkv, at(dim), dim, 1.0, keys);
        pack_transposed(
            self.isa,
            &scratch.qkv,
            at(dim),
            rows,
            dim,
            &mut scratch.keys,
        );
    }

    /// Exponentials of the scores of queries `from .. from + count`, not yet divided by the
    /// sums. Scores are at most 10, so none needs its row's maximum taken off first.
    pub(crate) fn scores(
        &self,
        (from, count): (usize, usize),
        rows: usize,
        scratch: &mut AttentionScratch,
    ) {
        let dim = self.plan.config.head_dim;
        let width = rows.next_multiple_of(16);
        multiply(
            self.isa,
            1,
            count,
            dim,
            rows,
            Operand {
                data: &scratch.qkv,
                start: from * 3 * dim,
                sample: 0,
                row: 3 * dim,
            },
            &scratch.keys,
            None,
            Add::Nothing,
            Target {
                data: &mut scratch.scores,
                start: 0,
                sample: 0,
                row: width,
            },
        );
        let sums = &mut scratch.inverse_sums[..count];
        exponentials(self.isa, &mut scratch.scores, width, rows, sums);
    }

    /// The attended values of one head, into rows `row` apart.
    fn weigh(&self, rows: usize, scratch: &mut AttentionScratch, out: &mut [f32], row: usize) {
        let dim = self.plan.config.head_dim;
        let values = RowsAt {
            start: 2 * dim,
            row: 3 * dim,
        };
        pack_rows(&scratch.qkv, values, rows, dim, &mut scratch.values);
        let tile = query_tile(rows);
        for from in (0..rows).step_by(tile) {
            let count = tile.min(rows - from);
            self.scores((from, count), rows, scratch);
            multiply(
                self.isa,
                1,
                count,
                rows,
                dim,
                Operand {
                    data: &scratch.scores,
                    start: 0,
                    sample: 0,
                    row: rows.next_multiple_of(16),
                },
                &scratch.values,
                None,
                Add::Nothing,
                Target {
                    data: out,
                    start: from * row,
                    sample: 0,
                    row,
                },
            );
            let at = RowsAt {
                start: from * row,
                row,
            };
            scale_rows(self.isa, out, at, dim, &scratch.inverse_sums[..count]);
        }
    }
}
