//! The stamps of trusted logs, to which others are compared.

use super::event::{self, TimingEvent};
use super::student;
use super::{Cadence, Symptom};
use crate::error::{Error, expect_finite, expect_len};
use crate::statistics::quantile_sorted;
use serde::{Deserialize, Serialize};

/// The least scale of the tail beyond the trusted logs, in units of `ln(1 + value / floor)`.
const SCALE: f64 = 0.25;
/// Rates of trusted logs are taken to differ by this much (a logarithm, so five percent) by so many logs' worth of
/// evidence, before any is seen.
const RATES: (f64, f64) = (0.05, 4.0);

/// What is trusted of stamps: of each symptom the worst in each group of logs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct TimingReference {
    /// One entry a group of logs.
    groups: Vec<Worst>,
}

/// The worst of a group of logs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Worst {
    /// Spans of all its logs.
    spans: usize,
    /// Mean logarithm of the median step in seconds.
    ln_period: f64,
    /// The highest score of each symptom but the rate.
    scores: Vec<f64>,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    groups: Vec<Worst>,
}

/// What one symptom says of a log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TimingFinding {
    /// The symptom.
    pub symptom: Symptom,
    /// The highest value of the log, in the symptom's unit.
    pub value: f64,
    /// The highest value of any trusted log; of the rate, the mean.
    pub trusted: f64,
    /// Chance of as much in a log like the trusted ones.
    pub chance: f64,
}

/// What the stamps say of a log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TimingVerdict {
    /// Chance of stamps as unlike the trusted ones in a log like the trusted ones: the smallest of the symptoms'
    /// chances over their weights, at most 1.
    pub chance: f64,
    /// The symptom with that smallest chance.
    pub decided: Symptom,
    /// Trusted groups of logs that it rests on.
    pub groups: usize,
    /// One entry a symptom.
    pub findings: Vec<TimingFinding>,
    /// Where it shows. Empty where the chance is above the alpha that was judged at.
    pub events: Vec<TimingEvent>,
}

