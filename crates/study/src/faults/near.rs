//! Near platforms: car against car at equal speed, and short hand-held and drone logs.

use super::methods::{METHODS, all};
use super::prober::{Prober, Rows, SetRows, Settings, fit, overlap};
use super::protocol::{LogSet, Part};
use crate::data::DataRoot;
use anyhow::Result;
use dose3_datasets::{LoadOptions, Trajectory, Window, at_rate, load, windows as cut_windows};
use dose3_ood::DetectorStatistics;
use dose3_ood::metrics::auroc;
use serde::Serialize;

/// Windows are a match where mean speeds differ by at most this share.
const MATCH: f64 = 0.1;
/// Below this mean speed, metres a second, a window has no match: a share of nothing is nothing.
const SLOWEST: f64 = 0.5;
/// Share of a single log that fits its density.
const FITTED: f64 = 0.6;
/// Poses between the starts of windows of single logs.
const STRIDE: usize = 4;
/// Short logs of their own, where they are under `formats`.
const SINGLE: [(&str, &str); 2] = [
    ("TUM freiburg1", "tum_freiburg1_xyz_groundtruth.txt"),
    ("EuRoC V1_02", "euroc_V102_groundtruth.csv"),
];

/// One row on one pair.
#[derive(Clone, Debug, Serialize)]
pub struct NearCell {
    /// What is trusted.
    pub id: String,
    /// What is not.
    pub ood: String,
    /// Key of the row.
    pub method: &'static str,
    /// Trusted windows that no density has seen.
    pub id_windows: usize,
    /// Windows of the other.
    pub ood_windows: usize,
    /// AUROC.
    pub auroc: f64,
}

/// Pairs of windows, one of each side, that differ in speed by at most a tenth; every window is in
/// one pair at most, and each of the first takes the nearest that is left.
pub fn matched(first: &[f64], second: &[f64]) -> Vec<(usize, usize)> {
    let mut taken = vec![false; second.len()];
    let mut pairs = Vec::new();
    for (i, &speed) in first.iter().enumerate() {
        let distance = |j: usize| (second[j] - speed).abs();
        let nearest = (0..second.len())
            .filter(|&j| !taken[j] && distance(j) <= MATCH * speed && speed >= SLOWEST)
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        if let Some(j) = nearest {
            taken[j] = true;
            pairs.push((i, j));
        }
    }
    pairs
}

/// Mean speed in a window, metres a second.
fn speed(window: &Window, logs: &[Trajectory]) -> f64 {
    let poses = window.poses(logs).unwrap_or_default();
    let path = poses.windows(2);
    let path = path.map(|p| (p[1].translation - p[0].translation).norm());
    let seconds = poses.len().saturating_sub(1).max(1) as f64 / logs[window.trajectory].rate.hertz;
    path.sum::<f64>() / seconds
}

/// Tested windows of one set against windows of all logs of another at the same speed.
///
/// # Errors
/// Rows that do not fit.
pub fn at_equal_speed(
    (id, id_rows): (&LogSet, &SetRows),
    (ood, ood_rows): (&LogSet, &SetRows),
    detectors: &[DetectorStatistics],
    part: Part,
) -> Result<Vec<NearCell>> {
    let tested = id.tested(part);
    let own: Vec<usize> = (0..id_rows.windows.len())
        .filter(|&i| tested.contains(&id_rows.windows[i].trajectory))
        .collect();
    let speeds = own.iter().map(|&i| speed(&id_rows.windows[i], &id.logs));
    let others = ood_rows.windows.iter().map(|w| speed(w, &ood.logs));
    let pairs = matched(&speeds.collect::<Vec<_>>(), &others.collect::<Vec<_>>());
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let cell = |(m, detector): (usize, &DetectorStatistics)| {
        let first = pairs.iter().map(|&(i, _)| id_rows.rows[m][own[i]].clone());
        let second = pairs.iter().map(|&(_, j)| ood_rows.rows[m][j].clone());
        let first = detector.window_scores(&first.collect::<Vec<_>>())?;
        let second = detector.window_scores(&second.collect::<Vec<_>>())?;
        Ok(NearCell {
            id: id.name.into(),
            ood: format!("{} at equal speed", ood.name),
            method: METHODS[m].key,
            id_windows: first.len(),
            ood_windows: second.len(),
            auroc: auroc(&first, &second)?,
        })
    };
    detectors.iter().enumerate().map(cell).collect()
}

