//! Whether spans hold an alarm up.

use super::super::Change;
use super::numbers::SpanRow;
use super::reference::SpanLevels;
use serde::{Deserialize, Serialize};

/// What is remembered from span to span.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpanWatch {
    raised: bool,
    /// Spans since the last one that was unusual.
    usual: usize,
}

/// What one span says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpanStep {
    /// How far the farthest number is ([`SpanLevels::excess`]).
    pub excess: f64,
    /// Which number that is.
    pub number: usize,
    /// Whether it is farther than one trusted span in a thousand.
    pub unusual: bool,
    /// What this span changed.
    pub change: Option<Change>,
}

impl SpanWatch {
    /// Whether it is beyond a level, or was lately.
    #[must_use]
    pub fn is_raised(&self) -> bool {
        self.raised
    }

    /// Takes the next span; `recovery` in a row that are not unusual end what is raised.
    pub fn push(&mut self, levels: &SpanLevels, row: &SpanRow, recovery: usize) -> SpanStep {
        let (excess, number) = levels.excess(row);
        let unusual = excess > 1.0;
        self.usual = match unusual {
            true => 0,
            false => self.usual.saturating_add(1),
        };
        let change = match (self.raised, levels.beyond(row)) {
            (false, true) => Some(Change::Raised),
            (true, false) if self.usual >= recovery => Some(Change::Ended),
            _ => None,
        };
        match change {
            Some(Change::Raised) => self.raised = true,
            Some(Change::Ended) => self.raised = false,
            None => {}
        }
        SpanStep {
            excess,
            number,
            unusual,
            change,
        }
    }
}
