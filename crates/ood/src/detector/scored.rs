//! Scores of the windows of a log to be judged.

use super::DetectorStatistics;
use super::held_out::overall;
use crate::calibration::RunReference;
use crate::error::{Error, expect_finite, expect_len};
use crate::score::Score;
use rayon::prelude::*;

/// The scores of one window.
pub(super) struct Scored {
    /// Over all tests.
    pub score: Score,
    /// By each test.
    pub tests: Vec<Score>,
    /// By each group of statistics.
    pub groups: Vec<Score>,
}

/// One entry per row of statistics.
pub(super) fn score_rows(
    detector: &DetectorStatistics,
    rows: &[Vec<f64>],
) -> Result<Vec<Scored>, Error> {
    let models = detector.densities.group_models(&detector.groups)?;
    let references = &detector.calibration.groups;
    let (tests, shares) = (
        detector.config.statistics.test_groups(),
        detector.config.shares(),
    );
    rows.par_iter()
        .map(|row| {
            expect_len("statistics of a window", detector.names.len(), row.len())?;
            expect_finite("statistics of a window", row)?;
            let raw = detector.densities.score(&models, &detector.groups, row)?;
            let of_tests = raw.combine(detector.config.combination, &tests, references);
            let windows = detector.runs.iter().map(RunReference::windows);
            Ok(Scored {
                score: overall(&of_tests, &shares, windows),
                tests: of_tests,
                groups: raw.groups,
            })
        })
        .collect()
}
