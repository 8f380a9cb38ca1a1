//! The stamps of one log in numbers.

use super::Symptom;
use crate::statistics::quantile_sorted;
use std::ops::Range;

/// Steps of a span.
pub(super) const SPAN: usize = 64;
/// Steps between the starts of spans.
const HOP: usize = SPAN / 2;
/// A log has become regular where so many steps in a row are about a period long.
const REGULAR: usize = 16;
/// It must do so within this many steps; later irregularity is no matter of starting up.
const START: usize = 64;
/// A step is that of lost poses where it is so close to a multiple of the period, in periods.
const CLEAN: f64 = 0.2;
/// Fewer steps say nothing.
const FEWEST: usize = 2 * REGULAR;

/// How the stamps of one log follow each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Cadence<'a> {
    stamps: &'a [i64],
    period: f64,
    settled: usize,
    start: f64,
    spans: Vec<Span>,
    /// Stamps, in order, of rows that were left out because they repeat the stamp before.
    repeated: &'a [i64],
}

/// What goes wrong in some steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// Poses at both ends of the steps, and all between them.
    pub poses: Range<usize>,
    /// [`Symptom::Lost`] to [`Symptom::Pace`], in this order.
    pub values: [f64; 5],
}

impl<'a> Cadence<'a> {
    /// From the stamps of a log as they were recorded, nanoseconds. They need not be in order. None for fewer than 33
    /// stamps, and where most of them do not advance.
    #[must_use]
    pub fn of(stamps: &'a [i64]) -> Option<Self> {
        let steps: Vec<f64> = stamps
            .windows(2)
            .map(|pair| (i128::from(pair[1]) - i128::from(pair[0])) as f64 * 1e-9)
            .collect();
        if steps.len() < FEWEST {
            return None;
        }
        let period = median(&steps);
        if period <= 0.0 {
            return None;
        }
        let settled = settled(&steps, period);
        let pauses = steps[..settled].iter().map(|step| step - period);
        let regular = &steps[settled..];
        let last = regular.len().saturating_sub(SPAN);
        let starts = (0..last.div_ceil(HOP) + 1).map(|hop| (hop * HOP).min(last));
        let mut sorted = Vec::new();
        let spans = starts.map(|first| {
            let steps = &regular[first..(first + SPAN).min(regular.len())];
            let first = settled + first;
            Span {
                poses: first..first + steps.len() + 1,
                values: values(steps, period, &mut sorted),
            }
        });
        Some(Self {
            stamps,
            period,
            settled,
            start: pauses.fold(0.0, f64::max),
            spans: spans.collect(),
            repeated: &[],
        })
    }

    /// With the stamps, in order, of rows that the reader left out because they repeat the stamp before: a recorder
    /// that writes poses twice shows in them alone.
    #[must_use]
    pub fn with_repeated(mut self, repeated: &'a [i64]) -> Self {
        self.repeated = repeated;
        for index in 0..self.spans.len() {
            let poses = self.spans[index].poses.clone();
            let (repeated, steps) = (self.repeated_within(&poses), poses.len() - 1);
            let crowded = &mut self.spans[index].values[Symptom::Crowded as usize];
            *crowded = (*crowded * steps as f64 + repeated as f64) / (steps + repeated) as f64;
        }
        self
    }

    /// Rows left out between the first and the last of these poses.
    pub(super) fn repeated_within(&self, poses: &Range<usize>) -> usize {
        let (first, last) = (self.stamps[poses.start], self.stamps[poses.end - 1]);
        let before = self.repeated.partition_point(|stamp| *stamp < first);
        let until = self.repeated.partition_point(|stamp| *stamp <= last);
        until.saturating_sub(before)
    }

    /// Whether rows at the stamp of this pose were left out.
    pub(super) fn is_repeated(&self, pose: usize) -> bool {
        self.repeated.binary_search(&self.stamps[pose]).is_ok()
    }

    /// The median step, seconds.
    #[must_use]
    pub fn period(&self) -> f64 {
        self.period
    }

    /// The stamps.
    #[must_use]
    pub fn stamps(&self) -> &'a [i64] {
        self.stamps
    }

    /// The first pose from which on the log is regular; 0 where it never is.
    #[must_use]
    pub fn settled(&self) -> usize {
        self.settled
    }

    /// Spans of 64 steps, half overlapping, from [`Self::settled`] on; at least one.
    #[must_use]
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// The highest value that the log has, in the unit of the symptom.
    #[must_use]
    pub fn highest(&self, symptom: Symptom) -> f64 {
        match symptom {
            Symptom::Start => self.start,
            Symptom::Rate => self.period.ln(),
            other => {
                let values = self.spans.iter().map(|span| span.values[other as usize]);
                values.fold(0.0, f64::max)
            }
        }
    }

    /// Seconds between two neighbouring poses.
    pub(super) fn step(&self, into: usize) -> f64 {
        (i128::from(self.stamps[into]) - i128::from(self.stamps[into - 1])) as f64 * 1e-9
    }

    /// Seconds from the first stamp to that of a pose.
    pub(super) fn seconds(&self, pose: usize) -> f64 {
        (i128::from(self.stamps[pose]) - i128::from(self.stamps[0])) as f64 * 1e-9
    }
}

fn settled(steps: &[f64], period: f64) -> usize {
    let mut regular = 0;
    for (index, step) in steps.iter().enumerate().take(START + REGULAR) {
        let is_regular = (0.5 * period..1.5 * period).contains(step);
        regular = if is_regular { regular + 1 } else { 0 };
        if regular == REGULAR {
            return index + 1 - REGULAR;
        }
    }
    0
}

/// [`Symptom::Lost`] to [`Symptom::Pace`] of some steps, seconds; `sorted` is a buffer.
pub(super) fn values(steps: &[f64], period: f64, sorted: &mut Vec<f64>) -> [f64; 5] {
    sorted.clear();
    sorted.extend(steps.iter().map(|step| without_lost(*step, period)));
    sorted.sort_unstable_by(f64::total_cmp);
    let quantile = |sorted: &[f64], q| quantile_sorted(sorted, q) / period;
    let spread = (quantile(sorted, 0.84) - quantile(sorted, 0.16)) / 2.0;
    sorted.clear();
    sorted.extend(steps);
    sorted.sort_unstable_by(f64::total_cmp);
    let share = |of: &dyn Fn(&f64) -> bool| {
        steps.iter().filter(|step| of(step)).count() as f64 / steps.len() as f64
    };
    let missing = steps.iter().sum::<f64>() / period - steps.len() as f64;
    [
        share(&|step| *step >= 1.5 * period).min(missing.max(0.0) / steps.len() as f64),
        (sorted[sorted.len() - 1] - period).max(0.0),
        spread,
        share(&|step| *step < 0.25 * period),
        // A median that stands still is as far from the log's as a step of a thousandth of it.
        quantile(sorted, 0.5).max(1e-3).ln().abs(),
    ]
}

/// A step of two or more periods, nearly to the point, is a regular one after lost poses.
pub(super) fn without_lost(step: f64, period: f64) -> f64 {
    let periods = (step / period).round();
    if periods >= 2.0 && (step / period - periods).abs() < CLEAN {
        return step - (periods - 1.0) * period;
    }
    step
}

fn median(steps: &[f64]) -> f64 {
    let mut sorted = steps.to_vec();
    sorted.sort_by(f64::total_cmp);
    quantile_sorted(&sorted, 0.5)
}
