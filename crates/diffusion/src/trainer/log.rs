//! The training log: one row every few steps, kept with the checkpoint.

use super::Losses;
use crate::error::Error;
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;

/// Means over the steps since the row before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LogRow {
    /// Optimiser steps done.
    pub step: usize,
    /// Learning rate of the last of them.
    pub learning_rate: f64,
    /// Translation: mean L1 error of the noise.
    pub translation_eps: f64,
    /// Translation: loss on the clean window.
    pub translation_x0: f64,
    /// Rotation: mean squared geodesic error of the noise, rad^2.
    pub rotation_eps: f64,
    /// Rotation: loss on the clean window, rad^2.
    pub rotation_x0: f64,
    /// Gradient norm of the translation branch, before clipping.
    pub translation_gradient: f64,
    /// Gradient norm of the rotation branch, before clipping.
    pub rotation_gradient: f64,
    /// Translation noise loss of the averaged weights on held-out logs, where measured.
    pub translation_validation: Option<f64>,
    /// Rotation noise loss of the averaged weights on held-out logs, where measured.
    pub rotation_validation: Option<f64>,
}

/// Column names of [`to_csv`], in order.
pub const COLUMNS: [&str; 10] = [
    "step",
    "learning_rate",
    "translation_eps",
    "translation_x0",
    "rotation_eps",
    "rotation_x0",
    "translation_gradient",
    "rotation_gradient",
    "translation_validation",
    "rotation_validation",
];

/// The log as CSV, empty cells where nothing was measured.
pub fn to_csv(rows: &[LogRow]) -> String {
    let mut out = COLUMNS.join(",");
    out.push('\n');
    let cell = |v: Option<f64>| v.map(|v| format!("{v:.6}")).unwrap_or_default();
    for r in rows {
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "{},{:e},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{},{}",
            r.step,
            r.learning_rate,
            r.translation_eps,
            r.translation_x0,
            r.rotation_eps,
            r.rotation_x0,
            r.translation_gradient,
            r.rotation_gradient,
            cell(r.translation_validation),
            cell(r.rotation_validation),
        );
    }
    out
}

impl Losses {
    /// Adds those of other steps.
    pub(super) fn add(&mut self, other: &Self) {
        self.steps += other.steps;
        self.eps += other.eps;
        self.x0 += other.x0;
        self.gradient += other.gradient;
    }

    /// Checks that all is finite.
    pub(super) fn check(&self, branch: &'static str, step: usize) -> Result<(), Error> {
        finite(branch, "loss", step, self.eps + self.x0)?;
        finite(branch, "gradient", step, self.gradient)
    }
}

impl LogRow {
    /// Means of the losses of both branches.
    pub(super) fn of(step: usize, rate: f64, translation: &Losses, rotation: &Losses) -> Self {
        let n = |losses: &Losses| losses.steps.max(1) as f64;
        let (t, r) = (n(translation), n(rotation));
        Self {
            step,
            learning_rate: rate,
            translation_eps: translation.eps / t,
            translation_x0: translation.x0 / t,
            rotation_eps: rotation.eps / r,
            rotation_x0: rotation.x0 / r,
            translation_gradient: translation.gradient / t,
            rotation_gradient: rotation.gradient / r,
            ..Self::default()
        }
    }
}

/// Reports a value that is not finite as divergence.
fn finite(branch: &'static str, what: &'static str, step: usize, value: f64) -> Result<(), Error> {
    match value.is_finite() {
        true => Ok(()),
        false => Err(Error::Diverged { branch, what, step }),
    }
}
