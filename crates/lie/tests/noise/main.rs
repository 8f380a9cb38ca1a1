//! The two noise distributions on SO(3): their densities against exact formulas, their samples against
//! their densities.

mod density;
mod kolmogorov_smirnov;
mod sampling;
mod wrapped_normal;
