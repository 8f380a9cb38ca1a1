//! The memory of one worker.

use crate::buffer::Buffer;
use crate::group_norm;
use crate::matmul::{PANEL, packed_len};
use crate::ops::Op;
use crate::plan::Plan;
use crate::slots::Slots;

/// Queries whose scores are held at once: about this many numbers.
const SCORES: usize = 8192;
/// Rows a block or attention works on at once, so that its intermediates stay in the cache.
const ROWS: usize = 128;

/// Samples that an operation on `rows` rows per sample takes together.
pub(crate) fn group_size(rows: usize) -> usize {
    (ROWS / rows).max(1)
}

/// Queries whose scores over `rows` keys are held at once.
pub(crate) fn query_tile(rows: usize) -> usize {
    (SCORES / rows.next_multiple_of(16)).clamp(8, 64)
}

/// What a block leaves for its backward pass; per sample.
#[derive(Default)]
pub(crate) struct BlockStore {
    /// Output of the first convolution, `[rows, channels]`.
    pub(crate) first: Buffer,
    /// Input of the second, with halo.
    pub(crate) hidden: Buffer,
    /// Output of the second convolution.
    pub(crate) second: Buffer,
    /// Mean and inverse deviation per group of both normalisations: `[2, groups, 2]`.
    pub(crate) statistics: Buffer,
}

/// Buffers for one chunk of samples. Sized once per (length, samples); nothing is allocated
/// while computing.
pub(crate) struct Workspace {
    /// Whether intermediates are kept for a backward pass.
    pub(crate) training: bool,
    /// The buffer of each tensor.
    pub(crate) slot_of: Vec<usize>,
    pub(crate) slots: Vec<Buffer>,
    /// One per block when training, else one for all.
    pub(crate) blocks: Vec<BlockStore>,
    /// Heads' outputs `[samples, rows, heads * dim]`: one per attention when training.
    pub(crate) attended: Vec<Buffer>,
    pub(crate) norm: group_norm::Scratch,
    pub(crate) attention: AttentionScratch,
    pub(crate) backward: BackwardScratch,
    /// Length and samples that the buffers hold.
    sized: (usize, usize),
}

/// Scratch of an attention.
#[derive(Default)]
pub(crate) struct AttentionScratch {
    /// Normalised input of a group of samples, and each row's inverse deviation.
    pub(crate) normalised: Buffer,
    pub(crate) inverse: Buffer,
    /// Query, key and value of one head and sample: `[rows, 3 * dim]`.
    pub(crate) qkv: Buffer,
    /// Lengths' factors of the queries and keys, per row.
    pub(crate) query_factors: Buffer,
    pub(crate) key_factors: Buffer,
    /// Right sides, packed.
    pub(crate) keys: Buffer,
    pub(crate) values: Buffer,
    /// `[queries, rows]`.
    pub(crate) scores: Buffer,
    pub(crate) inverse_sums: Buffer,
}

/// Scratch of the backward pass.
#[derive(Default)]
pub(crate) struct BackwardScratch {
    /// Gradients of the tensors.
    pub(crate) slots: Vec<Buffer>,
    /// Whether a tensor's gradient holds something already.
    pub(crate) started: Vec<bool>,
    /// Gradient at a convolution's output, with halo.
    pub(crate) upstream: Buffer,
    /// Gradient at a block's hidden activations.
    pub(crate) hidden: Buffer,
    /// `[rows, channels]` of one sample.
    pub(crate) sample: Buffer,
    /// Panel of an outer product.
    pub(crate) panel: Buffer,
    /// Sums of a normalisation's parameter gradients: bias, gain, offset.
    pub(crate) vectors: [Vec<f32>; 3],
    /// Gradient of the heads' outputs, `[samples, rows, heads * dim]`.
    pub(crate) attended: Buffer,
    /// Gradient of the normalised input of an attention.
    pub(crate) normalised: Buffer,
    /// Gradient of query, key and value of one head: `[samples, rows, 3 * dim]`.
    pub(crate) qkv: Buffer,
    /// Gradients of one head's queries, keys and values of one sample: `[rows, dim]`.
    pub(crate) query: Buffer,
    pub(crate) key: Buffer,
    pub(crate) value: Buffer,
    /// Values of one head as a transposed right side.
    pub(crate) values_transposed: Buffer,
    /// Gradient of the scores.
    pub(crate) scores: Buffer,
    /// The network's output and the gradient there, `[samples, length, channels]`.
    pub(crate) output: Buffer,
    pub(crate) output_gradient: Buffer,
}

