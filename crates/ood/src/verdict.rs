//! The one type of verdict.

use serde::{Deserialize, Serialize};
use std::fmt;

/// What is said of a log, in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// A log like the trusted ones is so unusual more often than alpha.
    InDistribution,
    /// A log like the trusted ones is so unusual at most as often as alpha.
    OutOfDistribution,
    /// Like the single trusted log.
    Like,
    /// Unlike the single trusted log. How logs differ from each other cannot be seen in one, so this is
    /// no verdict on the distribution.
    Unlike,
}

impl Verdict {
    /// The verdict for a log that `differs` from trusted logs of so many groups.
    #[must_use]
    pub fn of(differs: bool, groups: usize) -> Self {
        match (groups, differs) {
            (0 | 1, false) => Self::Like,
            (0 | 1, true) => Self::Unlike,
            (_, false) => Self::InDistribution,
            (_, true) => Self::OutOfDistribution,
        }
    }

    /// Whether the log is out of distribution; never said beside a single trusted log.
    #[must_use]
    pub fn is_ood(self) -> bool {
        self == Self::OutOfDistribution
    }

    /// Whether the log differs from what it was compared with: out of distribution, or unlike the
    /// single trusted log.
    #[must_use]
    pub fn differs(self) -> bool {
        matches!(self, Self::OutOfDistribution | Self::Unlike)
    }

    /// The name used in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::InDistribution => "in-distribution",
            Self::OutOfDistribution => "out-of-distribution",
            Self::Like => "like",
            Self::Unlike => "unlike",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::Verdict;

    #[test]
    fn one_trusted_log_gives_no_verdict_on_the_distribution() {
        assert_eq!(Verdict::of(true, 1), Verdict::Unlike);
        assert_eq!(Verdict::of(false, 1), Verdict::Like);
        assert!(!Verdict::Unlike.is_ood() && Verdict::Unlike.differs());
        assert_eq!(Verdict::of(true, 2), Verdict::OutOfDistribution);
        assert!(Verdict::of(true, 9).is_ood() && !Verdict::of(false, 9).differs());
    }

    #[test]
    fn files_hold_the_name() {
        for verdict in [
            Verdict::InDistribution,
            Verdict::OutOfDistribution,
            Verdict::Like,
            Verdict::Unlike,
        ] {
            let text = serde_json::to_string(&verdict).unwrap();
            assert_eq!(text, format!("\"{verdict}\""));
            assert_eq!(serde_json::from_str::<Verdict>(&text).unwrap(), verdict);
        }
        assert!(serde_json::from_str::<Verdict>("\"ood\"").is_err());
    }
}
