//! The paper's metric group (section "OOD Detection"):
//! `[sum_t <eps>_1, <eps>_2, <eps>_3, <d eps>_1, <d eps>_2, <d eps>_3]`, `<x>_p = 1/N sum_i x_i^p`.
//!
//! The paper leaves `d eps` open; here it is the difference of eps_hat between consecutive diffusion
//! steps, as in DiffPath (arXiv 2405.11881), which the statistic extends. So T steps give T - 1
//! differences.

use super::trace::{CHANNELS, StepMoments};
use super::{Column, TraceSummary};

/// A metric group: its name and the channels it pools.
pub(super) type Part = (&'static str, &'static [usize]);

const TRANSLATION_PART: Part = ("translation", &[0, 1, 2]);

/// The paper's 24: translation pooled, each rotation axis on its own.
pub(super) const SPLIT: [Part; 4] = [
    TRANSLATION_PART,
    ("rotation_x", &[3]),
    ("rotation_y", &[4]),
    ("rotation_z", &[5]),
];
/// The paper's 12 ("no split").
pub(super) const NO_SPLIT: [Part; 2] = [TRANSLATION_PART, ("rotation", &[3, 4, 5])];
/// The paper's R^3 model.
pub(super) const TRANSLATION: [Part; 1] = [TRANSLATION_PART];
/// The pose as one vector of R^6.
pub(super) const ALL: [Part; 1] = [("pose", &[0, 1, 2, 3, 4, 5])];

pub(super) fn columns(parts: &[Part]) -> Vec<Column> {
    let mut columns = Vec::new();
    for &(part, _) in parts {
        for quantity in ["eps", "deps"] {
            for power in 1..=3 {
                let name = format!("{part}.sum_{quantity}^{power}");
                columns.push(Column { part, name });
            }
        }
    }
    columns
}

pub(super) fn values(parts: &[Part], trace: &TraceSummary, out: &mut Vec<f64>) {
    for (_, axes) in parts {
        for power in 0..3 {
            out.push(sum_over_steps(trace, axes, |step| &step.eps[power]));
        }
        for power in 0..3 {
            out.push(sum_over_steps(trace, axes, |step| &step.change[power]));
        }
    }
}

/// Sum over the steps of the mean over the pooled axes. All axes have the same number of poses, so
/// the mean of their means is the pooled mean.
fn sum_over_steps(
    trace: &TraceSummary,
    axes: &[usize],
    of: impl Fn(&StepMoments) -> &[f64; CHANNELS],
) -> f64 {
    let per_step = trace.steps.iter().map(|step| {
        let means = of(step);
        axes.iter().map(|&axis| means[axis]).sum::<f64>() / axes.len() as f64
    });
    per_step.sum()
}
