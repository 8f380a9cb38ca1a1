//! Splits that keep every log, and every group of logs, on one side.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::{Error, Trajectory};

/// Indices of logs on two sides; together all of them, each once, both sides non-empty and sorted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Split {
    /// The logs to fit on.
    pub fit: Vec<usize>,
    /// The logs held out.
    pub held_out: Vec<usize>,
}

/// Holds out about `fraction` of the poses, in whole groups, chosen by `seed`.
///
/// The groups are shuffled and taken while they bring the number of held-out poses nearer to the fraction; at
/// least one group is on each side. The same names and lengths give the same split in whatever order they come.
///
/// # Errors
/// [`Error::Parameter`] for fewer than two groups or a fraction outside (0, 1).
///
/// ```
/// use dose3_datasets::{split_by_log, synthetic};
///
/// let logs = synthetic::suite(synthetic::Platform::Drone, 5, 1);
/// let split = split_by_log(&logs, 0.4, 7)?;
/// assert_eq!(split.fit.len() + split.held_out.len(), 5);
/// # Ok::<(), dose3_datasets::Error>(())
/// ```
pub fn split_by_log(trajectories: &[Trajectory], fraction: f64, seed: u64) -> Result<Split, Error> {
    if !(fraction > 0.0 && fraction < 1.0) {
        let found = fraction.to_string();
        return Err(Error::Parameter {
            what: "held-out fraction",
            expected: "between 0 and 1",
            found,
        });
    }
    let groups = shuffled_groups(trajectories, seed)?;
    let size = |members: &[usize]| {
        members
            .iter()
            .map(|index| trajectories[*index].len())
            .sum::<usize>() as f64
    };
    let total: f64 = groups.iter().map(|members| size(members)).sum();
    let target = fraction * total;
    let mut held_out = Vec::new();
    let mut held = 0.0;
    let mut taken = 0;
    for members in &groups {
        let one_is_left = taken + 1 == groups.len();
        let nearer = (held + size(members) - target).abs() < (held - target).abs();
        if !one_is_left && nearer {
            held += size(members);
            held_out.extend(members);
            taken += 1;
        }
    }
    if held_out.is_empty() {
        // Every group alone overshoots; the smallest one does so least.
        let smallest = groups.iter().min_by(|a, b| size(a).total_cmp(&size(b)));
        held_out.extend(smallest.into_iter().flatten());
    }
    Ok(complete(trajectories.len(), held_out))
}

/// `folds` splits; every group is held out in exactly one of them.
///
/// # Errors
/// [`Error::Parameter`] for fewer than two folds or fewer groups than folds.
pub fn folds(trajectories: &[Trajectory], folds: usize, seed: u64) -> Result<Vec<Split>, Error> {
    let mut groups = shuffled_groups(trajectories, seed)?;
    if folds < 2 || folds > groups.len() {
        return Err(Error::Parameter {
            what: "number of folds",
            expected: "at least 2 and at most the number of log groups",
            found: format!("{folds} for {} groups", groups.len()),
        });
    }
    // Largest first into the emptiest fold keeps the folds of similar size.
    let size = |members: &[usize]| {
        members
            .iter()
            .map(|index| trajectories[*index].len())
            .sum::<usize>()
    };
    groups.sort_by_key(|members| std::cmp::Reverse(size(members)));
    let mut held: Vec<(usize, Vec<usize>)> = vec![(0, Vec::new()); folds];
    for members in groups {
        if let Some(emptiest) = held
            .iter_mut()
            .min_by_key(|(poses, members)| (*poses, members.len()))
        {
            emptiest.0 += size(&members);
            emptiest.1.extend(members);
        }
    }
    Ok(held
        .into_iter()
        .map(|(_, members)| complete(trajectories.len(), members))
        .collect())
}

/// One split per group, in order of the first log of each; each holds out that group alone.
///
/// # Errors
/// [`Error::Parameter`] for fewer than two groups.
pub fn leave_one_out(trajectories: &[Trajectory]) -> Result<Vec<Split>, Error> {
    let mut groups = groups(trajectories)?;
    groups.sort();
    Ok(groups
        .into_iter()
        .map(|members| complete(trajectories.len(), members))
        .collect())
}

/// Groups in order of their names.
fn groups(trajectories: &[Trajectory]) -> Result<Vec<Vec<usize>>, Error> {
    let mut groups: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (index, trajectory) in trajectories.iter().enumerate() {
        groups.entry(&trajectory.group).or_default().push(index);
    }
    if groups.len() < 2 {
        return Err(Error::Parameter {
            what: "number of log groups to split",
            expected: "at least 2 (equally long IROS20 logs are one group)",
            found: groups.len().to_string(),
        });
    }
    Ok(groups.into_values().collect())
}

fn shuffled_groups(trajectories: &[Trajectory], seed: u64) -> Result<Vec<Vec<usize>>, Error> {
    let mut groups = groups(trajectories)?;
    groups.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    Ok(groups)
}

fn complete(count: usize, mut held_out: Vec<usize>) -> Split {
    held_out.sort_unstable();
    let fit = (0..count)
        .filter(|index| held_out.binary_search(index).is_err())
        .collect();
    Split { fit, held_out }
}
