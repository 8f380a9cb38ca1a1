//! Which logs do what, said once: training and every benchmark read it here, and nothing measured changes it.

use dose3_datasets::Trajectory;
use serde::Serialize;
use std::collections::BTreeMap;

/// KITTI logs that no network and no density of the study sees: they are tested. Networks of `paper` windows train
/// on all others; networks of motion keep 05 and 06 for validation.
pub const KITTI_TESTED: [&str; 3] = ["07", "09", "10"];

/// What a log is used for, in order of precedence within a group of logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Networks are trained on it.
    Network,
    /// Settings are chosen on it.
    Validation,
    /// Nothing but the final test sees it.
    Test,
    /// Only densities see it.
    Density,
}

/// The role of the log at `index` of a set sorted by name.
pub fn role(letter: char, index: usize, name: &str) -> Role {
    const TURNS: [Role; 4] = [Role::Network, Role::Density, Role::Validation, Role::Test];
    match (letter, name) {
        ('K', name) if KITTI_TESTED.contains(&name) => Role::Test,
        ('K', "05" | "06") => Role::Validation,
        ('K', _) => Role::Network,
        _ => TURNS[index % TURNS.len()],
    }
}

/// Roles of all logs of a set. The logs of a group (one recording) share the first role that any of
/// them has: a log is tested only where the networks saw none of its group.
pub fn roles(letter: char, logs: &[Trajectory]) -> Vec<Role> {
    let mut of_group = BTreeMap::new();
    for (i, log) in logs.iter().enumerate() {
        let own = role(letter, i, &log.name);
        let shared = of_group.entry(log.group.as_str()).or_insert(own);
        *shared = own.min(*shared);
    }
    let of = |log: &Trajectory| of_group.get(log.group.as_str()).copied();
    logs.iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use dose3_datasets::synthetic::{Platform, suite};

    #[test]
    fn roles_by_hand() {
        assert_eq!(role('K', 9, "09"), Role::Test);
        assert_eq!(role('K', 5, "05"), Role::Validation);
        assert_eq!(role('K', 3, "03"), Role::Network);
        assert_eq!(role('O', 1, "2019"), Role::Density);
        assert_eq!(role('I', 7, "traj_9"), Role::Test);
        // The second log is of the first one's group and moves to its role.
        let mut logs = suite(Platform::Vehicle, 5, 1);
        logs[1].group = logs[0].group.clone();
        let expected = [
            Role::Network,
            Role::Network,
            Role::Validation,
            Role::Test,
            Role::Network,
        ];
        assert_eq!(roles('V', &logs), expected);
    }
}
