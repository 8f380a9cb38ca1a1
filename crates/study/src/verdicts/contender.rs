//! The rows of every table: what is compared.

use anyhow::Result;
use dose3::detector::MOTION_STATISTICS;
use dose3_ood::{Combination, StatisticsSet};

/// One way to judge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contender {
    /// Its name in tables.
    pub key: &'static str,
    /// The columns.
    pub statistics: &'static str,
    /// What is fitted to them.
    pub kind: Kind,
}

/// What is fitted to the columns of trusted windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// The detector, its blocks joined like this.
    Detector(Combination),
    /// [`super::forest`].
    Forest,
    /// [`super::nearest`].
    Nearest,
}

const fn detector(key: &'static str, statistics: &'static str) -> Contender {
    Contender {
        key,
        statistics,
        kind: Kind::Detector(Combination::Fisher),
    }
}

const fn block(key: &'static str) -> Contender {
    Contender {
        key,
        statistics: key,
        kind: Kind::Detector(Combination::Joint),
    }
}

/// Key of the default detector.
pub const DEFAULT: &str = "default";

/// All of them.
pub const CONTENDERS: [Contender; 9] = [
    detector(DEFAULT, MOTION_STATISTICS),
    detector("no network", "kinematic,differences,lin"),
    detector("no network + cc", "kinematic,differences,lin,cc"),
    block("kinematic"),
    block("differences"),
    block("lin"),
    block("moments24"),
    Contender {
        key: "isolation forest",
        statistics: "kinematic+differences",
        kind: Kind::Forest,
    },
    Contender {
        key: "nearest neighbour",
        statistics: "kinematic+differences",
        kind: Kind::Nearest,
    },
];

impl Contender {
    /// The columns.
    ///
    /// # Errors
    /// A name that is no statistic.
    pub fn set(&self) -> Result<StatisticsSet> {
        Ok(self.statistics.parse()?)
    }
}

#[cfg(test)]
mod tests {
    use super::CONTENDERS;

    #[test]
    fn all_statistics_are_known() {
        for contender in CONTENDERS {
            assert!(
                contender.set().unwrap().dimension() > 0,
                "{}",
                contender.key
            );
        }
    }
}
