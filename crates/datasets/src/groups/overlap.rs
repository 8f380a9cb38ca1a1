//! Logs that share a recording or a route, found by their stamps and positions.

use std::collections::{BTreeMap, HashMap};

use serde::{Deserialize, Serialize};

use crate::Trajectory;

/// Stamps from here on (nanoseconds; the year 2001) are taken as time of day, so that logs with them can be compared;
/// smaller ones count from some start of their own.
const EPOCH: i64 = 1_000_000_000_000_000_000;
/// Share of the shorter log that must be in the other one, too.
const RECORDING: f64 = 0.1;
/// Fewest equal positions of one recording.
const FEWEST_POSITIONS: usize = 10;
/// Positions whose median is this far from the origin (metres) are taken as positions on the Earth.
const GLOBAL: f64 = 10_000.0;
/// Edge of the cells in which routes are compared, metres.
const CELL: f64 = 20.0;
/// Fewest cells, and the share of the smaller route that must be in the other one, too.
const ROUTE: (usize, f64) = (10, 0.5);

/// Two logs that are not independent of each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// Index of one log.
    pub first: usize,
    /// Index of the other, larger than `first`.
    pub second: usize,
    /// What they share.
    pub shared: Shared,
}

/// What two logs share.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shared {
    /// They were recorded at the same time, so many seconds of it.
    Time {
        /// Seconds.
        seconds: f64,
    },
    /// They hold the same positions to the last digit: copies, or parts of one log.
    Positions {
        /// Share of the positions of the shorter one.
        share: f64,
    },
    /// They are at the same places on the Earth at different times.
    Route {
        /// Share of the places of the smaller one.
        share: f64,
    },
}

impl Shared {
    /// Whether it is one recording, so that the two logs are one piece of evidence. Runs of one route are only
    /// named: whether they count as one is for the user to say.
    pub fn is_recording(self) -> bool {
        !matches!(self, Self::Route { .. })
    }
}

/// Pairs of logs that share time, positions or places, each with the strongest thing they share, in order.
pub fn overlaps(logs: &[Trajectory]) -> Vec<Overlap> {
    let mut found: BTreeMap<(usize, usize), Shared> = BTreeMap::new();
    for (pair, shared) in routes(logs)
        .into_iter()
        .chain(positions(logs))
        .chain(times(logs))
    {
        found.insert(pair, shared);
    }
    let overlap = |((first, second), shared)| Overlap {
        first,
        second,
        shared,
    };
    found.into_iter().map(overlap).collect()
}

type Pair = ((usize, usize), Shared);

fn times(logs: &[Trajectory]) -> Vec<Pair> {
    let span = |log: &Trajectory| {
        let stamps = log.source_stamps();
        let (first, last) = (*stamps.first()?, *stamps.last()?);
        (first >= EPOCH).then_some((first, last))
    };
    let mut spans: Vec<(i64, i64, usize)> = logs
        .iter()
        .enumerate()
        .filter_map(|(i, log)| span(log).map(|(first, last)| (first, last, i)))
        .collect();
    spans.sort_unstable();
    let mut pairs = Vec::new();
    for (i, a) in spans.iter().enumerate() {
        for b in spans[i + 1..].iter().take_while(|b| b.0 < a.1) {
            let common = a.1.min(b.1) - b.0;
            let shorter = (a.1 - a.0).min(b.1 - b.0);
            if common as f64 >= RECORDING * shorter as f64 && common > 0 {
                let seconds = common as f64 * 1e-9;
                pairs.push(((a.2.min(b.2), a.2.max(b.2)), Shared::Time { seconds }));
            }
        }
    }
    pairs
}

fn positions(logs: &[Trajectory]) -> Vec<Pair> {
    let keys = |log: &Trajectory| -> Vec<[u64; 3]> {
        let bits = |p: &dose3_lie::Pose| p.translation.map(|x| (x + 0.0).to_bits()).into();
        log.poses.iter().map(bits).collect()
    };
    let (common, sizes) = common(logs, keys);
    common
        .into_iter()
        .filter(|(_, n)| *n >= FEWEST_POSITIONS)
        .map(|((a, b), n)| ((a, b), n as f64 / sizes[a].min(sizes[b]) as f64))
        .filter(|(_, share)| *share >= RECORDING)
        .map(|(pair, share)| (pair, Shared::Positions { share }))
        .collect()
}