impl TimingReference {
    /// From the logs of groups: `groups[i]` names that of log `i`. Logs of one recording are one group, and as much
    /// evidence as one log.
    ///
    /// # Errors
    /// No log, or not one group a log.
    pub fn fit(logs: &[Cadence<'_>], groups: &[usize]) -> Result<Self, Error> {
        expect_len("groups of logs with stamps", logs.len(), groups.len())?;
        let mut names = groups.to_vec();
        names.sort_unstable();
        names.dedup();
        let worst = |group: &usize| {
            let members: Vec<&Cadence> = logs
                .iter()
                .zip(groups)
                .filter(|(_, of)| *of == group)
                .map(|(log, _)| log)
                .collect();
            let highest = |symptom: Symptom| {
                let of = |log: &&Cadence| symptom.score(log.highest(symptom), log.period());
                members.iter().map(of).fold(0.0, f64::max)
            };
            let ln_period: f64 = members.iter().map(|log| log.period().ln()).sum();
            Worst {
                spans: members.iter().map(|log| log.spans().len()).sum(),
                ln_period: ln_period / members.len() as f64,
                scores: Symptom::ALL[..Symptom::WITH_HIGHEST]
                    .iter()
                    .map(|symptom| highest(*symptom))
                    .collect(),
            }
        };
        Stored {
            groups: names.iter().map(worst).collect(),
        }
        .try_into()
    }

    /// Trusted groups of logs.
    #[must_use]
    #[allow(clippy::len_without_is_empty)] // It is never empty.
    pub fn len(&self) -> usize {
        self.groups.len()
    }

    /// The log against the trusted ones, with what it shows beyond `alpha`.
    #[must_use]
    pub fn judge(&self, log: &Cadence<'_>, alpha: f64) -> TimingVerdict {
        let finding = |symptom: Symptom| {
            let value = log.highest(symptom);
            let score = symptom.score(value, log.period());
            TimingFinding {
                symptom,
                value,
                trusted: self.trusted(symptom, log.period()),
                chance: match symptom {
                    Symptom::Rate => self.rate_chance(value),
                    _ => self.chance(symptom, score, log.spans().len()),
                },
            }
        };
        let findings: Vec<TimingFinding> = Symptom::ALL.into_iter().map(finding).collect();
        let weighted = |finding: &TimingFinding| finding.chance / finding.symptom.weight();
        let mut decided = &findings[0];
        for finding in &findings[1..] {
            if weighted(finding) < weighted(decided) {
                decided = finding;
            }
        }
        let chance = weighted(decided).min(1.0);
        let mut events = Vec::new();
        for finding in &findings {
            if weighted(finding) <= alpha {
                let beyond = |value: f64| {
                    let score = finding.symptom.score(value, log.period());
                    let chance = self.chance(finding.symptom, score, log.spans().len());
                    chance <= alpha * finding.symptom.weight()
                };
                events.extend(event::of(log, finding, &beyond, self.hertz()));
            }
        }
        events.sort_by_key(TimingEvent::first_pose);
        TimingVerdict {
            chance,
            decided: decided.symptom,
            groups: self.groups.len(),
            findings,
            events,
        }
    }

    /// Lowest and highest trusted rate, hertz.
    fn hertz(&self) -> (f64, f64) {
        let rates = self.groups.iter().map(|group| (-group.ln_period).exp());
        rates.fold((f64::INFINITY, 0.0), |(low, high), rate| {
            (rate.min(low), rate.max(high))
        })
    }

    fn trusted(&self, symptom: Symptom, period: f64) -> f64 {
        if symptom == Symptom::Rate {
            return mean(self.groups.iter().map(|group| group.ln_period));
        }
        let highest = self.scores(symptom).fold(0.0, f64::max);
        symptom.value(highest, period)
    }

    fn scores(&self, symptom: Symptom) -> impl Iterator<Item = f64> {
        self.groups
            .iter()
            .map(move |group| group.scores[symptom as usize])
    }

    /// Chance that the worst of `spans` spans has this score: its rank among the trusted groups; beyond them
    /// `exp(-(score - highest) / scale) / (n + 1)`. The scale makes the distance of the highest from the median what
    /// it would be in an exponential tail; it is at least [`SCALE`].
    fn chance(&self, symptom: Symptom, score: f64, spans: usize) -> f64 {
        let mut scores: Vec<f64> = self.scores(symptom).collect();
        scores.sort_by(f64::total_cmp);
        let one_more = (scores.len() + 1) as f64;
        let highest = scores[scores.len() - 1];
        let chance = if score <= highest {
            let below = scores.partition_point(|other| *other < score);
            (1 + scores.len() - below) as f64 / one_more
        } else {
            let (highest, scale) = self.tail(symptom);
            (-(score - highest) / scale).exp() / one_more
        };
        // A log with more spans than the trusted ones has more chances of a bad one.
        let longer = spans as f64 / self.usual_spans() as f64;
        -((-chance).ln_1p() * longer.max(1.0)).exp_m1()
    }

    /// The highest trusted score of a symptom, and how slowly the tail beyond it falls.
    pub(super) fn tail(&self, symptom: Symptom) -> (f64, f64) {
        let mut scores: Vec<f64> = self.scores(symptom).collect();
        scores.sort_by(f64::total_cmp);
        let (highest, median) = (scores[scores.len() - 1], quantile_sorted(&scores, 0.5));
        // Of n values, the highest is expected where the tail has fallen to 1 / (n + 1).
        let fallen = ((scores.len() + 1) as f64 / 2.0).ln();
        let scale = if fallen > 0.0 {
            (highest - median) / fallen
        } else {
            0.0
        };
        (highest, scale.max(SCALE))
    }

    /// The mean step of the trusted logs, seconds.
    pub(super) fn usual_period(&self) -> f64 {
        mean(self.groups.iter().map(|group| group.ln_period)).exp()
    }

    /// Spans of the group in the middle.
    pub(super) fn usual_spans(&self) -> usize {
        let mut lengths: Vec<usize> = self.groups.iter().map(|group| group.spans).collect();
        lengths.sort_unstable();
        lengths[lengths.len() / 2]
    }

    /// Chance of a rate as far from the mean trusted one: Student's t, of a spread that is known beforehand in part.
    fn rate_chance(&self, ln_period: f64) -> f64 {
        let (spread, evidence) = RATES;
        let count = self.groups.len() as f64;
        let mean = mean(self.groups.iter().map(|group| group.ln_period));
        let squares: f64 = self
            .groups
            .iter()
            .map(|group| (group.ln_period - mean).powi(2))
            .sum();
        let degrees = evidence + count - 1.0;
        let variance = (evidence * spread * spread + squares) / degrees;
        let deviation = (variance * (1.0 + 1.0 / count)).sqrt();
        student::two_sided((ln_period - mean) / deviation, degrees)
    }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

impl TryFrom<Stored> for TimingReference {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        if stored.groups.is_empty() {
            return Err(Error::TooFew {
                what: "trusted logs with stamps",
                needed: 1,
                found: 0,
                hint: "stamps are compared with those of trusted logs",
            });
        }
        for group in &stored.groups {
            let what = "symptoms of a trusted log's stamps";
            expect_len(what, Symptom::WITH_HIGHEST, group.scores.len())?;
            expect_finite(what, &group.scores)?;
            expect_finite("period of a trusted log", [&group.ln_period])?;
            if group.spans == 0 {
                return Err(Error::Inconsistent {
                    part: "timing",
                    reason: "a trusted log without spans".to_owned(),
                });
            }
        }
        Ok(Self {
            groups: stored.groups,
        })
    }
}

impl From<TimingReference> for Stored {
    fn from(reference: TimingReference) -> Self {
        Self {
            groups: reference.groups,
        }
    }
}
