//! Tests with shares of alpha of their own.
//!
//! What one more term in a sum would dilute keeps its strength as a test of its own. Tests may depend on
//! each other in any way, so their chances join by Bonferroni's inequality: `p = min_k p_k / share_k`, at
//! most 1, with shares that sum to 1.

use super::config::check_alpha;
use crate::calibration::Run;
use crate::error::{Error, expect_finite};
use serde::{Deserialize, Serialize};

/// A test made elsewhere, such as one of time stamps, that joins the verdict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExternalTest {
    /// Name of the test.
    pub name: String,
    /// Its share of alpha, in (0, 1); the detector's own tests share what is left.
    pub share: f64,
    /// Chance of such a finding in a log like the trusted ones, in [0, 1].
    pub p_value: f64,
    /// The finding in words.
    pub sentence: String,
}

/// What one test says of a log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TestVerdict {
    /// Name of the test: its statistics, or the name of a test from outside.
    pub name: String,
    /// Its share of alpha.
    pub share: f64,
    /// The chance by this test alone, in (0, 1].
    pub p_value: f64,
    /// What it rests on.
    pub evidence: Evidence,
}

/// What a test rests on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Evidence {
    /// The most unusual run of windows.
    Run(Run),
    /// A finding from outside, in words.
    Finding(String),
}

impl TestVerdict {
    /// The chance where the other tests could have decided as well: `p / share`, at most 1.
    #[must_use]
    pub fn weighted_p_value(&self) -> f64 {
        (self.p_value / self.share).min(1.0)
    }

    /// The run of windows, of the detector's own tests.
    #[must_use]
    pub fn run(&self) -> Option<&Run> {
        match &self.evidence {
            Evidence::Run(run) => Some(run),
            Evidence::Finding(_) => None,
        }
    }
}

impl ExternalTest {
    fn check(&self) -> Result<(), Error> {
        check_alpha("share of a test from outside", self.share)?;
        expect_finite("chance of a test from outside", [&self.p_value])?;
        if (0.0..=1.0).contains(&self.p_value) {
            return Ok(());
        }
        Err(Error::Parameter {
            name: "chance of a test from outside",
            value: self.p_value.to_string(),
            expected: "must lie in [0, 1]",
        })
    }
}

impl From<&ExternalTest> for TestVerdict {
    fn from(test: &ExternalTest) -> Self {
        Self {
            name: test.name.clone(),
            share: test.share,
            p_value: test.p_value.max(f64::MIN_POSITIVE),
            evidence: Evidence::Finding(test.sentence.clone()),
        }
    }
}

/// What the tests from outside leave to the detector's own.
///
/// # Errors
/// [`Error::Parameter`] for shares or chances out of range, and where nothing is left.
pub(super) fn share_left(external: &[ExternalTest]) -> Result<f64, Error> {
    external.iter().try_for_each(ExternalTest::check)?;
    let taken: f64 = external.iter().map(|test| test.share).sum();
    if taken < 1.0 {
        return Ok(1.0 - taken);
    }
    Err(Error::Parameter {
        name: "shares of the tests from outside",
        value: taken.to_string(),
        expected: "must leave something to the detector's own tests",
    })
}

/// The index of the test that decides, the first of equals, and the chance by all of them.
pub(super) fn join(tests: &[TestVerdict]) -> (usize, f64) {
    let mut best = (0, 1.0);
    for (index, test) in tests.iter().enumerate() {
        let p = test.weighted_p_value();
        if p < best.1 {
            best = (index, p);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn external(share: f64, p_value: f64) -> ExternalTest {
        ExternalTest {
            name: "timing".into(),
            share,
            p_value,
            sentence: "20 % of poses are missing".into(),
        }
    }

    fn joined(tests: &[(f64, f64)]) -> (usize, f64) {
        let of = |&(share, p)| TestVerdict::from(&external(share, p));
        join(&tests.iter().map(of).collect::<Vec<_>>())
    }

    #[test]
    fn bonferroni_by_hand() {
        assert_eq!(joined(&[(0.5, 0.02), (0.5, 0.01)]), (1, 0.02));
        assert_eq!(joined(&[(0.75, 0.03), (0.25, 0.02)]), (0, 0.04));
        assert_eq!(joined(&[(0.5, 0.9), (0.5, 0.7)]), (0, 1.0));
        assert!(joined(&[(0.5, 0.0), (0.5, 0.7)]).1 > 0.0);
    }

    #[test]
    fn shares_and_chances_are_checked() {
        assert_eq!(share_left(&[]).unwrap(), 1.0);
        assert!(
            (share_left(&[external(0.2, 0.5), external(0.1, 0.0)]).unwrap() - 0.7).abs() < 1e-12
        );
        for bad in [
            vec![external(0.0, 0.5)],
            vec![external(1.0, 0.5)],
            vec![external(0.2, 1.5)],
            vec![external(0.2, f64::NAN)],
            vec![external(0.5, 0.5), external(0.5, 0.5)],
        ] {
            assert!(share_left(&bad).is_err(), "{bad:?}");
        }
    }

    proptest! {
        #![proptest_config(crate::property_cases::cases(256))]

        #[test]
        fn never_below_the_smallest_chance_nor_above_1(
            p in prop::collection::vec(0.0_f64..=1.0, 1..6),
        ) {
            let share = 1.0 / p.len() as f64;
            let tests: Vec<(f64, f64)> = p.iter().map(|&p| (share, p)).collect();
            let (_, found) = joined(&tests);
            let smallest = p.iter().copied().fold(1.0, f64::min);
            prop_assert!(found >= smallest && found <= 1.0 && found > 0.0);
        }
    }
}
