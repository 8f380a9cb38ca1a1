//! Work that is shared among the threads of rayon's current pool.
//!
//! Tasks here never wait for each other: in a pool that steals work, the task waited for may
//! lie suspended below the one that waits, on the same stack.

use std::marker::PhantomData;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// How many threads may work at once.
#[derive(Clone, Copy)]
pub(crate) struct Workers {
    /// 0 for all of the current pool.
    most: usize,
}

impl Workers {
    /// `most` of the current pool's threads; 0 for all of them.
    pub(crate) fn new(most: usize) -> Self {
        Self { most }
    }

    /// Threads of the pool that is current now. One does without a pool.
    pub(crate) fn count(self) -> usize {
        match self.most {
            1 => 1,
            0 => rayon::current_num_threads(),
            most => most.min(rayon::current_num_threads()),
        }
    }

    /// Works through independent items, in order, one at a time: they differ much in size.
    pub(crate) fn for_each<T: Send>(self, items: Vec<T>, work: impl Fn(T) + Sync + Send) {
        let mut workers = vec![(); self.count().min(items.len())];
        let items = Mutex::new(items.into_iter());
        // Locked to take an item, not while it is worked on.
        let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
        run(&mut workers, &|()| {
            while let Some(item) = next() {
                work(item);
            }
        });
    }
}

/// Calls `work` once with each worker's own memory. Allocates nothing.
///
/// The calls may run one after the other, so none may wait for another.
pub(crate) fn run<M: Send>(workers: &mut [M], work: &(dyn Fn(&mut M) + Sync)) {
    match workers {
        [] => {}
        [one] => work(one),
        more => {
            let (left, right) = more.split_at_mut(more.len() / 2);
            rayon::join(|| run(left, work), || run(right, work));
        }
    }
}

/// The workers' own memory from one call to the next.
pub(crate) struct Kept<M> {
    pub(crate) scoring: Vec<M>,
    pub(crate) training: Vec<M>,
}

impl<M> Kept<M> {
    pub(crate) fn new() -> Self {
        Self {
            scoring: Vec::new(),
            training: Vec::new(),
        }
    }

    /// Takes out all of one kind, of which there are at least `count` then. A panic (of the loss) loses them, and the
    /// next call begins with new ones.
    pub(crate) fn take(&mut self, training: bool, count: usize, new: impl FnMut() -> M) -> Vec<M> {
        let kept = match training {
            true => &mut self.training,
            false => &mut self.scoring,
        };
        let mut taken = std::mem::take(kept);
        if taken.len() < count {
            taken.resize_with(count, new);
        }
        taken
    }
}

/// Hands out the pieces of some slices, in order, each once.
pub(crate) struct Pieces<'a, const N: usize> {
    next: AtomicUsize,
    count: usize,
    slices: [(*mut f32, usize, usize); N],
    owner: PhantomData<&'a mut [f32]>,
}

// SAFETY: the slices are only reached through `take`, which gives every piece to one caller.
unsafe impl<const N: usize> Sync for Pieces<'_, N> {}

impl<'a, const N: usize> Pieces<'a, N> {
    /// Cuts each slice into `count` pieces of the size beside it; the last one may be shorter.
    pub(crate) fn new(count: usize, slices: [(&'a mut [f32], usize); N]) -> Self {
        let slices = slices.map(|(slice, size)| (slice.as_mut_ptr(), slice.len(), size));
        Self {
            next: AtomicUsize::new(0),
            count,
            slices,
            owner: PhantomData,
        }
    }

    /// The next piece of every slice, with its number.
    pub(crate) fn take(&self) -> Option<(usize, [&'a mut [f32]; N])> {
        let index = self.next.fetch_add(1, Ordering::Relaxed);
        if index >= self.count {
            return None;
        }
        let pieces = self.slices.map(|(data, len, size)| {
            let start = (index * size).min(len);
            let end = (start + size).min(len);
            // SAFETY: within the slice, which is borrowed for 'a; no two indices overlap and
            // the counter gives each index once.
            unsafe { std::slice::from_raw_parts_mut(data.add(start), end - start) }
        });
        Some((index, pieces))
    }
}
