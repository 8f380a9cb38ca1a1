//! Held-out trusted scores and what follows from them.

use super::audit::{AuditFinding, Audited, audit};
use super::config::DetectorConfig;
use super::densities::{Densities, Resolved};
use super::held_out::HeldOut;
use super::place::Place;
use crate::calibration::{Reference, RunReference, Stretch};
use crate::error::{Error, expect_len};
use crate::folds::Unit;
use crate::score::Score;
use crate::statistics::Group;
use serde::{Deserialize, Serialize};

/// What trusted windows and groups of logs score that the densities have not seen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Scores beyond this are beyond the window threshold: the bottom `window_alpha` of the
    /// held-out likelihoods.
    pub threshold: Score,
    /// Held-out window scores, over all tests, of the groups that every test compares with.
    pub windows: Reference,
    /// Held-out window scores of each group of statistics, of the groups that its test compares with.
    pub groups: Vec<Reference>,
    /// Held-out window scores of each test in order of time, of the groups that it compares with; none in files of older versions, which kept
    /// no order.
    #[serde(default)]
    pub tests: Vec<Vec<Stretch>>,
    /// Whether groups of logs or blocks of them were held out.
    pub unit: Unit,
    /// Number of groups of trusted logs that every test compares with.
    pub logs: usize,
    /// What each held-out group (or block) showed.
    pub units: Vec<UnitCalibration>,
    /// Trusted groups that are unlike the others.
    #[serde(default)]
    pub audit: Vec<AuditFinding>,
}

/// A trusted group of logs, or a block of one, when it was held out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnitCalibration {
    /// Name of the group, and of the block where it was cut.
    pub name: String,
    /// Its windows.
    pub windows: usize,
    /// Of them, those beyond the threshold that the *other* units set, as it will be for a new log.
    pub beyond: usize,
    /// Mean window score.
    pub mean_score: Score,
    /// Whether the audit left it out of what new logs are compared with by some test.
    #[serde(default)]
    pub left_out: bool,
}

/// Cross-fits, audits, calibrates, and fits to all rows.
pub(super) fn calibrate(
    config: &DetectorConfig,
    groups: &[Group],
    rows: &[Vec<f64>],
    places: &[Place],
    names: &[String],
) -> Result<(Calibration, Densities), Error> {
    let density = config.density.clone().with_seed(config.seed);
    let of_group: Vec<usize> = places.iter().map(|p| p.group).collect();
    let resolved = Resolved::new(&density, config.combination, groups, rows, &of_group)?;
    let (densities, starts) = resolved.fit(groups, rows, &of_group)?;
    let held_out = HeldOut::new(config, &resolved, &starts, groups, rows, places)?;
    let audited = audit(&held_out, names)?;
    let calibration = calibration(&held_out, audited, names)?;
    Ok((calibration, densities))
}

fn calibration(
    held_out: &HeldOut<'_>,
    audited: Audited,
    names: &[String],
) -> Result<Calibration, Error> {
    let Audited {
        kept,
        scores,
        findings,
    } = audited;
    // Over all tests, a window is compared with those of groups that every test keeps.
    let everywhere: Vec<bool> = (0..names.len())
        .map(|group| kept.iter().all(|test| test[group]))
        .collect();
    let rows = (0..held_out.windows()).filter(|&row| everywhere[held_out.places[row].group]);
    let windows = Reference::new(rows.map(|row| scores.windows[row]).collect())?;
    let tests = scores.tests.iter().zip(&kept);
    Ok(Calibration {
        threshold: windows.threshold(held_out.config.window_alpha),
        windows,
        groups: held_out.references(|test, row| kept[test][held_out.places[row].group])?,
        tests: tests
            .map(|(scores, kept)| held_out.stretches(scores, |group| kept[group]))
            .collect(),
        unit: held_out.plan.unit(),
        logs: held_out.plan.logs() - everywhere.iter().filter(|kept| !**kept).count(),
        units: units(held_out, &scores.windows, &everywhere, names)?,
        audit: findings,
    })
}

