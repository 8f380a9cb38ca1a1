//! Faults against the same places without them: AUROC of windows.

use super::locate::{Locator, PoseCell};
use super::methods::{KINEMATIC, METHODS, NETWORK, all};
use super::prober::{Poses, Prober};
use super::protocol::LogSet;
use anyhow::{Result, bail};
use dose3_datasets::faults::Fault;
use dose3_datasets::{Trajectory, Window, stretches};
use dose3_ood::metrics::{Bootstrap, Grouped, Interval, Metric, auroc, estimate};
use dose3_ood::{DetectorStatistics, Score};
use serde::Serialize;
use std::ops::Range;

/// Poses of a cut.
pub const CUT: usize = 200;
/// Poses of a cut that the fault is injected into.
pub const FAULT: Range<usize> = 60..150;
/// Pose of a cut that windows without fault are centred on: the middle of the fault's range.
const MIDDLE: usize = 105;
/// Poses between the starts of places that come into question.
const PLACES: usize = 5;
/// A place counts where the path over the fault's range is at least this share of the median.
const MOVING: f64 = 0.2;

/// A place in a log: the first pose of a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Site {
    /// Index of the log.
    pub log: usize,
    /// First pose of the cut.
    pub start: usize,
}

/// Up to `count` places in the `tested` logs, evenly spread over those where the platform moves.
pub fn sites(logs: &[Trajectory], tested: &[usize], count: usize) -> Vec<Site> {
    let mut places: Vec<(Site, f64)> = Vec::new();
    for &log in tested {
        let t = &logs[log];
        for stretch in stretches(t, t.max_gap) {
            let starts = stretch.clone().step_by(PLACES);
            places.extend(starts.take_while(|s| s + CUT <= stretch.end).map(|start| {
                let range = &t.poses[start + FAULT.start..start + FAULT.end];
                let path = range.windows(2);
                let path = path.map(|p| (p[1].translation - p[0].translation).norm());
                (Site { log, start }, path.sum())
            }));
        }
    }
    let mut paths: Vec<f64> = places.iter().map(|p| p.1).collect();
    paths.sort_by(f64::total_cmp);
    let Some(&median) = paths.get(paths.len() / 2) else {
        return Vec::new();
    };
    places.retain(|(_, path)| *path >= MOVING * median);
    let chosen = count.min(places.len());
    (0..chosen)
        .map(|i| places[(2 * i + 1) * places.len() / (2 * chosen)].0)
        .collect()
}

/// First pose of the window of `poses` centred on `middle`, as far as a log of `length` lets it.
pub fn centred(middle: usize, poses: usize, length: usize) -> usize {
    middle
        .saturating_sub(poses / 2)
        .min(length.saturating_sub(poses))
}

/// AUROC of one row on one fault in one set.
#[derive(Clone, Debug, Serialize)]
pub struct FaultCell {
    /// Letter of the set.
    pub set: char,
    /// The fault with its severity.
    pub fault: String,
    /// Key of the row.
    pub method: &'static str,
    /// Faulty windows against the same places without fault.
    pub auroc: f64,
    /// Bootstrap interval over places; for two rows only.
    pub interval: Option<Interval>,
}

/// What faults are measured with.
pub struct Context<'a> {
    /// Pose scores.
    pub locator: &'a Locator,
    /// One detector a row.
    pub detectors: &'a [DetectorStatistics],
    /// Seed of the faults.
    pub seed: u64,
    /// Intervals.
    pub bootstrap: Bootstrap,
    /// Hears of every window done.
    pub tick: &'a dyn Fn(),
}

