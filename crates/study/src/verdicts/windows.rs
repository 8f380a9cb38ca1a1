//! Windows with a fault against the same places without it: AUROC.

use super::fold::FoldFit;
use super::table::Measurer;
use crate::faults::windows::{CUT, FAULT, Site, centred};
use anyhow::Result;
use dose3_datasets::faults::Fault;
use dose3_datasets::{Trajectory, Window};
use dose3_ood::metrics::auroc;
use serde::Serialize;

/// A fault that some contender tells from sound motion at this AUROC can be detected.
pub const DETECTABLE: f64 = 0.8;

/// One contender on one fault in one set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaultCell {
    /// Letter of the set.
    pub set: char,
    /// Key of the contender.
    pub contender: &'static str,
    /// Which list the fault is of.
    pub list: &'static str,
    /// The fault.
    pub fault: String,
    /// Windows a side.
    pub windows: usize,
    /// Faulty windows against sound ones.
    pub auroc: f64,
}

/// All faults at all sites.
///
/// # Errors
/// A failing network, a fault that cannot be injected.
pub fn run(
    set: char,
    (logs, sites): (&[Trajectory], &[Site]),
    faults: &[(&'static str, Fault)],
    fit: &FoldFit,
    seed: u64,
    measurer: &mut Measurer,
) -> Result<Vec<FaultCell>> {
    let cuts: Vec<Trajectory> = sites
        .iter()
        .map(|site| logs[site.log].cut(site.start..site.start + CUT))
        .collect();
    let mut cells = Vec::new();
    let middle = FAULT.start.midpoint(FAULT.end);
    let sound = scores(&cuts, &vec![middle; cuts.len()], fit, measurer)?;
    for (list, fault) in faults {
        let (mut faulty, mut middles) = (Vec::new(), Vec::new());
        for (i, cut) in cuts.iter().enumerate() {
            let seed = seed.wrapping_mul(1_000_003).wrapping_add(i as u64);
            let injection = fault.inject(cut, FAULT, seed)?;
            let affected = &injection.affected;
            middles.push(if affected.is_empty() {
                middle
            } else {
                affected.start.midpoint(affected.end)
            });
            faulty.push(injection.trajectory);
        }
        let found = scores(&faulty, &middles, fit, measurer)?;
        for (i, (contender, _)) in fit.fitted.iter().enumerate() {
            if found[i].is_empty() {
                continue;
            }
            cells.push(FaultCell {
                set,
                contender: contender.key,
                list,
                fault: fault.label(),
                windows: found[i].len(),
                auroc: auroc(&sound[i], &found[i])?,
            });
        }
    }
    Ok(cells)
}

/// Scores of the window of each log around its middle, contender by contender.
fn scores(
    logs: &[Trajectory],
    middles: &[usize],
    fit: &FoldFit,
    measurer: &mut Measurer,
) -> Result<Vec<Vec<dose3_ood::Score>>> {
    let windows: Vec<Window> = logs
        .iter()
        .zip(middles)
        .enumerate()
        .filter(|(_, (log, _))| log.len() >= measurer.poses)
        .map(|(trajectory, (log, middle))| Window {
            trajectory,
            start: centred(*middle, measurer.poses, log.len()),
            length: measurer.poses,
        })
        .collect();
    let table = measurer.measure(logs, &windows)?;
    let all: Vec<usize> = (0..windows.len()).collect();
    fit.fitted
        .iter()
        .map(|(contender, fitted)| {
            let rows = measurer.rows(&table, &all, &contender.set()?, |_| fit.linear.all())?;
            fitted.scores(&rows)
        })
        .collect()
}
