//! Diffusion over SE(3) pose sequences: noise schedules, the forward process, `x0_hat`, the
//! posterior mean, ancestral sampling, the losses of the paper's Algorithm 1, and a trainer that
//! resumes to the bit.
//!
//! Positions diffuse in Euclidean space, rotations on SO(3). A window enters as f32 tensors
//! (`[length, 3]` translations, `[length, 9]` row-major rotation matrices); all arithmetic on
//! the group is done in f64. Networks are seen through [`dose3_model::NoiseModel`] alone.
//!
//! ```
//! use dose3_diffusion::{Estimate, Noise, Process, ProcessConfig, RotationNoise, Window};
//! use rand::SeedableRng;
//!
//! let process = Process::new(ProcessConfig::default())?;
//! let rotation: Vec<f32> = (0..64).flat_map(|_| [1., 0., 0., 0., 1., 0., 0., 0., 1.]).collect();
//! let window = Window { translation: &[0.5; 64 * 3], rotation: &rotation };
//! let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(0);
//! let noise = Noise::draw(&mut rng, 64, RotationNoise::Tangent);
//!
//! // The true noise takes the noised window back to the clean one.
//! let noised = process.forward(window, &noise, 10)?;
//! let truth = Estimate { translation: &noise.translation, rotation: &noise.rotation };
//! let back = process.x0_hat(noised.as_window(), truth, 10)?;
//! assert!((back.translation[0] - 0.5).abs() < 1e-5);
//! # Ok::<(), dose3_diffusion::Error>(())
//! ```

#[cfg(feature = "burn")]
pub mod device;
mod error;
pub mod joint;
mod loss;
mod probe;
mod process;
mod sampler;
mod schedule;
pub mod trainer;
mod window;

pub use error::Error;
pub use loss::{LossConfig, SampleLoss, geodesic_loss};
pub use probe::{Branches, ModelPair, NoiseSharing, ProbePlan, Traces, trace};
pub use process::{
    Estimate, Process, ProcessConfig, RotationProcess, State, rotation_logs, rotation_tangents,
};
pub use sampler::{SampleConfig, sample};
pub use schedule::{NoiseSchedule, Schedule};
pub use window::{Noise, RotationNoise, Window};
