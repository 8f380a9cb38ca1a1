//! A forward pass allocates nothing once it has run with its sizes.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use dose3_model::{NoiseModel, UNetConfig};

mod support;

use support::{Batch, engine, parameters, pool};

struct Counting;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: everything is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_warm_forward_pass_allocates_nothing() {
    let config = UNetConfig::new(3, 3, 8, &[1, 2]);
    let parameters = parameters(&config, 1);
    for threads in [1, 2] {
        let mut engine = engine(&parameters);
        let batch = Batch::new(&config, 24, 64, 2);
        let mut output = vec![0.0; batch.upstream.len()];
        let count = pool(threads).install(|| {
            let mut run = || engine.forward(batch.input(), &mut output).expect("forward");
            // Either worker may take all of a batch: let both do so before counting.
            (0..20).for_each(|_| run());
            let before = ALLOCATIONS.load(Ordering::Relaxed);
            (0..20).for_each(|_| run());
            ALLOCATIONS.load(Ordering::Relaxed) - before
        });
        // The thread pool's queue takes a block of memory now and then; the engine nothing.
        let allowed = if threads == 1 { 0 } else { 4 };
        assert!(
            count <= allowed,
            "{count} allocations in 20 passes on {threads} threads"
        );
    }
}
