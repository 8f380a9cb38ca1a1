//! What stamps can show.

use serde::{Deserialize, Serialize};
use std::fmt;

/// One kind of wrong stamps. All but the last two are numbers of a span of steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Symptom {
    /// Share of steps of a period and a half or more, but no more than the share of poses by which the span is short:
    /// where stamps only scatter, long steps are made up for by short ones, and no pose is missing.
    Lost,
    /// The longest step, less the period, seconds.
    Pause,
    /// Half the distance of the .16 and .84 quantiles of the steps (the standard deviation, were they normal),
    /// in periods. Steps of whole periods are regular ones after lost poses.
    Irregular,
    /// Share of steps below a quarter of the period: doubled poses, poses that waited and came together, stamps that
    /// stand still or go back.
    Crowded,
    /// Logarithm of the median step over that of the whole log, without sign.
    Pace,
    /// The longest step before the log has become regular, less the period, seconds: estimators that are still
    /// starting up send few poses.
    Start,
    /// Logarithm of the log's median step.
    Rate,
}

impl Symptom {
    /// All symptoms.
    pub const ALL: [Self; 7] = [
        Self::Lost,
        Self::Pause,
        Self::Irregular,
        Self::Crowded,
        Self::Pace,
        Self::Start,
        Self::Rate,
    ];

    /// How many have a highest value in each log; the last of [`Self::ALL`], the rate, has a middle.
    pub(super) const WITH_HIGHEST: usize = 6;

    /// The share of the chance of a false alarm that this symptom has; together they are 1.
    #[must_use]
    pub fn weight(self) -> f64 {
        match self {
            Self::Lost | Self::Pause => 0.3,
            Self::Irregular => 0.15,
            Self::Crowded => 0.1,
            Self::Pace | Self::Start | Self::Rate => 0.05,
        }
    }

    /// A value that any sensor may show, in the symptom's unit; `period` in seconds.
    #[must_use]
    pub fn floor(self, period: f64) -> f64 {
        match self {
            // Two of 64 steps.
            Self::Lost | Self::Crowded => 0.03,
            // A garbage collection, a slow disk: a tenth of a second, one lost pose of a slower log.
            Self::Pause | Self::Start => period.max(0.1),
            Self::Irregular => 0.02,
            Self::Pace | Self::Rate => 0.05,
        }
    }

    /// What values are compared by: `ln(1 + value / floor)`.
    pub(super) fn score(self, value: f64, period: f64) -> f64 {
        (value.max(0.0) / self.floor(period)).ln_1p()
    }

    /// The value with this score.
    pub(super) fn value(self, score: f64, period: f64) -> f64 {
        score.exp_m1() * self.floor(period)
    }
}

impl fmt::Display for Symptom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Lost => "lost poses",
            Self::Pause => "a pause",
            Self::Irregular => "irregular stamps",
            Self::Crowded => "poses too close together",
            Self::Pace => "a change of pace",
            Self::Start => "a pause at the start",
            Self::Rate => "another rate",
        })
    }
}