fn units(
    held_out: &HeldOut<'_>,
    scores: &[Score],
    kept: &[bool],
    names: &[String],
) -> Result<Vec<UnitCalibration>, Error> {
    let (plan, places) = (&held_out.plan, held_out.places);
    let mut blocks_before = vec![0_usize; names.len()];
    (0..plan.units())
        .map(|unit| {
            let of_unit = |row: &usize| plan.unit_of()[*row] == unit;
            let mine: Vec<usize> = (0..scores.len()).filter(of_unit).collect();
            let others = (0..scores.len()).filter(|row| !of_unit(row) && kept[places[*row].group]);
            let threshold = Reference::new(others.map(|row| scores[row]).collect())?
                .threshold(held_out.config.window_alpha);
            let own: Vec<Score> = mine.iter().map(|&row| scores[row]).collect();
            let group = places[mine[0]].group;
            blocks_before[group] += 1;
            let name = match plan.unit() {
                Unit::Log => names[group].clone(),
                Unit::Block => format!("{}, block {}", names[group], blocks_before[group]),
            };
            Ok(UnitCalibration {
                name,
                windows: own.len(),
                beyond: own.iter().filter(|&&s| s > threshold).count(),
                mean_score: Score::mean(&own),
                left_out: !kept[group],
            })
        })
        .collect()
}

impl Calibration {
    /// The smallest chance that ranks among the trusted groups can give without a model, `1 / (n + 1)`:
    /// with blocks of n groups there still are only n groups.
    #[must_use]
    pub fn smallest_rank_p(&self) -> f64 {
        1.0 / (self.logs + 1) as f64
    }

    /// Per test, the trusted runs of windows.
    pub(super) fn runs(&self, config: &DetectorConfig) -> Result<Vec<RunReference>, Error> {
        if self.tests.is_empty() {
            return Ok(vec![RunReference::unordered(self.windows.clone())]);
        }
        let longest = config.durations().iter().map(|d| d.windows).max();
        let of_test =
            |test: &Vec<Stretch>| RunReference::new(test, longest.unwrap_or(1), config.overlap);
        self.tests.iter().map(of_test).collect()
    }

    pub(super) fn validate(&self, config: &DetectorConfig, groups: usize) -> Result<(), Error> {
        let wrong = |reason: &str| {
            Err(Error::Inconsistent {
                part: "calibration",
                reason: reason.to_owned(),
            })
        };
        expect_len("groups of the calibration", groups, self.groups.len())?;
        let windows = self.windows.len();
        let tests = config.statistics.tests();
        if self.tests.len() != tests && !(self.tests.is_empty() && tests == 1) {
            return wrong("it has not the tests of the settings");
        }
        // What one test leaves out another may keep.
        let ordered = |test: &Vec<Stretch>| test.iter().map(|s| s.scores.len()).sum::<usize>();
        let of_tests: Vec<usize> = match self.tests.is_empty() {
            true => vec![windows],
            false => self.tests.iter().map(ordered).collect(),
        };
        if of_tests.iter().any(|found| *found < windows) {
            return wrong("the tests' stretches do not add up to its windows");
        }
        let of_groups = config.statistics.test_groups();
        let pairs = of_groups.into_iter().zip(of_tests);
        if pairs.into_iter().any(|(groups, found)| {
            let groups = self.groups.get(groups);
            groups.is_none_or(|groups| groups.iter().any(|g| g.len() != found))
        }) {
            return wrong("groups and windows differ in number");
        }
        let kept = self.units.iter().filter(|u| !u.left_out);
        if kept.map(|u| u.windows).sum::<usize>() != windows {
            return wrong("the logs' windows do not add up");
        }
        if self
            .units
            .iter()
            .any(|u| u.beyond > u.windows || u.windows == 0)
        {
            return wrong("a log has no windows, or more beyond the threshold than it has");
        }
        let units = self.units.iter().filter(|u| !u.left_out).count();
        if self.logs == 0 || (self.unit == Unit::Log && self.logs != units) {
            return wrong("the number of logs is not that of what was held out");
        }
        if self.threshold != self.windows.threshold(config.window_alpha) {
            return wrong("the threshold is not that of its scores");
        }
        // Written so that NaN fails as well.
        if self
            .audit
            .iter()
            .any(|a| !(a.p_value > 0.0 && a.p_value <= 1.0))
        {
            return wrong("a chance of the audit is not in (0, 1]");
        }
        Ok(())
    }
}
