//! Which logs are tested, and which faults are injected: fixed before anything is measured.

use crate::roles::{Role, roles};
use anyhow::{Error, Result, bail};
use dose3_datasets::faults::Fault;
use dose3_datasets::{LogGroups, Trajectory, at_rate};
use serde::Serialize;
use std::fmt;
use std::str::FromStr;

/// Severities of the validation part over those of the tested suite.
const BETWEEN: f64 = 1.4;

/// Which logs are tested.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// The validation logs, with other severities and another seed: what settings are chosen on.
    Validation,
    /// The test logs with the suite's severities.
    #[default]
    Test,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Validation => "validation",
            Self::Test => "test",
        })
    }
}

impl FromStr for Part {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "validation" => Ok(Self::Validation),
            "test" => Ok(Self::Test),
            _ => bail!("no part is named {text:?}, expected validation or test"),
        }
    }
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
        LogGroups::of(&self.raw).of_log
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
    fn tested_logs_fit_nothing() {
        let mut logs = suite(Platform::Vehicle, 5, 1);
        logs[1].group = logs[0].group.clone();
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