/// All faults, all rows; and where in the window they are seen.
///
/// # Errors
/// No place to inject at, a failing network.
pub fn run(
    set: &LogSet,
    sites: &[Site],
    faults: &[Fault],
    context: &Context<'_>,
    prober: &mut Prober,
) -> Result<(Vec<FaultCell>, Vec<PoseCell>)> {
    // Dropped poses and a doubled rate shorten a cut by half of the fault's range.
    if prober.poses > CUT - FAULT.len().div_ceil(2) {
        bail!(
            "a window of {} poses is too long for cuts of {CUT}",
            prober.poses
        );
    }
    let cuts: Vec<Trajectory> = sites
        .iter()
        .map(|s| set.logs[s.log].cut(s.start..s.start + CUT))
        .collect();
    let middles = vec![MIDDLE; cuts.len()];
    let (sound, _) = scores(&cuts, &middles, context, prober)?;
    let ids: Vec<usize> = (0..sites.len()).collect();
    let (mut cells, mut poses) = (Vec::new(), Vec::new());
    for fault in faults {
        let mut faulty = Vec::with_capacity(cuts.len());
        let mut middles = Vec::with_capacity(cuts.len());
        let mut ranges = Vec::with_capacity(cuts.len());
        for (site, cut) in cuts.iter().enumerate() {
            let seed = context
                .seed
                .wrapping_mul(1_000_003)
                .wrapping_add(site as u64);
            let injection = fault.inject(cut, FAULT, seed)?;
            let affected = injection.affected;
            middles.push(if affected.is_empty() {
                MIDDLE
            } else {
                (affected.start + affected.end) / 2
            });
            ranges.push(affected);
            faulty.push(injection.trajectory);
        }
        let (found, numbers) = scores(&faulty, &middles, context, prober)?;
        let placed: Vec<(Poses, Range<usize>)> = numbers
            .into_iter()
            .zip(ranges)
            .map(|((start, poses), affected)| {
                let within = |pose: usize| pose.saturating_sub(start);
                (poses, within(affected.start)..within(affected.end))
            })
            .collect();
        poses.extend(context.locator.cell(set.letter, fault.label(), &placed)?);
        for (m, method) in METHODS.iter().enumerate() {
            let side = |scores| Grouped { scores, logs: &ids };
            let (auroc, interval) = if [KINEMATIC, NETWORK].contains(&m) {
                let (id, ood) = (side(&sound[m]), side(&found[m]));
                let estimate = estimate(Metric::Auroc, id, ood, context.bootstrap)?;
                (estimate.value, estimate.interval)
            } else {
                (auroc(&sound[m], &found[m])?, None)
            };
            cells.push(FaultCell {
                set: set.letter,
                fault: fault.label(),
                method: method.key,
                auroc,
                interval,
            });
        }
    }
    Ok((cells, poses))
}

/// First pose of a window in its cut, and its pose numbers.
type Placed = (usize, Poses);

/// Of the window of each cut that is centred on its middle: scores `[method][cut]`, and first pose
/// and pose numbers `[cut]`.
fn scores(
    cuts: &[Trajectory],
    middles: &[usize],
    context: &Context<'_>,
    prober: &mut Prober,
) -> Result<(Vec<Vec<Score>>, Vec<Placed>)> {
    let length = prober.poses;
    let windows: Vec<Window> = cuts
        .iter()
        .zip(middles)
        .enumerate()
        .map(|(trajectory, (cut, &middle))| Window {
            trajectory,
            start: centred(middle, length, cut.len()),
            length,
        })
        .collect();
    let mut poses = Vec::with_capacity(cuts.len());
    let rows = prober.probe(
        cuts,
        &windows,
        &all(),
        &|_| true,
        &mut |index, numbers| poses.push((windows[index].start, numbers)),
        context.tick,
    )?;
    let scores = context.detectors.iter().zip(&rows);
    let scores = scores.map(|(detector, rows)| Ok(detector.window_scores(rows)?));
    Ok((scores.collect::<Result<_>>()?, poses))
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_datasets::synthetic::{Platform, trajectory};

    #[test]
    fn windows_are_centred_as_far_as_there_are_poses() {
        assert_eq!(centred(105, 129, 200), 41);
        assert_eq!(centred(61, 129, 200), 0);
        assert_eq!(centred(150, 129, 200), 71);
        assert_eq!(centred(150, 129, 240), 86);
    }

    #[test]
    fn sites_are_spread_over_places_that_move() {
        let mut log = trajectory(Platform::Vehicle, 5, 1000, 10.0);
        for (i, pose) in log.poses.iter_mut().enumerate() {
            // 1 m a pose, standing from pose 500 on.
            pose.translation.x = i.min(500) as f64;
            pose.translation.y = 0.0;
            pose.translation.z = 0.0;
        }
        let logs = [log.clone(), log];
        let found = sites(&logs, &[1], 10);
        assert_eq!(found.len(), 10);
        // The path over poses start + 60 .. start + 150 has at least a fifth of its 89 steps before
        // pose 500, so the last place starts before pose 422.
        assert!(found.iter().all(|s| s.log == 1 && s.start <= 422));
        assert!(found[0].start < 40 && found[9].start > 380);
        let gaps = found.windows(2).map(|p| p[1].start - p[0].start);
        assert!(gaps.clone().max() <= gaps.min().map(|g| g + 10));
        assert!(sites(&logs, &[], 10).is_empty());
        // The start of every place leaves room for a cut.
        assert!(
            sites(&logs, &[0], 10_000)
                .iter()
                .all(|s| s.start + CUT <= 1000)
        );
    }
}
