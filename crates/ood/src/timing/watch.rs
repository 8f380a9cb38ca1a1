//! Stamps while they come, span by span.

use super::cadence::{SPAN, values};
use super::{Symptom, TimingReference};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Something that the stamps of a span show beyond the trusted logs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StampFinding {
    /// What it is.
    pub symptom: Symptom,
    /// How much of it, in the symptom's unit.
    pub value: f64,
    /// The most that any trusted log shows.
    pub trusted: f64,
}

/// Symptoms that a span can show, the first ones first said.
const OF_SPANS: [Symptom; 5] = [
    Symptom::Lost,
    Symptom::Pause,
    Symptom::Irregular,
    Symptom::Crowded,
    Symptom::Pace,
];

/// What stamps of trusted logs go beyond so and so often an hour.
#[derive(Clone, Debug, PartialEq)]
pub struct StampLevels {
    /// Of each symptom the level, and the highest trusted score below it.
    symptoms: [(f64, f64); OF_SPANS.len()],
}

impl TimingReference {
    /// What trusted logs go beyond `per_hour` times an hour at most, with the tail of [`Self::judge`].
    #[must_use]
    pub fn levels(&self, per_hour: f64) -> StampLevels {
        // The tail tells how often a trusted log is as bad, so its length counts.
        let hours = self.usual_spans() as f64 * (SPAN / 2) as f64 * self.usual_period() / 3600.0;
        let allowed = (per_hour * hours).min(1.0);
        StampLevels {
            symptoms: OF_SPANS.map(|symptom| {
                let (highest, scale) = self.tail(symptom);
                let fall = allowed * symptom.weight() * (self.len() + 1) as f64;
                let level = highest + scale * (-fall.ln()).max(0.0);
                // What any sensor may do is never told.
                (level.max(std::f64::consts::LN_2), highest)
            }),
        }
    }
}

impl StampLevels {
    /// Steps of a span.
    pub const SPAN: usize = SPAN;

    /// What a span of steps between stamps, in seconds, shows beyond its level; `period` is the usual step, `repeated` the
    /// number of poses within the span that repeated the stamp before and are not among the steps. `sorted` is a buffer.
    pub fn look(
        &self,
        steps: &[f64],
        (period, repeated): (f64, usize),
        sorted: &mut Vec<f64>,
    ) -> impl Iterator<Item = StampFinding> {
        let mut of_span = values(steps, period, sorted);
        let crowded = &mut of_span[Symptom::Crowded as usize];
        let count = steps.len() as f64;
        *crowded = (*crowded * count + repeated as f64) / (count + repeated as f64);
        let each = OF_SPANS.into_iter().zip(self.symptoms);
        each.filter_map(move |(symptom, (level, highest))| {
            let value = of_span[symptom as usize];
            (symptom.score(value, period) > level).then(|| StampFinding {
                symptom,
                value,
                trusted: symptom.value(highest, period),
            })
        })
    }
}

impl fmt::Display for StampFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (value, trusted) = (self.value, self.trusted);
        let percent = |x: f64| 100.0 * x;
        match self.symptom {
            Symptom::Pause | Symptom::Start => write!(
                f,
                "poses pause for {value:.3} s, trusted ones for {trusted:.3} s at most"
            ),
            Symptom::Lost => write!(
                f,
                "{:.0} % of the poses are missing, trusted at most {:.0} %",
                percent(value),
                percent(trusted)
            ),
            Symptom::Irregular => write!(
                f,
                "stamps scatter by {:.1} % of a step, trusted at most {:.1} %",
                percent(value),
                percent(trusted)
            ),
            Symptom::Crowded => write!(
                f,
                "{:.0} % of the poses come doubled or together, trusted at most {:.0} %",
                percent(value),
                percent(trusted)
            ),
            Symptom::Pace | Symptom::Rate => write!(
                f,
                "poses come at another pace by {:.0} %, trusted at most {:.0} %",
                percent(value.exp_m1()),
                percent(trusted.exp_m1())
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::Cadence;

    /// Four logs of half an hour at 20 Hz that scatter by some microseconds.
    fn reference() -> TimingReference {
        let stamps = |log: i64| -> Vec<i64> {
            (0..36_000)
                .map(|i| i * 50_000_000 + (i * i * (log + 3)) % 400_000)
                .collect()
        };
        let trusted: Vec<Vec<i64>> = (0..4).map(stamps).collect();
        let cadences: Vec<Cadence<'_>> = trusted.iter().filter_map(|t| Cadence::of(t)).collect();
        TimingReference::fit(&cadences, &[0, 1, 2, 3]).unwrap()
    }

    fn found(steps: &[f64], repeated: usize) -> Vec<(Symptom, f64)> {
        let mut sorted = Vec::new();
        let levels = reference().levels(1.0);
        let found = levels.look(steps, (0.05, repeated), &mut sorted);
        found.map(|f| (f.symptom, f.value)).collect()
    }

    #[test]
    fn symptoms_by_hand() {
        let sound = [0.05; SPAN];
        assert_eq!(found(&sound, 0), []);
        let mut lost = sound;
        lost.iter_mut().step_by(4).for_each(|step| *step = 0.1);
        let (symptom, share) = found(&lost, 0)[0];
        assert!(symptom == Symptom::Lost && (share - 0.25).abs() < 1e-12);
        assert_eq!(found(&lost, 0).len(), 1);
        let mut pause = sound;
        pause[20] = 0.45;
        let (symptom, seconds) = found(&pause, 0)[0];
        assert!(symptom == Symptom::Pause && (seconds - 0.4).abs() < 1e-12);
        let doubled = found(&sound, 16);
        assert_eq!(doubled, [(Symptom::Crowded, 16.0 / 80.0)]);
        let (symptom, pace) = found(&[0.025; SPAN], 0)[0];
        assert!(symptom == Symptom::Pace && (pace - std::f64::consts::LN_2).abs() < 1e-12);
        let mut scatter = sound;
        let each = scatter.iter_mut().enumerate();
        each.for_each(|(i, step)| *step += if i % 2 == 0 { 0.02 } else { -0.02 });
        assert_eq!(found(&scatter, 0)[0].0, Symptom::Irregular);
    }

    #[test]
    fn findings_are_sentences() {
        let said = |symptom, value| StampFinding {
            symptom,
            value,
            trusted: 0.01,
        };
        let lost = said(Symptom::Lost, 0.2).to_string();
        assert_eq!(lost, "20 % of the poses are missing, trusted at most 1 %");
        for symptom in Symptom::ALL {
            assert!(said(symptom, 0.3).to_string().contains("trusted"));
        }
    }
}
