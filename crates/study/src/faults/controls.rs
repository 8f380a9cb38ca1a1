//! Changes of a sound log that must stay in distribution.

use super::methods::METHODS;
use super::prober::{Prober, SetRows};
use super::protocol::{LogSet, Part};
use super::windows::Context;
use anyhow::Result;
use dose3_datasets::faults::Control;
use dose3_datasets::{at_rate, windows as cut_windows};
use dose3_ood::Score;
use dose3_ood::metrics::{auroc, detection_rate};
use serde::Serialize;

/// One row on one control in one set.
#[derive(Clone, Debug, Serialize)]
pub struct ControlCell {
    /// Letter of the set.
    pub set: char,
    /// The control.
    pub control: String,
    /// Key of the row.
    pub method: &'static str,
    /// Windows of the changed logs.
    pub windows: usize,
    /// Changed windows against those they are compared with.
    pub auroc: f64,
    /// Share of changed windows beyond the window threshold.
    pub beyond: f64,
}

/// Name of the control that is the sound test log itself.
pub const OTHER_LOG: &str = "another log";

/// The tested logs themselves against held-out windows of the trusted ones, and the tested logs
/// changed against themselves.
///
/// # Errors
/// A failing network.
pub fn run(
    set: &LogSet,
    rows: &SetRows,
    part: Part,
    methods: &[usize],
    stride: usize,
    context: &Context<'_>,
    prober: &mut Prober,
) -> Result<Vec<ControlCell>> {
    let tested = set.tested(part);
    let hertz = set.logs[tested[0]].rate.hertz;
    let mut cells = Vec::new();
    let mut sound: Vec<Vec<Score>> = vec![Vec::new(); METHODS.len()];
    for &m in methods {
        let (own, _) = rows.select(m, |_, w| tested.contains(&w.trajectory));
        sound[m] = context.detectors[m].window_scores(&own)?;
        let trusted = context.detectors[m].calibration().windows.scores();
        cells.push(cell(set, OTHER_LOG, m, trusted, &sound[m], context)?);
    }
    for control in Control::ALL {
        let mut changed = Vec::new();
        for &log in &tested {
            // Sampling again at its own rate, a log that is not interpolated to the model's would
            // become a smoother one: only faster logs tell whether the phase matters.
            let faster = set.raw[log].rate.hertz > 1.5 * hertz;
            if control == Control::Resample && !faster {
                continue;
            }
            let seed = context.seed.wrapping_add(log as u64);
            changed.push(at_rate(&control.apply(&set.raw[log], seed)?, hertz)?);
        }
        if changed.is_empty() {
            continue;
        }
        let windows = cut_windows(&changed, prober.poses, stride);
        let rows = prober.rows(&changed, &windows, methods, context.tick)?;
        for &m in methods {
            let scores = context.detectors[m].window_scores(&rows[m])?;
            cells.push(cell(set, control.name(), m, &sound[m], &scores, context)?);
        }
    }
    Ok(cells)
}

fn cell(
    set: &LogSet,
    control: &str,
    method: usize,
    id: &[Score],
    changed: &[Score],
    context: &Context<'_>,
) -> Result<ControlCell> {
    let threshold = context.detectors[method].calibration().threshold;
    Ok(ControlCell {
        set: set.letter,
        control: control.to_owned(),
        method: METHODS[method].key,
        windows: changed.len(),
        auroc: auroc(id, changed)?,
        beyond: detection_rate(changed, threshold)?,
    })
}
