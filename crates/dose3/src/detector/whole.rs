//! What is asked of a log as a whole, beside its windows: how its stamps come, and whether position and attitude
//! belong together. Each is a test of its own with a small share of alpha.

use crate::error::Result;
use dose3_datasets::{LogGroups, RateSource, Trajectory, increments, stretches};
use dose3_ood::detector::ExternalTest;
use dose3_ood::findings::calibration::{
    CalibrationFinding, CalibrationPiece, CalibrationReference,
};
use dose3_ood::timing::{Cadence, TimingReference, TimingVerdict};
use serde::{Deserialize, Serialize};

/// Share of alpha of the stamps.
pub const TIMING_SHARE: f64 = 0.1;
/// Share of alpha of the calibration; its tail is too light for more.
pub const CALIBRATION_SHARE: f64 = 0.2;

/// What trusted logs look like as wholes; stored in a detector.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WholeReference {
    /// How their stamps come; none where their files have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<TimingReference>,
    /// How position and attitude belong together; none where no log has 200 poses without a gap.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<CalibrationReference>,
}

/// What a log shows as a whole.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WholeFindings {
    /// Its stamps against those of the trusted logs; none where either has no stamps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<TimingVerdict>,
    /// Its calibration against that of the trusted logs; none where either is too short.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<CalibrationFinding>,
}

impl WholeReference {
    /// Whether nothing is asked of logs as wholes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// From the trusted logs at the rate at which they are measured.
    pub(super) fn fit(
        logs: &[Trajectory],
        groups: &LogGroups,
        timing: bool,
        calibration: bool,
    ) -> Result<Self> {
        Ok(Self {
            timing: if timing {
                fit_timing(logs, groups)?
            } else {
                None
            },
            calibration: if calibration {
                fit_calibration(logs, groups)?
            } else {
                None
            },
        })
    }

    /// What `log`, at the same rate, shows at `alpha`.
    pub(super) fn judge(&self, log: &Trajectory, alpha: f64) -> Result<WholeFindings> {
        let timing = match (&self.timing, cadence(log)) {
            (Some(reference), Some(cadence)) => {
                Some(reference.judge(&cadence, alpha * TIMING_SHARE))
            }
            _ => None,
        };
        let calibration = match &self.calibration {
            Some(reference) => reference.judge(&pieces(log)?, alpha * CALIBRATION_SHARE)?,
            None => None,
        };
        Ok(WholeFindings {
            timing,
            calibration,
        })
    }
}

impl WholeFindings {
    /// The tests that join the verdict. A calibration that the trusted logs themselves do not allow to be called
    /// decides nothing.
    pub(super) fn tests(&self, log: &Trajectory) -> Vec<ExternalTest> {
        let timing = self.timing.as_ref().map(|timing| ExternalTest {
            name: "timing".to_owned(),
            share: TIMING_SHARE,
            p_value: timing.chance,
            sentence: match timing.events.first() {
                Some(event) => event.to_string(),
                None => "stamps come as those of the trusted logs".to_owned(),
            },
        });
        let calibration = self.calibration.as_ref().map(|finding| ExternalTest {
            name: "calibration".to_owned(),
            share: CALIBRATION_SHARE,
            p_value: if finding.called { finding.chance } else { 1.0 },
            sentence: finding.sentence(log.frame.has_forward()),
        });
        timing.into_iter().chain(calibration).collect()
    }
}

/// The stamps as they were recorded; none where the file has none.
fn cadence(log: &Trajectory) -> Option<Cadence<'_>> {
    let stamped = log.rate.source == RateSource::Stamps;
    let cadence = stamped.then(|| Cadence::of(log.source_stamps()))??;
    Some(cadence.with_repeated(&log.report.repeated_stamps))
}

fn fit_timing(logs: &[Trajectory], groups: &LogGroups) -> Result<Option<TimingReference>> {
    let known = logs.iter().zip(&groups.of_log);
    let (cadences, of): (Vec<_>, Vec<_>) = known
        .filter_map(|(log, group)| Some((cadence(log)?, *group)))
        .unzip();
    if cadences.is_empty() {
        return Ok(None);
    }
    Ok(Some(TimingReference::fit(&cadences, &of)?))
}

fn fit_calibration(
    logs: &[Trajectory],
    groups: &LogGroups,
) -> Result<Option<CalibrationReference>> {
    let (mut all, mut of) = (Vec::new(), Vec::new());
    for (log, group) in logs.iter().zip(&groups.of_log) {
        let pieces = pieces(log)?;
        of.extend(std::iter::repeat_n(*group, pieces.len()));
        all.extend(pieces);
    }
    if all.is_empty() {
        return Ok(None);
    }
    Ok(Some(CalibrationReference::fit(&all, &of)?))
}

/// About a thousand poses each.
fn pieces(log: &Trajectory) -> Result<Vec<CalibrationPiece>> {
    let mut pieces = Vec::new();
    for stretch in stretches(log, log.max_gap) {
        let steps = increments(&log.poses[stretch], log.frame);
        pieces.extend(CalibrationPiece::of_stretch(&steps, log.rate.hertz)?);
    }
    Ok(pieces)
}