fn routes(logs: &[Trajectory]) -> Vec<Pair> {
    let keys = |log: &Trajectory| -> Vec<[i64; 3]> {
        let mut distances: Vec<f64> = log.poses.iter().map(|p| p.translation.norm()).collect();
        distances.sort_by(f64::total_cmp);
        match distances.get(distances.len() / 2) {
            Some(median) if *median > GLOBAL => {
                let cell = |p: &dose3_lie::Pose| p.translation.map(|x| (x / CELL).floor() as i64);
                log.poses.iter().map(|p| cell(p).into()).collect()
            }
            _ => Vec::new(),
        }
    };
    let (common, sizes) = common(logs, keys);
    common
        .into_iter()
        .map(|((a, b), n)| ((a, b), n, sizes[a].min(sizes[b])))
        .filter(|(_, n, size)| *size >= ROUTE.0 && *n as f64 >= ROUTE.1 * *size as f64)
        .map(|(pair, n, size)| {
            let share = n as f64 / size as f64;
            (pair, Shared::Route { share })
        })
        .collect()
}

/// For each pair of logs how many distinct keys they have in common, and for each log how many it has.
fn common<K: std::hash::Hash + Eq>(
    logs: &[Trajectory],
    keys: impl Fn(&Trajectory) -> Vec<K>,
) -> (BTreeMap<(usize, usize), usize>, Vec<usize>) {
    let mut holders: HashMap<K, Vec<usize>> = HashMap::new();
    let mut sizes = vec![0; logs.len()];
    for (i, log) in logs.iter().enumerate() {
        for key in keys(log) {
            let of = holders.entry(key).or_default();
            if of.last() != Some(&i) {
                of.push(i);
                sizes[i] += 1;
            }
        }
    }
    let mut pairs = BTreeMap::new();
    for of in holders.values().filter(|of| of.len() > 1) {
        for (i, a) in of.iter().enumerate() {
            for b in &of[i + 1..] {
                *pairs.entry((*a, *b)).or_default() += 1;
            }
        }
    }
    (pairs, sizes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LogGroups;
    use crate::synthetic::{Platform, trajectory};
    use dose3_lie::Vector;

    /// Drives that start at `start` seconds, each somewhere else.
    fn drives(starts: &[i64]) -> Vec<Trajectory> {
        let drive = |(i, start): (usize, &i64)| {
            let mut log = trajectory(Platform::Vehicle, i as u64, 300, 10.0);
            log.stamps
                .iter_mut()
                .for_each(|s| *s += start * 1_000_000_000);
            log
        };
        starts.iter().enumerate().map(drive).collect()
    }

    #[test]
    fn logs_of_one_time_are_one_recording_but_only_by_the_time_of_day() {
        let logs = drives(&[1_600_000_000, 1_600_000_010, 1_600_000_500]);
        let found = overlaps(&logs);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].first, found[0].second), (0, 1));
        let Shared::Time { seconds } = found[0].shared else {
            panic!("{found:?}");
        };
        assert!((seconds - 19.9).abs() < 0.01, "{seconds}");
        assert_eq!(LogGroups::of(&logs).joined(&found).of_log, [0, 0, 1]);
        assert_eq!(overlaps(&drives(&[0, 0, 5])), []);
    }

    #[test]
    fn parts_of_one_log_share_positions() {
        let mut logs = drives(&[0, 0]);
        let mut part = logs[1].clone();
        part.name = "part".into();
        part.group = "part".into();
        part.stamps.truncate(100);
        part.poses.truncate(100);
        logs.push(part);
        let found = overlaps(&logs);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].first, found[0].second), (1, 2));
        assert_eq!(found[0].shared, Shared::Positions { share: 1.0 });
        let groups = LogGroups::of(&logs).joined(&found);
        assert_eq!(groups.of_log, [0, 1, 1]);
        assert_eq!(groups.names, [logs[0].name.as_str(), logs[1].name.as_str()]);
    }

    #[test]
    fn a_route_driven_twice_is_named_and_not_joined() {
        let mut logs = drives(&[0, 0]);
        logs[1].poses = logs[0].poses.clone();
        for (log, noise) in logs.iter_mut().zip([0.0, 0.5]) {
            let utm = Vector::new(5_735_000.0 + noise, 620_000.0, 110.0);
            log.poses.iter_mut().for_each(|p| p.translation += utm);
        }
        let found = overlaps(&logs);
        assert!(
            matches!(found[0].shared, Shared::Route { share } if share > 0.5),
            "{found:?}"
        );
        assert_eq!(LogGroups::of(&logs).joined(&found).of_log, [0, 1]);
    }
}
