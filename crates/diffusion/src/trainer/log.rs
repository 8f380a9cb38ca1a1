//! The training log: one row every few steps, kept with the checkpoint.

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

/// Sums over the steps of one row.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Accumulator {
    steps: usize,
    sum: LogRow,
}

impl Accumulator {
    pub(super) fn add(&mut self, row: &LogRow) {
        self.steps += 1;
        let s = &mut self.sum;
        s.step = row.step;
        s.learning_rate = row.learning_rate;
        s.translation_eps += row.translation_eps;
        s.translation_x0 += row.translation_x0;
        s.rotation_eps += row.rotation_eps;
        s.rotation_x0 += row.rotation_x0;
        s.translation_gradient += row.translation_gradient;
        s.rotation_gradient += row.rotation_gradient;
    }

    pub(super) fn take(&mut self) -> LogRow {
        let (n, mut row) = (self.steps.max(1) as f64, self.sum);
        for value in [
            &mut row.translation_eps,
            &mut row.translation_x0,
            &mut row.rotation_eps,
            &mut row.rotation_x0,
            &mut row.translation_gradient,
            &mut row.rotation_gradient,
        ] {
            *value /= n;
        }
        *self = Self::default();
        row
    }
}

/// Reports a value that is not finite as divergence.
pub(super) fn finite(
    branch: &'static str,
    what: &'static str,
    step: usize,
    value: f64,
) -> Result<f64, Error> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Error::Diverged { branch, what, step })
    }
}