/// A single log: what fits its density, and what is tested.
pub struct Single {
    name: &'static str,
    all: SetRows,
    /// Detectors of the rows that so little data can fit.
    detectors: Vec<(usize, DetectorStatistics)>,
    /// The windows tested; none where the rest of the log is shorter than one.
    tested: SetRows,
}

/// The short logs under `root`.
///
/// # Errors
/// A log that cannot be read.
pub fn single_logs(
    root: &DataRoot,
    hertz: f64,
    settings: &Settings,
    prober: &mut Prober,
) -> Result<Vec<Single>> {
    let paths = SINGLE.map(|(name, file)| (name, root.path.join("formats").join(file)));
    let there = paths.iter().filter(|(_, path)| path.is_file());
    there
        .map(|(name, path)| {
            let log = at_rate(&load(path, &LoadOptions::default())?, hertz)?;
            single(name, &log, settings, prober)
        })
        .collect()
}

/// Single logs against each other and another set, in both directions.
///
/// # Errors
/// Rows that do not fit.
pub fn run(
    logs: &[Single],
    other: Option<(&LogSet, &SetRows, &[DetectorStatistics])>,
    part: Part,
) -> Result<Vec<NearCell>> {
    let mut cells = Vec::new();
    for id in logs {
        let mut test = |ood: &str, rows: &Rows| -> Result<()> {
            let own = (id.name, &id.tested.rows);
            cells.extend(against(
                own,
                id.detectors.iter().map(|(m, d)| (*m, d)),
                (ood, rows),
            )?);
            Ok(())
        };
        for ood in logs.iter().filter(|l| l.name != id.name) {
            test(ood.name, &ood.all.rows)?;
        }
        if let Some((set, rows, _)) = other {
            test(set.name, &rows.rows)?;
        }
    }
    if let Some((set, rows, detectors)) = other {
        let tested = set.tested(part);
        let own = (0..METHODS.len()).map(|m| rows.select(m, |_, w| tested.contains(&w.trajectory)));
        let own: Rows = own.map(|(rows, _)| rows).collect();
        for ood in logs {
            let detectors = detectors.iter().enumerate();
            cells.extend(against(
                (set.name, &own),
                detectors,
                (ood.name, &ood.all.rows),
            )?);
        }
    }
    Ok(cells)
}

fn single(
    name: &'static str,
    log: &Trajectory,
    settings: &Settings,
    prober: &mut Prober,
) -> Result<Single> {
    let mut probe = |log: &Trajectory| -> Result<SetRows> {
        let logs = std::slice::from_ref(log);
        let windows = cut_windows(logs, prober.poses, STRIDE);
        Ok(SetRows {
            rows: prober.rows(logs, &windows, &all(), &|| ())?,
            windows,
        })
    };
    let end = (FITTED * log.len() as f64) as usize;
    let (before, rest) = (log.cut(0..end), log.cut(end..log.len()));
    let (all_windows, fitted, tested) = (probe(log)?, probe(&before)?, probe(&rest)?);
    let overlap = overlap(prober.poses, STRIDE);
    let mut detectors = Vec::new();
    if !tested.windows.is_empty() {
        for m in all() {
            let trusted = fitted.select(m, |_, _| true);
            // One short log may be too little for a row; the table then has a gap there.
            if let Ok(detector) = fit(m, &trusted, &[0], overlap, settings) {
                detectors.push((m, detector));
            }
        }
    }
    Ok(Single {
        name,
        all: all_windows,
        detectors,
        tested,
    })
}

fn against<'a>(
    (id, own): (&str, &Rows),
    detectors: impl Iterator<Item = (usize, &'a DetectorStatistics)>,
    (ood, other): (&str, &Rows),
) -> Result<Vec<NearCell>> {
    let cell = |(m, detector): (usize, &DetectorStatistics)| {
        let first = detector.window_scores(&own[m])?;
        let second = detector.window_scores(&other[m])?;
        Ok(NearCell {
            id: id.into(),
            ood: ood.into(),
            method: METHODS[m].key,
            id_windows: first.len(),
            ood_windows: second.len(),
            auroc: auroc(&first, &second)?,
        })
    };
    let both = detectors.filter(|(m, _)| !own[*m].is_empty() && !other[*m].is_empty());
    both.map(cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_by_hand() {
        // 10 takes 10.2, 10.1 then the 9.5 that is left; 30 and standing windows have none.
        let pairs = matched(&[10.0, 10.1, 30.0, 0.0], &[9.5, 10.2, 20.0, 0.0]);
        assert_eq!(pairs, [(0, 1), (1, 0)]);
    }
}
