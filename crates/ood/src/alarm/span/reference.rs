//! What trusted spans look like, number by number, and the levels that follow from a rate.

use super::super::Peaks;
use super::numbers::{SPAN_NUMBERS, SpanRow, is_logarithm};
use crate::error::{Error, expect_finite, expect_len};
use serde::{Deserialize, Serialize};

/// Spans between two clusters of peaks, at least.
const APART: usize = 4;
/// Numbers that hardly vary in trusted logs fall off at least this slowly: logarithms, and angles in radians.
const SLOWEST: [f64; 2] = [0.05, 0.02];
/// The share of trusted spans that reaches a trusted extreme.
const EXTREME: f64 = 1e-3;
/// Share of the trusted spans beyond the start of a tail.
const HIGH: f64 = 0.1;

/// Trusted spans of one gap-free stretch, in order of time, without overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct SpanSeries {
    /// Index of the group of logs it belongs to.
    pub group: usize,
    /// One row a span.
    pub rows: Vec<SpanRow>,
}

/// Trusted spans of one length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct SpanReference {
    steps: usize,
    groups: usize,
    numbers: Vec<Tail>,
}

/// How one number behaves beyond what is usual.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Tail {
    peaks: Peaks,
    /// How far any trusted group went beyond the start of the others' tail, in their scales.
    farthest: f64,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    steps: usize,
    groups: usize,
    numbers: Vec<Tail>,
}

/// Levels of the numbers at a rate.
#[derive(Clone, Debug, PartialEq)]
pub struct SpanLevels {
    levels: SpanRow,
    /// Start of each tail, how far above it one trusted span in a thousand is, and clusters that say so.
    tails: Vec<(f64, f64, f64)>,
}

impl SpanReference {
    /// Of spans of `steps` steps in trusted logs at `hertz`. `None` without spans.
    #[must_use]
    pub fn fit(steps: usize, hertz: f64, trusted: &[SpanSeries]) -> Option<Self> {
        let mut groups: Vec<usize> = trusted
            .iter()
            .filter(|series| !series.rows.is_empty())
            .map(|series| series.group)
            .collect();
        groups.sort_unstable();
        groups.dedup();
        let seconds = steps as f64 / hertz;
        let numbers = (0..SPAN_NUMBERS).map(|number| {
            let slowest = SLOWEST[usize::from(!is_logarithm(number))];
            let tail = |left_out: Option<usize>| {
                let kept = trusted.iter().filter(|s| Some(s.group) != left_out);
                let values = kept.map(|s| s.rows.iter().map(|row| row[number]).collect());
                let peaks = Peaks::of(&values.collect::<Vec<Vec<f64>>>(), APART, seconds)?;
                let scale = peaks.scale.max(slowest);
                Some(Peaks { scale, ..peaks })
            };
            let beyond = |group: &usize| {
                let own = trusted.iter().filter(|s| s.group == *group);
                let values = own.flat_map(|s| s.rows.iter().map(|row| row[number]));
                let highest = values.fold(f64::NEG_INFINITY, f64::max);
                let others = tail(Some(*group))?;
                Some((highest - others.start) / others.scale)
            };
            Some(Tail {
                peaks: tail(None)?,
                // One group alone has no others.
                farthest: groups.iter().filter_map(beyond).fold(0.0, f64::max),
            })
        });
        Some(Self {
            steps,
            groups: groups.len(),
            numbers: numbers.collect::<Option<_>>()?,
        })
    }

    /// Steps of a span.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// Groups of trusted logs.
    #[must_use]
    pub fn groups(&self) -> usize {
        self.groups
    }

    /// What trusted logs pass `per_hour` times an hour, all numbers together; above 0.
    #[must_use]
    pub fn levels(&self, per_hour: f64) -> SpanLevels {
        let each = per_hour / SPAN_NUMBERS as f64;
        let level = |tail: &Tail| {
            let farthest = tail.peaks.start + tail.peaks.scale * tail.farthest;
            tail.peaks.tail(each).max(farthest)
        };
        SpanLevels {
            levels: std::array::from_fn(|number| level(&self.numbers[number])),
            tails: self.numbers.iter().map(Tail::reach).collect(),
        }
    }
}

impl Tail {
    fn reach(&self) -> (f64, f64, f64) {
        let clusters = self.peaks.clusters.max(1) as f64;
        let scales = clusters * ((HIGH / EXTREME).ln() / clusters).exp_m1();
        (self.peaks.start, self.peaks.scale * scales, clusters)
    }
}

impl SpanLevels {
    /// Whether any number is beyond its level.
    #[must_use]
    pub fn beyond(&self, row: &SpanRow) -> bool {
        row.iter().zip(&self.levels).any(|(x, level)| x >= level)
    }

