//! The DOSE3 noise estimator as a static CPU plan: forward and backward without allocation.
mod adam;

pub use adam::{Adam, AdamConfig};
