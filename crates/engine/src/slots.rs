//! Which tensors may share a buffer.

use crate::ops::{Op, Tensor};

/// From the first to the last step at which a tensor is needed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lifetime {
    tensor: usize,
    birth: usize,
    death: usize,
}

/// The lifetimes of all tensors, or with `backward` those of their gradients, by birth.
pub(crate) fn assign(ops: &[Op], tensors: usize, backward: bool) -> Vec<Lifetime> {
    let mut lives: Vec<Option<Lifetime>> = vec![None; tensors];
    let mut touch = |tensor: usize, step: usize| {
        let life = lives[tensor].get_or_insert(Lifetime {
            tensor,
            birth: step,
            death: step,
        });
        life.death = step;
    };
    let count = ops.len();
    for step in 0..count {
        let op = &ops[if backward { count - 1 - step } else { step }];
        for &input in op.inputs() {
            touch(input, step);
        }
        touch(op.output(), step);
    }
    // The output is read after the last operation, its gradient written before the first.
    let mut lives: Vec<Lifetime> = lives.into_iter().flatten().collect();
    lives.sort_by_key(|life| (life.birth, life.tensor));
    lives
}

/// A buffer for every tensor; tensors that never live together may have the same.
#[derive(Clone, Debug)]
pub(crate) struct Slots {
    /// Buffer of each tensor.
    pub(crate) of: Vec<usize>,
    /// Number of buffers.
    pub(crate) count: usize,
}

impl Slots {
    /// Every tensor its own.
    pub(crate) fn separate(tensors: usize) -> Self {
        Self {
            of: (0..tensors).collect(),
            count: tensors,
        }
    }

    /// Shares by lifetimes, sorted by birth.
    pub(crate) fn new(lives: &[Lifetime], tensors: &[Tensor]) -> Self {
        // (busy until, size per sample of a long window)
        let mut slots: Vec<(usize, usize)> = Vec::new();
        let mut of = vec![0; tensors.len()];
        for life in lives {
            let size = tensors[life.tensor].size(1 << 12);
            let free = slots
                .iter_mut()
                .enumerate()
                .filter(|(_, slot)| slot.0 < life.birth);
            // The one whose size is nearest.
            let best = free.min_by_key(|(_, slot)| slot.1.abs_diff(size));
            let index = match best {
                Some((index, slot)) => {
                    *slot = (life.death, slot.1.max(size));
                    index
                }
                None => {
                    slots.push((life.death, size));
                    slots.len() - 1
                }
            };
            of[life.tensor] = index;
        }
        Self {
            of,
            count: slots.len(),
        }
    }
}
