//! The DOSE3 noise estimator as a static CPU plan: forward and backward without allocation.
mod adam;
mod adam_kernel;
mod attention_kernels;
mod backward;
mod buffer;
mod engine;
mod forward;
mod gradient;
mod group_norm;
mod linear_map;
mod math;
mod matmul;
mod norm_kernels;
mod plan;
mod row_moments;
mod simd;
mod slots;
mod time;
mod weights;
mod workers;
mod workspace;

pub use adam::{Adam, AdamConfig};
pub use engine::{Engine, EngineOptions};
pub use simd::Instructions;
