//! Gradients that several chunks add to, always in the order of the chunks.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::buffer::Buffer;
use crate::linear_map::LinearMap;

/// The gradient of one map: its matrices as they act, and per output channel a bias and the
/// gain and offset of the normalisation after it.
pub(crate) struct MapGradient {
    pub(crate) matrices: Buffer,
    pub(crate) bias: Vec<f32>,
    pub(crate) gain: Vec<f32>,
    pub(crate) offset: Vec<f32>,
}

impl MapGradient {
    fn new(map: &LinearMap) -> Self {
        let vector = vec![0.0; map.outputs];
        Self {
            matrices: Buffer::zeros(map.gradient_len),
            bias: vector.clone(),
            gain: vector.clone(),
            offset: vector,
        }
    }
}

/// A [`MapGradient`] that chunk after chunk adds to.
///
/// One sum, however many threads: chunk `c` waits until chunk `c - 1` has added its part.
/// All chunks visit the maps in the same order, so they follow each other like runners one
/// map apart, and the sum's order of addition never changes.
pub(crate) struct OrderedGradient {
    next: AtomicUsize,
    sum: Mutex<MapGradient>,
}

impl OrderedGradient {
    pub(crate) fn new(map: &LinearMap) -> Self {
        Self {
            next: AtomicUsize::new(0),
            sum: Mutex::new(MapGradient::new(map)),
        }
    }

    /// Forgets the sum: chunk 0 is next and overwrites.
    pub(crate) fn restart(&mut self) {
        *self.next.get_mut() = 0;
        let sum = self.get();
        for vector in [&mut sum.bias, &mut sum.gain, &mut sum.offset] {
            vector.fill(0.0);
        }
    }

    /// The finished sum.
    pub(crate) fn get(&mut self) -> &mut MapGradient {
        self.sum.get_mut().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for `chunk`'s turn and adds its part. `None` when another chunk gave up.
    pub(crate) fn add<T>(
        &self,
        chunk: usize,
        stop: &AtomicBool,
        part: impl FnOnce(&mut MapGradient) -> T,
    ) -> Option<T> {
        let mut waited = 0u32;
        while self.next.load(Ordering::Acquire) != chunk {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            waited += 1;
            if waited < 256 {
                std::hint::spin_loop()
            } else {
                std::thread::yield_now()
            }
        }
        let mut sum: MutexGuard<'_, _> = self.sum.lock().unwrap_or_else(PoisonError::into_inner);
        let answer = part(&mut sum);
        drop(sum);
        self.next.store(chunk + 1, Ordering::Release);
        Some(answer)
    }
}
