//! Example logs in their plane of motion, every pose in the colour of its score.

mod drawing;
mod scale;
mod scored;

use super::select::{check, network};
use super::{Figure, FigureInput};
use crate::numbers::evenly;
use crate::sets::DataSet;
use anyhow::{Result, bail};
use scale::ScoreScale;
use scored::{Detector, ScoredLog, Scorer};
use std::collections::BTreeSet;

/// Logs that are drawn.
const LOGS: usize = 4;
/// Poses of a log that are drawn, from its first window on.
const POSES: usize = 4000;
/// Noise draws, common to all windows.
const DRAWS: usize = 2;
/// A window is beyond the threshold where fewer held-out trusted windows than this score as high.
const ALPHA: f64 = 0.05;

/// One detector, fitted on KITTI's fit logs (or those of the first set), and what it says of unfitted logs of
/// every set.
///
/// # Errors
/// No sets, too few trusted windows, no log to test, a failing network.
pub fn trajectories(input: &FigureInput<'_>) -> Result<Figure> {
    check(input.sets, input.kitti)?;
    let is_kitti = |s: &DataSet| s.letter == 'K';
    let trusted = input.sets.iter().position(is_kitti).unwrap_or(0);
    let trusted_set = &input.sets[trusted];
    let mut scorer = Scorer::new(input)?;
    let detector = Detector::fit(input, &mut scorer, trusted_set)?;
    let logs = examples(input.sets, trusted)
        .into_iter()
        .map(|(set, log)| ScoredLog::new(input, &mut scorer, &detector, set, log))
        .collect::<Result<Vec<_>>>()?;
    if logs.is_empty() {
        bail!("no log that the density was not fitted on has a window to draw");
    }
    let scale = ScoreScale::new(detector.reference.len(), ALPHA);
    let caption = format!(
        "One detector for all panels: paper24 statistics of a {}, all {} diffusion steps, {DRAWS} noise draws \
         shared by all windows (seed {}), density fitted on {} windows of {} ({} logs, none of those drawn; the \
         network was trained on {} of them). Colour: p-value of the score among the {} fitted windows, each \
         scored by a density fitted without its {}; a pose has the geometric mean over the windows of {} poses \
         that hold it. Orange to dark red is beyond the {} % threshold. At most {POSES} poses a log, from its \
         first window on. {}",
        network(input.sets, input.kitti),
        input.kitti.header.process.steps,
        input.seed,
        detector.reference.len(),
        trusted_set.name,
        detector.logs,
        detector.trained_on,
        detector.reference.len(),
        detector.left_out,
        input.kitti.header.window,
        100.0 * ALPHA,
        logs.iter()
            .map(ScoredLog::describe)
            .collect::<Vec<_>>()
            .join(" "),
    );
    Ok(Figure {
        key: "trajectories",
        title: format!("Logs scored by a detector that trusts {}", trusted_set.name),
        caption,
        svg: drawing::draw(&logs, &scale, trusted_set.name)?,
    })
}

/// A test log of the trusted set, one of every other set, and further ones of the last set.
fn examples(sets: &[DataSet], trusted: usize) -> Vec<(&DataSet, usize)> {
    let mut order = vec![trusted];
    order.extend((0..sets.len()).filter(|i| *i != trusted));
    order.truncate(LOGS);
    let last = order.len() - 1;
    let mut examples = Vec::new();
    for (place, set) in order.iter().map(|i| &sets[*i]).enumerate() {
        let wanted = if place == last { LOGS - last } else { 1 };
        let logs = evenly(&test_logs(set), wanted);
        examples.extend(logs.into_iter().map(|log| (set, log)));
    }
    examples
}

/// Test logs with windows, one of each group.
fn test_logs(set: &DataSet) -> Vec<usize> {
    let with_windows: BTreeSet<usize> = set.windows.iter().map(|w| w.trajectory).collect();
    let mut groups = BTreeSet::new();
    let logs = set.test_logs.intersection(&with_windows).copied();
    logs.filter(|log| groups.insert(set.trajectories[*log].group.as_str()))
        .collect()
}
