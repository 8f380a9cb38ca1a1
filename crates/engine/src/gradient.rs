//! Gradients that several chunks add to.

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

/// A [`MapGradient`] that chunk after chunk adds to: one sum, however many threads.
///
/// [`Turn`](crate::turn::Turn) says whose turn it is, so that nobody ever waits for the lock.
pub(crate) struct SharedGradient {
    sum: Mutex<MapGradient>,
}

impl SharedGradient {
    pub(crate) fn new(map: &LinearMap) -> Self {
        Self {
            sum: Mutex::new(MapGradient::new(map)),
        }
    }

    /// Forgets the sum of the vectors; chunk 0 overwrites that of the matrices.
    pub(crate) fn restart(&mut self) {
        let sum = self.get();
        for vector in [&mut sum.bias, &mut sum.gain, &mut sum.offset] {
            vector.fill(0.0);
        }
    }

    /// The sum, for the chunk whose turn it is.
    pub(crate) fn lock(&self) -> MutexGuard<'_, MapGradient> {
        self.sum.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The finished sum.
    pub(crate) fn get(&mut self) -> &mut MapGradient {
        self.sum.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}
