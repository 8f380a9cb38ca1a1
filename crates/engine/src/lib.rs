#![doc = include_str!("../README.md")]
// Products have two operands, a result and their sizes.
#![allow(clippy::too_many_arguments)]

mod adam;
mod adam_kernel;
mod attention;
mod attention_backward;
mod attention_kernels;
mod backward;
mod block_backward;
mod buffer;
mod engine;
mod forward;
mod gradient;
mod group_norm;
mod linear_map;
mod math;
mod matmul;
mod norm_kernels;
mod ops;
mod plan;
mod row_moments;
mod simd;
mod slots;
mod time;
mod training;
mod turn;
mod weights;
mod workers;
mod workspace;

pub use adam::{Adam, AdamConfig};
pub use engine::{Engine, EngineOptions};
pub use simd::Instructions;
