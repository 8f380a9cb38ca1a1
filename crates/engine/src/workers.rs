//! A fixed number of workers that take chunks in order.

use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::atomic::{AtomicUsize, Ordering};

use dose3_model::ModelError;
use rayon::prelude::*;

/// The threads of one engine.
pub(crate) struct Workers {
    /// None for one thread, which is the caller's.
    pool: Option<rayon::ThreadPool>,
    count: usize,
}

impl Workers {
    /// `threads` of them; 0 is one per processor.
    pub(crate) fn new(threads: usize) -> Result<Self, ModelError> {
        let count = match threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        };
        let pool = match count {
            1 => None,
            _ => {
                let pool = rayon::ThreadPoolBuilder::new()
                    .num_threads(count)
                    .thread_name(|i| format!("dose3-engine-{i}"))
                    .build();
                Some(pool.map_err(|e| ModelError::Compute(format!("cannot start threads: {e}")))?)
            }
        };
        Ok(Self { pool, count })
    }

    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Calls `work` once per worker (or fewer times); each call knows its number.
    ///
    /// The calls may run one after the other, so none may wait for a later one.
    pub(crate) fn run(&self, work: &(dyn Fn(usize) + Sync)) {
        match &self.pool {
            None => work(0),
            Some(pool) => pool.install(|| split(0, self.count, work)),
        }
    }
}

impl Workers {
    /// Works through independent items.
    pub(crate) fn for_each<T: Send>(&self, items: Vec<T>, work: impl Fn(T) + Sync + Send) {
        match &self.pool {
            None => items.into_iter().for_each(work),
            // One at a time: they differ much in size.
            Some(pool) => pool.install(|| {
                items.into_par_iter().with_max_len(1).for_each(work);
            }),
        }
    }
}

thread_local! {
    /// Whether this thread of a pool is working already.
    static WORKING: Cell<bool> = const { Cell::new(false) };
}

/// Halves the workers until one is left: joins allocate nothing.
fn split(first: usize, end: usize, work: &(dyn Fn(usize) + Sync)) {
    if end - first == 1 {
        // A loss that uses rayon itself may be handed another worker's call while it waits.
        // That call would wait for the chunk it interrupts; the others do its work.
        if !WORKING.replace(true) {
            let _done = Done;
            work(first);
        }
        return;
    }
    let middle = first + (end - first) / 2;
    rayon::join(|| split(first, middle, work), || split(middle, end, work));
}

/// Ends a thread's work, even by a panic.
struct Done;

impl Drop for Done {
    fn drop(&mut self) {
        WORKING.set(false);
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
