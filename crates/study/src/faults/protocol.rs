//! Which logs do what, and which faults are injected: fixed before anything is measured.

use anyhow::Result;
use clap::ValueEnum;
use dose3_datasets::faults::Fault;
use dose3_datasets::{Trajectory, at_rate};
use serde::Serialize;
use std::collections::BTreeMap;

/// Severities of the validation part over those of the tested suite.
const BETWEEN: f64 = 1.4;

/// Which logs are tested.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// The validation logs, with other severities and another seed: what settings are chosen on.
    Validation,
    /// The test logs with the suite's severities.
    #[default]
    Test,
}

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
        ('K', "07" | "09" | "10") => Role::Test,
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

/// One data set at the model's rate.
pub struct LogSet {
    /// The letter it has in tables.
    pub letter: char,
    /// Its full name.
    pub name: &'static str,
    /// The logs as they were read, sorted by name.
    pub raw: Vec<Trajectory>,
    /// The same at the model's rate.
    pub logs: Vec<Trajectory>,
    /// What each log is used for.
    pub roles: Vec<Role>,
}

impl LogSet {
    /// Resamples and assigns roles.
    ///
    /// # Errors
    /// A log slower than `hertz`.
    pub fn new(letter: char, name: &'static str, raw: Vec<Trajectory>, hertz: f64) -> Result<Self> {
        let logs = raw
            .iter()
            .map(|log| at_rate(log, hertz))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            letter,
            name,
            roles: roles(letter, &raw),
            raw,
            logs,
        })
    }

    /// Logs whose windows fit densities when `part` is tested.
    pub fn fitted(&self, part: Part) -> Vec<usize> {
        self.with_role(|role| match part {
            Part::Validation => matches!(role, Role::Network | Role::Density),
            Part::Test => role != Role::Test,
        })
    }

    /// Logs that are tested.
    pub fn tested(&self, part: Part) -> Vec<usize> {
        self.with_role(|role| match part {
            Part::Validation => role == Role::Validation,
            Part::Test => role == Role::Test,
        })
    }

    fn with_role(&self, keep: impl Fn(Role) -> bool) -> Vec<usize> {
        let all = 0..self.roles.len();
        all.filter(|&i| keep(self.roles[i])).collect()
    }

    /// Names of some logs.
    pub fn names(&self, logs: &[usize]) -> Vec<String> {
        logs.iter().map(|&i| self.raw[i].name.clone()).collect()
    }

    /// Per log the number of its group, counted in order of appearance.
    pub fn groups(&self) -> Vec<usize> {
        let mut numbers = BTreeMap::new();
        self.raw
            .iter()
            .map(|log| {
                let next = numbers.len();
                *numbers.entry(log.group.as_str()).or_insert(next)
            })
            .collect()
    }
}

/// The faults that are injected: the suite's, or for validation the same with severities 1.4 times
/// as far from none. `quick` keeps every third.
pub fn faults(part: Part, quick: bool) -> Vec<Fault> {
    let all = Fault::suite().into_iter().map(|(_, _, fault)| match part {
        Part::Validation => fault.stronger(BETWEEN),
        Part::Test => fault,
    });
    all.step_by(if quick { 3 } else { 1 }).collect()
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
        let hertz = logs[0].rate.hertz;
        let set = LogSet::new('V', "vehicle", logs, hertz).unwrap();
        assert_eq!(set.fitted(Part::Test), [0, 1, 2, 4]);
        assert_eq!(set.fitted(Part::Validation), [0, 1, 4]);
        assert_eq!(set.tested(Part::Validation), [2]);
        assert_eq!(set.groups(), [0, 0, 1, 2, 3]);
    }

    #[test]
    fn validation_faults_are_others_with_other_severities() {
        let (test, validation) = (faults(Part::Test, false), faults(Part::Validation, false));
        assert_eq!(test.len(), Fault::suite().len());
        let same = test.iter().zip(&validation).filter(|(a, b)| a == b);
        for (fault, _) in same {
            assert_eq!(fault.severity().parse::<f64>().ok(), None, "{fault}");
        }
        assert_eq!(faults(Part::Test, true).len(), test.len().div_ceil(3));
    }
}