impl Workspace {
    pub(crate) fn new(plan: &Plan, training: bool) -> Self {
        let slots = match training {
            true => Slots::separate(plan.tensors.len()),
            false => plan.inference.clone(),
        };
        let per = |count: usize| if training { count } else { 1 };
        let widest = plan.widest();
        Self {
            training,
            slots: vec![Buffer::default(); slots.count],
            slot_of: slots.of,
            blocks: (0..per(plan.blocks))
                .map(|_| BlockStore::default())
                .collect(),
            attended: vec![Buffer::default(); per(plan.attentions)],
            norm: group_norm::Scratch::new(widest),
            attention: AttentionScratch::default(),
            backward: BackwardScratch {
                slots: vec![Buffer::default(); if training { plan.gradients.count } else { 0 }],
                started: vec![false; plan.tensors.len()],
                vectors: std::array::from_fn(|_| vec![0.0; widest]),
                ..BackwardScratch::default()
            },
            sized: (0, 0),
        }
    }

    /// Makes room for chunks of up to `samples` windows of `length`.
    pub(crate) fn size(&mut self, plan: &Plan, length: usize, samples: usize) {
        if self.sized.0 == length && self.sized.1 >= samples {
            return;
        }
        self.sized = (length, samples);
        for (tensor, &slot) in plan.tensors.iter().zip(&self.slot_of) {
            self.slots[slot].grow(samples * tensor.size(length));
        }
        for op in &plan.ops {
            let output = plan.tensors[op.output()];
            let rows = output.rows(length);
            let (channels, haloed) = (output.channels, output.size(length));
            let group = group_size(rows).min(samples);
            let held = if self.training { samples } else { group };
            match op {
                Op::Map { .. } => {}
                Op::Block(block) => {
                    let store = &mut self.blocks[if self.training { block.index } else { 0 }];
                    store.first.grow(held * rows * channels);
                    store.hidden.grow(held * haloed);
                    store.second.grow(held * rows * channels);
                    store.statistics.grow(held * 4 * plan.config.groups);
                }
                Op::Attention(attention) => {
                    let inner = plan.config.attention_width();
                    let at = if self.training { attention.index } else { 0 };
                    self.attended[at].grow(held * rows * inner);
                    let normalised = held * rows * channels;
                    self.attention.size(plan, rows, held, normalised);
                    if self.training {
                        self.backward.size_attention(plan, rows, samples, channels);
                    }
                }
            }
            if self.training {
                let b = &mut self.backward;
                b.upstream.grow(samples * haloed);
                b.hidden.grow(samples * rows * channels);
                b.sample.grow(rows * channels);
                b.panel.grow(samples * rows * PANEL);
            }
        }
        if self.training {
            let b = &mut self.backward;
            for (tensor, &slot) in plan.tensors.iter().zip(&plan.gradients.of) {
                b.slots[slot].grow(samples * tensor.size(length));
            }
            b.output.grow(samples * length * plan.config.out_channels);
            b.output_gradient
                .grow(samples * length * plan.config.out_channels);
        }
    }
}

impl AttentionScratch {
    fn size(&mut self, plan: &Plan, rows: usize, samples: usize, normalised: usize) {
        let dim = plan.config.head_dim;
        self.normalised.grow(normalised);
        self.inverse.grow(samples * rows);
        self.qkv.grow(rows * 3 * dim);
        self.query_factors.grow(rows);
        self.key_factors.grow(rows);
        self.keys.grow(packed_len(dim, rows));
        self.values.grow(packed_len(rows, dim));
        self.scores
            .grow(query_tile(rows) * rows.next_multiple_of(16));
        self.inverse_sums.grow(query_tile(rows));
    }
}

impl BackwardScratch {
    fn size_attention(&mut self, plan: &Plan, rows: usize, samples: usize, channels: usize) {
        let dim = plan.config.head_dim;
        self.attended
            .grow(samples * rows * plan.config.attention_width());
        self.normalised.grow(samples * rows * channels);
        self.qkv.grow(samples * rows * 3 * dim);
        self.query.grow(rows * dim);
        self.key.grow(rows * dim);
        self.value.grow(rows * dim);
        self.values_transposed.grow(packed_len(dim, rows));
        self.scores
            .grow(query_tile(rows) * rows.next_multiple_of(16));
        // An outer product of a tile of queries.
        self.panel.grow(query_tile(rows) * PANEL);
    }
}