    /// How far the farthest number is, and which: 0 is what nine trusted spans of ten do not reach, 1 what one in a
    /// thousand does.
    #[must_use]
    pub fn excess(&self, row: &SpanRow) -> (f64, usize) {
        let of = |number: usize| {
            let (start, reach, _) = self.tails[number];
            ((row[number] - start) / reach, number)
        };
        (1..SPAN_NUMBERS).map(of).fold(
            of(0),
            |most, next| {
                if next.0 > most.0 { next } else { most }
            },
        )
    }

    /// Chance of a span so far out among trusted ones, by the tail of its farthest number.
    #[must_use]
    pub fn chance(&self, row: &SpanRow) -> f64 {
        let each = row.iter().zip(&self.tails);
        let lowest = each
            .map(|(x, (start, reach, clusters))| {
                let scale = reach / (clusters * ((HIGH / EXTREME).ln() / clusters).exp_m1());
                let over = ((x - start) / scale).max(0.0);
                HIGH.ln() - clusters * (over / clusters).ln_1p()
            })
            .fold(0.0, f64::min);
        let all = lowest.exp() * SPAN_NUMBERS as f64;
        all.clamp(f64::MIN_POSITIVE, 1.0)
    }
}

impl TryFrom<Stored> for SpanReference {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        let what = "numbers of trusted spans";
        expect_len(what, SPAN_NUMBERS, stored.numbers.len())?;
        for tail in &stored.numbers {
            let peaks = &tail.peaks;
            expect_finite(
                what,
                [&peaks.start, &peaks.scale, &peaks.hours, &tail.farthest],
            )?;
            if !(peaks.scale > 0.0 && peaks.hours > 0.0) || stored.steps == 0 {
                return Err(Error::Inconsistent {
                    part: what,
                    reason: "a scale, a time or a length is not above 0".to_owned(),
                });
            }
        }
        Ok(Self {
            steps: stored.steps,
            groups: stored.groups,
            numbers: stored.numbers,
        })
    }
}

impl From<SpanReference> for Stored {
    fn from(reference: SpanReference) -> Self {
        Self {
            steps: reference.steps,
            groups: reference.groups,
            numbers: reference.numbers,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(group: usize, values: impl Iterator<Item = f64>) -> SpanSeries {
        let row = |x| [x; SPAN_NUMBERS];
        SpanSeries {
            group,
            rows: values.map(row).collect(),
        }
    }

    /// 1000 exponential values a group, in an order that mixes them.
    fn exponential(group: usize) -> SpanSeries {
        let value = |i: usize| -((i * 389 % 1000) as f64 + 0.5).ln() + 1000.0_f64.ln();
        series(group, (0..1000).map(value))
    }

    #[test]
    fn levels_continue_the_tail_and_hold_every_group() {
        let two: Vec<SpanSeries> = (0..2).map(exponential).collect();
        // 36 s a span: a group is ten hours.
        let reference = SpanReference::fit(360, 10.0, &two).unwrap();
        assert_eq!((reference.steps(), reference.groups()), (360, 2));
        let often = reference.levels(1.0);
        let seldom = reference.levels(0.01);
        let zero = [0.0; SPAN_NUMBERS];
        assert!(!often.beyond(&zero) && often.beyond(&[30.0; SPAN_NUMBERS]));
        assert!(seldom.levels[0] > often.levels[0]);
        // A group that stands apart lifts the level to where it was when it was left out, at least.
        let apart = series(2, (0..10).map(|i| 40.0 + f64::from(i)));
        let with: Vec<SpanSeries> = two.into_iter().chain([apart]).collect();
        let lifted = SpanReference::fit(360, 10.0, &with).unwrap().levels(1.0);
        assert!(lifted.levels[0] >= 49.0, "{}", lifted.levels[0]);
    }

    #[test]
    fn excess_and_chance_agree() {
        let one = SpanReference::fit(8, 10.0, &[exponential(0)]).unwrap();
        let levels = one.levels(1.0);
        let (start, reach, _) = levels.tails[3];
        let mut row = [-1.0; SPAN_NUMBERS];
        row[3] = start + reach;
        assert_eq!(levels.excess(&row), (1.0, 3));
        assert!((levels.chance(&row) - EXTREME * SPAN_NUMBERS as f64).abs() < 1e-9);
        row[3] = 1e300;
        assert!(levels.chance(&row) > 0.0);
        assert!(SpanReference::fit(8, 10.0, &[]).is_none());
    }

    #[test]
    fn files_with_other_numbers_are_refused() {
        let one = SpanReference::fit(8, 10.0, &[exponential(0)]).unwrap();
        let json = serde_json::to_string(&one).unwrap();
        assert_eq!(serde_json::from_str::<SpanReference>(&json).unwrap(), one);
        let fewer = json.replacen("\"numbers\":[{", "\"numbers\":[],\"other\":[{", 1);
        assert!(serde_json::from_str::<SpanReference>(&fewer).is_err());
        let none = json.replacen("\"steps\":8", "\"steps\":0", 1);
        assert!(serde_json::from_str::<SpanReference>(&none).is_err());
    }
}
