//! The rows of every table: what is compared.

use anyhow::Result;
use dose3::detector::{MOTION_SHARES, MOTION_STATISTICS};
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
    /// The detector.
    Detector {
        /// How the blocks of a test are joined.
        combination: Combination,
        /// Shares of alpha of its tests; none: equal ones.
        shares: Option<&'static [f64]>,
    },
    /// [`super::forest`].
    Forest,
    /// [`super::nearest`].
    Nearest,
}

const fn tests(
    key: &'static str,
    statistics: &'static str,
    shares: Option<&'static [f64]>,
) -> Contender {
    Contender {
        key,
        statistics,
        kind: Kind::Detector {
            combination: Combination::Fisher,
            shares,
        },
    }
}

const fn block(key: &'static str) -> Contender {
    Contender {
        key,
        statistics: key,
        kind: Kind::Detector {
            combination: Combination::Joint,
            shares: None,
        },
    }
}

/// Key of the default detector.
pub const DEFAULT: &str = "default";

/// All of them: the default, the same with less or more, single blocks, methods of others.
pub const CONTENDERS: [Contender; 14] = [
    tests(DEFAULT, MOTION_STATISTICS, Some(&MOTION_SHARES)),
    tests("network as a test", WITH_NETWORK, Some(&[0.6, 0.2, 0.2])),
    tests("network in the sum", IN_THE_SUM, Some(&MOTION_SHARES)),
    tests("four tests", FOUR_TESTS, Some(&[0.25, 0.3, 0.25, 0.2])),
    tests("one sum", "kinematic,differences,lin,cc", None),
    tests("sum without cc", "kinematic,differences,lin", None),
    block("kinematic"),
    block("differences"),
    block("lin"),
    block("cc"),
    block("residual+eps-mean"),
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

/// Rows of the joint network, for models that have one.
pub const OF_JOINT: [Contender; 6] = [
    block("joint-score"),
    tests(
        "joint score as a test",
        "kinematic,differences,lin/cc/joint-score",
        Some(&[0.6, 0.2, 0.2]),
    ),
    block("joint"),
    block("joint-given"),
    block("joint-quantiles"),
    tests(
        "joint network as a test",
        "kinematic,differences,lin/cc/joint",
        Some(&[0.6, 0.2, 0.2]),
    ),
];

/// The network's block with a share of alpha of its own.
const WITH_NETWORK: &str = "kinematic,differences,lin/cc/residual+eps-mean";
/// Each block with a share of alpha of its own.
const FOUR_TESTS: &str = "kinematic/differences/lin/cc";
/// The network's block as one more term.
const IN_THE_SUM: &str = "kinematic,differences,lin,residual+eps-mean/cc";

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
    use super::{CONTENDERS, OF_JOINT};

    #[test]
    fn all_statistics_are_known() {
        for contender in CONTENDERS.into_iter().chain(OF_JOINT) {
            assert!(
                contender.set().unwrap().dimension() > 0,
                "{}",
                contender.key
            );
        }
    }
}
