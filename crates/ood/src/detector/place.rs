//! Where windows lie: in which group, log and gap-free stretch.

use std::collections::HashMap;
use std::hash::Hash;

/// Where a trusted window lies. The windows of one log's stretch come in order of time, each a stride
/// after the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    /// Index of the group: logs of one recording or route, which are one piece of evidence.
    pub group: usize,
    /// Index of the log, among the logs of all groups.
    pub log: usize,
    /// Number of the gap-free stretch within the log.
    pub stretch: usize,
}

impl Place {
    /// Places of windows whose logs have no gaps and are groups of their own.
    #[must_use]
    pub fn of_logs(logs: &[usize]) -> Vec<Self> {
        let place = |&log| Self {
            group: log,
            log,
            stretch: 0,
        };
        logs.iter().map(place).collect()
    }
}

/// The indices that share a key, in order of the first of each.
pub(super) fn gather<K: Eq + Hash>(keys: impl Iterator<Item = K>) -> Vec<Vec<usize>> {
    let mut position: HashMap<K, usize> = HashMap::new();
    let mut gathered: Vec<Vec<usize>> = Vec::new();
    for (index, key) in keys.enumerate() {
        let next = gathered.len();
        let at = *position.entry(key).or_insert(next);
        if at == next {
            gathered.push(Vec::new());
        }
        gathered[at].push(index);
    }
    gathered
}

#[cfg(test)]
mod tests {
    use super::gather;

    #[test]
    fn keys_may_be_interleaved() {
        let keys = ["b", "a", "b", "c", "a"];
        assert_eq!(gather(keys.iter()), [vec![0, 2], vec![1, 4], vec![3]]);
        assert!(gather([0; 0].iter()).is_empty());
    }
}
