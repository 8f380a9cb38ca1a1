//! Platform against platform: the paper's six cells, with every row.

use super::methods::METHODS;
use super::prober::{SetRows, Spot};
use super::protocol::{LogSet, Part};
use anyhow::Result;
use dose3_ood::DetectorStatistics;
use dose3_ood::metrics::{Bootstrap, Estimate, Grouped, Metric, estimate};
use serde::Serialize;

/// AUROC of one row in one cell.
#[derive(Clone, Debug, Serialize)]
pub struct SixCell {
    /// Letter of the set that is trusted.
    pub id: char,
    /// Letter of the set that is not.
    pub ood: char,
    /// Key of the row.
    pub method: &'static str,
    /// Trusted windows that no density has seen.
    pub id_windows: usize,
    /// Windows of the other set.
    pub ood_windows: usize,
    /// AUROC, resampled over groups of logs.
    pub auroc: Estimate,
}

/// Tested windows of each set against every second window of every other set. `detectors` are
/// those of each set, method by method.
///
/// # Errors
/// A set without windows.
pub fn run(
    sets: &[LogSet],
    rows: &[SetRows],
    detectors: &[Vec<DetectorStatistics>],
    part: Part,
    bootstrap: Bootstrap,
) -> Result<Vec<SixCell>> {
    let mut cells = Vec::new();
    for (i, id) in sets.iter().enumerate() {
        let (tested, groups) = (id.tested(part), id.groups());
        for (o, ood) in sets.iter().enumerate().filter(|(o, _)| *o != i) {
            let ood_groups = ood.groups();
            for (m, detector) in detectors[i].iter().enumerate() {
                let (own, logs) = rows[i].select(m, |_, w| tested.contains(&w.trajectory));
                let (other, other_logs) = rows[o].select(m, |index, _| index % 2 == 0);
                let own = detector.window_scores(&own)?;
                let other = detector.window_scores(&other)?;
                let of = |spots: &[Spot], groups: &[usize]| -> Vec<usize> {
                    spots.iter().map(|spot| groups[spot.log]).collect()
                };
                let auroc = estimate(
                    Metric::Auroc,
                    Grouped {
                        scores: &own,
                        logs: &of(&logs, &groups),
                    },
                    Grouped {
                        scores: &other,
                        logs: &of(&other_logs, &ood_groups),
                    },
                    bootstrap,
                )?;
                cells.push(SixCell {
                    id: id.letter,
                    ood: ood.letter,
                    method: METHODS[m].key,
                    id_windows: own.len(),
                    ood_windows: other.len(),
                    auroc,
                });
            }
        }
    }
    Ok(cells)
}
