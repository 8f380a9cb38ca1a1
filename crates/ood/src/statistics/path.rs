//! DiffPath's one-dimensional statistic (Heng et al. 2024, arXiv 2405.11881): how far the estimate
//! moves along the diffusion steps.

use super::{Column, TraceSummary};

pub(super) fn column() -> Column {
    Column {
        part: "pose",
        name: "pose.root_sum_square_deps".to_owned(),
    }
}

/// `sqrt(sum_t || eps_hat_t - eps_hat_(t-1) ||^2)`, the norm over all poses and channels.
pub(super) fn change_norm(trace: &TraceSummary) -> f64 {
    let squares = trace.steps.iter().flat_map(|step| step.change[1]);
    // The moments are means over poses.
    (squares.sum::<f64>() * trace.length as f64).sqrt()
}
