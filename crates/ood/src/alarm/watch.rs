//! The state of an alarm: what was seen so far, and whether it is raised.

use super::ln_bet;
use super::reference::AlarmReference;
use crate::detector::DetectorStatistics;
use crate::score::Score;
use serde::{Deserialize, Serialize};

/// What is remembered from window to window; its size does not grow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Watch {
    /// Per chain, ln W.
    evidence: Vec<f64>,
    /// The chain that takes the next window.
    chain: usize,
    /// Scores in the tests of the last windows of the stretch, a ring.
    recent: Vec<Vec<Score>>,
    /// Windows of the stretch so far.
    count: u64,
    raised: bool,
    /// Windows since the last one that was unusual.
    usual: usize,
}

/// What one window changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Change {
    /// The alarm is raised.
    Raised,
    /// The fault has ended.
    Ended,
}

/// Which watcher raised an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RaisedBy {
    /// One window alone.
    Window,
    /// Windows in a row, all of them unusual.
    Run,
    /// Evidence that added up.
    Sum,
    /// A single number of a few steps.
    Number,
}

/// What the watchers say of one window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WatchStep {
    /// The logarithm of the window's chance.
    pub ln_p: f64,
    /// The test that it is the chance of.
    pub test: usize,
    /// ln W of the window's chain.
    pub evidence: f64,
    /// Whether the window is unusual.
    pub unusual: bool,
    /// Whether the alarm is raised now.
    pub raised: bool,
    /// What this window changed.
    pub change: Option<Change>,
    /// The first watcher that is beyond its level.
    pub by: Option<RaisedBy>,
}

impl Watch {
    /// Nothing seen yet: `chains` windows share a step, runs look `back` windows back, the detector has `tests`.
    #[must_use]
    pub fn new(chains: usize, back: usize, tests: usize) -> Self {
        let none = Score::new(0.0);
        Self {
            evidence: vec![0.0; chains.max(1)],
            chain: 0,
            recent: vec![vec![none; tests]; back + 1],
            count: 0,
            raised: false,
            usual: 0,
        }
    }

    /// Whether the alarm is raised.
    #[must_use]
    pub fn is_raised(&self) -> bool {
        self.raised
    }

    /// Whether it has the shape of `other`, and numbers that can be, as what comes from a file must.
    #[must_use]
    pub fn fits(&self, other: &Self) -> bool {
        let tests = |watch: &Self| -> Vec<usize> { watch.recent.iter().map(Vec::len).collect() };
        self.evidence.len() == other.evidence.len()
            && self.chain < self.evidence.len()
            && tests(self) == tests(other)
            && self.evidence.iter().all(|w| w.is_finite())
            && self.count < 1 << 53
    }

    /// The next window does not continue the last one: runs begin anew. What was bet stays bet.
    pub fn begin_stretch(&mut self) {
        self.count = 0;
    }

    /// Takes the scores of the next window in the tests of `detector`.
    pub fn push(
        &mut self,
        detector: &DetectorStatistics,
        reference: &AlarmReference,
        tests: &[Score],
    ) -> WatchStep {
        let places = self.recent.len() as u64;
        let at = (self.count % places) as usize;
        self.recent[at].copy_from_slice(tests);
        self.count += 1;

        let (ln_p, test) = reference.ln_p(detector, tests);
        let chain = &mut self.evidence[self.chain];
        *chain = chain.max(0.0) + ln_bet(ln_p);
        let evidence = *chain;
        self.chain = (self.chain + 1) % self.evidence.len();

        let unusual = ln_p <= reference.unusual();
        self.usual = match unusual {
            true => 0,
            false => self.usual.saturating_add(1),
        };
        let by = self.by(detector, reference, evidence);
        let change = match (self.raised, by) {
            (false, Some(_)) => Some(Change::Raised),
            (true, _) if self.usual >= reference.recovery() => Some(Change::Ended),
            _ => None,
        };
        match change {
            Some(Change::Raised) => self.raised = true,
            Some(Change::Ended) => {
                // What is to come is judged afresh.
                self.evidence.fill(0.0);
                (self.raised, self.usual, self.count) = (false, 0, 0);
            }
            None => {}
        }
        WatchStep {
            ln_p,
            test,
            evidence,
            unusual,
            raised: self.raised,
            change,
            by,
        }
    }

    fn by(
        &self,
        detector: &DetectorStatistics,
        reference: &AlarmReference,
        evidence: f64,
    ) -> Option<RaisedBy> {
        let places = self.recent.len() as u64;
        for (index, run) in reference.runs().iter().enumerate() {
            let back = |k: usize| (k * reference.spacing()) as u64;
            if self.count <= back(run.windows - 1) {
                break;
            }
            let lowest = |test: usize| {
                let window = |k| self.recent[((self.count - 1 - back(k)) % places) as usize][test];
                (1..run.windows).fold(window(0), |lowest, k| lowest.min(window(k)))
            };
            if -reference.run_ln_p(detector, run.windows, lowest) >= run.level {
                let alone = index == 0;
                return Some(if alone {
                    RaisedBy::Window
                } else {
                    RaisedBy::Run
                });
            }
        }
        (evidence >= reference.summed()).then_some(RaisedBy::Sum)
    }
}
