#![doc = include_str!("../README.md")]

mod adam;
mod adam_kernel;
mod attention;
mod attention_backward;
#[allow(
    clippy::too_many_arguments,
    reason = "two operands, a result, and their sizes"
)]
mod attention_kernels;
mod backward;
mod block_backward;
mod buffer;
mod engine;
mod forward;
mod gradient;
mod group_norm;
#[allow(
    clippy::too_many_arguments,
    reason = "two operands, a result, and their sizes"
)]
mod joint;
mod linear_map;
mod math;
#[allow(
    clippy::too_many_arguments,
    reason = "two operands, a result, and their sizes"
)]
mod matmul;
#[allow(
    clippy::too_many_arguments,
    reason = "two operands, a result, and their sizes"
)]
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
pub use joint::JointEngine;
pub use simd::{Instructions, VARIABLE as INSTRUCTIONS_VARIABLE};
