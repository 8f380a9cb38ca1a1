//! Whether stamps come as those of the trusted logs did.

use dose3_ood::timing::{StampFinding, StampLevels, Symptom};
use serde::{Deserialize, Serialize};

/// Steps of a span.
const SPAN: usize = StampLevels::SPAN;

/// The last steps between stamps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stamps {
    last: Option<i64>,
    /// Seconds.
    steps: Vec<f64>,
    /// Of each step the poses behind it that repeated its stamp.
    repeated: Vec<usize>,
    /// What the last span showed: it is said once.
    shown: Vec<Symptom>,
}

impl Stamps {
    pub fn new() -> Self {
        Self {
            last: None,
            steps: Vec::with_capacity(SPAN),
            repeated: Vec::with_capacity(SPAN),
            shown: Vec::with_capacity(Symptom::ALL.len()),
        }
    }

    /// Whether it can be one, from a file.
    pub fn fits(&self) -> bool {
        let positive = |step: &f64| *step > 0.0 && step.is_finite();
        self.steps.len() < SPAN
            && self.repeated.len() == self.steps.len()
            && self.shown.len() <= Symptom::ALL.len()
            && self.steps.iter().all(positive)
    }

    /// A new stretch begins.
    pub fn begin_stretch(&mut self) {
        self.last = None;
        self.steps.clear();
        self.repeated.clear();
    }

    /// A pose repeated the last stamp.
    pub fn repeat(&mut self) {
        if let Some(last) = self.repeated.last_mut() {
            *last += 1;
        }
    }

    /// The next pose; `sorted` is a buffer. Every half span what is new is found.
    pub fn push(
        &mut self,
        stamp: i64,
        period: f64,
        levels: &StampLevels,
        sorted: &mut Vec<f64>,
        mut found: impl FnMut(StampFinding),
    ) {
        let last = self.last.replace(stamp);
        let Some(last) = last else {
            return;
        };
        let step = stamp.saturating_sub(last) as f64 * 1e-9;
        self.steps.push(step);
        self.repeated.push(0);
        if self.steps.len() < SPAN {
            return;
        }
        let repeated = self.repeated.iter().sum();
        let before = self.shown.len();
        for finding in levels.look(&self.steps, (period, repeated), sorted) {
            if !self.shown[..before].contains(&finding.symptom) {
                found(finding);
            }
            self.shown.push(finding.symptom);
        }
        self.shown.drain(..before);
        self.steps.drain(..SPAN / 2);
        self.repeated.drain(..SPAN / 2);
    }
}
