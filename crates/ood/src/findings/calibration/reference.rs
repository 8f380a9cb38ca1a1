//! What trusted logs show, and how a log is compared with it.

use super::explain::{Log, dot, rms};
use super::finding::{CalibrationFinding, MeasuredAlarms, Unit};
use super::piece::{COEFFICIENTS, CalibrationPiece, Kind};
use super::tail::Tail;
use crate::error::{Error, expect_finite, expect_len};
use crate::special::student_tail;
use crate::statistics::quantile_sorted;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Fewest groups, one held out at a time, and fewest pieces that a call may rest on.
const FEWEST_GROUPS: usize = 2;
const FEWEST_PIECES: usize = 8;
/// Largest share of the trusted pieces, one aside, that may be called by those of the other groups.
const LARGEST_ALARMS: f64 = 0.05;
/// From so many groups on, one in ten (at least one) may be odd.
const GROUPS_WITH_ODD: usize = 4;
const ODD_SHARE: f64 = 0.1;
/// A group with a piece of this chance among the others is odd.
const ODD_CHANCE: f64 = 0.005;
/// A coefficient of trusted logs varies by at least this (a millimetre, a milliradian, a thousandth of a pose).
const SMALLEST_SPREAD: f64 = 1e-3;

/// Trusted coefficients, and what trusted pieces show when their group is held out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct CalibrationReference {
    stored: Stored,
    /// Of the largest z of the held-out pieces whose group is not odd.
    tail: Option<Tail>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    median: Vec<f64>,
    spread: Vec<f64>,
    /// The largest z of each piece, judged by the other groups, by group; groups in ascending order.
    held_out: Vec<Vec<f64>>,
    /// Positions in `held_out` of the groups that are unlike the others and not part of the tail.
    odd: Vec<usize>,
}

impl CalibrationReference {
    /// Of the pieces of trusted logs; `groups[i]` is the recording (or route) of piece i.
    ///
    /// # Errors
    /// [`Error::Shape`]; [`Error::TooFew`] for no piece.
    pub fn fit(pieces: &[CalibrationPiece], groups: &[usize]) -> Result<Self, Error> {
        expect_len("groups of the trusted pieces", pieces.len(), groups.len())?;
        if pieces.is_empty() {
            return Err(Error::TooFew {
                what: "pieces of trusted logs",
                needed: 1,
                found: 0,
                hint: "calibration needs gap-free stretches of at least 200 increments",
            });
        }
        let mut by_group: BTreeMap<usize, Vec<&CalibrationPiece>> = BTreeMap::new();
        for (piece, &group) in pieces.iter().zip(groups) {
            by_group.entry(group).or_default().push(piece);
        }
        let by_group: Vec<Vec<&CalibrationPiece>> = by_group.into_values().collect();
        let all: Vec<usize> = (0..by_group.len()).collect();
        let (median, spread) = usual(&by_group, &all);
        let held_out = match by_group.len() {
            1 => vec![Vec::new()],
            _ => all
                .iter()
                .map(|&out| {
                    let others: Vec<usize> = all.iter().copied().filter(|&g| g != out).collect();
                    let (median, spread) = usual(&by_group, &others);
                    let of = |piece: &&CalibrationPiece| {
                        largest(&piece.coefficients, &piece.errors, &median, &spread)
                    };
                    by_group[out].iter().map(of).collect()
                })
                .collect(),
        };
        Self::try_from(Stored {
            median,
            spread,
            odd: odd_groups(&held_out),
            held_out,
        })
    }

    /// Compares a log, of which `pieces` are all pieces; none for no piece. `share` of the logs like the trusted ones
    /// may be called: a part of alpha, at most a fifth of it.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a share outside of (0, 1).
    pub fn judge(
        &self,
        pieces: &[CalibrationPiece],
        share: f64,
    ) -> Result<Option<CalibrationFinding>, Error> {
        if !(share > 0.0 && share < 1.0) {
            return Err(Error::Parameter {
                name: "share of alpha for calibration",
                value: share.to_string(),
                expected: "must lie in (0, 1)",
            });
        }
        let Some(log) = Log::of(pieces) else {
            return Ok(None);
        };
        let Stored { median, spread, .. } = &self.stored;
        let z = largest(&log.coefficients, &log.errors, median, spread);
        let chance = self.chance(z, self.tail.as_ref());
        let measured = self.measured_alarms(share);
        let explanation = log.explain(median, spread);
        let (kind, axis) = explanation.cause;
        Ok(Some(CalibrationFinding {
            kind,
            axis,
            value: explanation.value,
            unit: match kind {
                Kind::TimeOffset => Unit::Second,
                Kind::LeverArm => Unit::Metre,
                Kind::Mounting => Unit::Radian,
                Kind::Length | Kind::Turn => Unit::Factor,
            },
            standard_error: explanation.standard_error,
            trusted_median: dot(&explanation.parts, median),
            trusted_spread: rms(&explanation.parts, spread),
            z,
            chance,
            called: chance <= share && self.may_call(z, measured),
            measured,
        }))
    }

    /// Groups of trusted logs (in ascending order of their numbers, counted from 0) that are unlike the others.
    #[must_use]
    pub fn odd_groups(&self) -> &[usize] {
        &self.stored.odd
    }

    /// Trusted pieces, those of odd groups aside, that the pieces of the other groups would call at this share.
    #[must_use]
    pub fn measured_alarms(&self, share: f64) -> MeasuredAlarms {
        let Stored { held_out, odd, .. } = &self.stored;
        let kept: Vec<usize> = (0..held_out.len()).filter(|g| !odd.contains(g)).collect();
        let called = |group: usize| {
            let others = tail(held_out, |g| g != group && kept.contains(&g));
            let own = held_out[group].iter();
            others.map_or(0, |others| {
                own.filter(|&&z| z > others.most() && self.chance(z, Some(&others)) <= share)
                    .count()
            })
        };
        MeasuredAlarms {
            called: kept.iter().map(|&group| called(group)).sum(),
            pieces: kept.iter().map(|&group| held_out[group].len()).sum(),
            groups: kept.len(),
        }
    }

    /// Too few trusted logs, or too many alarms among them, and nothing is called; and nothing that a trusted piece
    /// shows too.
    fn may_call(&self, z: f64, measured: MeasuredAlarms) -> bool {
        let most = (LARGEST_ALARMS * measured.pieces as f64) as usize;
        self.tail.as_ref().is_some_and(|t| z > t.most())
            && self.stored.held_out.len() >= FEWEST_GROUPS
            && self.stored.held_out.iter().map(Vec::len).sum::<usize>() >= FEWEST_PIECES
            && measured.called <= most.max(1)
    }

    fn chance(&self, z: f64, tail: Option<&Tail>) -> f64 {
        let pieces: usize = self.stored.held_out.iter().map(Vec::len).sum();
        let freedom = pieces.saturating_sub(1).max(2) as f64;
        let model = 2.0 * COEFFICIENTS as f64 * student_tail(z, freedom);
        model.max(tail.map_or(1.0, |t| t.chance(z))).min(1.0)
    }
}

/// Median and spread of each coefficient over the groups `of`.
fn usual(by_group: &[Vec<&CalibrationPiece>], of: &[usize]) -> (Vec<f64>, Vec<f64>) {
    let column = |groups: &mut dyn Iterator<Item = usize>, i: usize| -> Vec<f64> {
        groups
            .flat_map(|g| by_group[g].iter().map(|p| p.coefficients[i]))
            .collect()
    };
    (0..COEFFICIENTS)
        .map(|i| {
            let all = median(column(&mut of.iter().copied(), i));
            let squares = of.iter().map(|&group| {
                let mut others = of.iter().copied().filter(|&g| g != group);
                let centre = match of.len() {
                    1 => all,
                    _ => median(column(&mut others, i)),
                };
                let own = column(&mut std::iter::once(group), i);
                let square: f64 = own.iter().map(|b| (b - centre).powi(2)).sum();
                square / own.len() as f64
            });
            let spread = (squares.sum::<f64>() / of.len() as f64).sqrt();
            (all, spread.max(SMALLEST_SPREAD))
        })
        .unzip()
}

fn largest(coefficients: &[f64], errors: &[f64], median: &[f64], spread: &[f64]) -> f64 {
    let z = |i: usize| {
        let scatter = (errors[i].powi(2) + spread[i].powi(2)).sqrt();
        (coefficients[i] - median[i]).abs() / scatter
    };
    (0..COEFFICIENTS).map(z).fold(0.0, f64::max)
}

/// How many of so many groups may be odd.
fn most_odd(groups: usize) -> usize {
    match groups {
        0..GROUPS_WITH_ODD => 0,
        _ => ((ODD_SHARE * groups as f64) as usize).max(1),
    }
}

/// Groups with a piece far beyond those of the others: one trusted log that is not like the rest must not hide the
/// faults of all new ones.
fn odd_groups(held_out: &[Vec<f64>]) -> Vec<usize> {
    let mut odd = BTreeSet::new();
    while odd.len() < most_odd(held_out.len()) {
        let kept = (0..held_out.len()).filter(|g| !odd.contains(g));
        let worst = kept
            .filter_map(|group| {
                let others = tail(held_out, |g| g != group && !odd.contains(&g))?;
                let highest = held_out[group].iter().copied().fold(0.0, f64::max);
                Some((others.chance(highest) * held_out[group].len() as f64, group))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match worst {
            Some((chance, group)) if chance <= ODD_CHANCE => odd.insert(group),
            _ => break,
        };
    }
    odd.into_iter().collect()
}

fn tail(held_out: &[Vec<f64>], keep: impl Fn(usize) -> bool) -> Option<Tail> {
    let groups = held_out.iter().enumerate().filter(|(g, _)| keep(*g));
    Tail::of(groups.flat_map(|(_, zs)| zs.iter().copied()))
}

/// Median of some numbers.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    quantile_sorted(&values, 0.5)
}

impl TryFrom<Stored> for CalibrationReference {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        expect_len("trusted coefficients", COEFFICIENTS, stored.median.len())?;
        expect_len(
            "spreads of trusted coefficients",
            COEFFICIENTS,
            stored.spread.len(),
        )?;
        expect_finite("trusted coefficients", &stored.median)?;
        expect_finite("spreads of trusted coefficients", &stored.spread)?;
        expect_finite("held-out calibration", stored.held_out.iter().flatten())?;
        let wrong = stored.spread.iter().any(|&s| s < SMALLEST_SPREAD)
            || stored.held_out.is_empty()
            || stored.held_out.iter().flatten().any(|&z| z < 0.0)
            || stored.odd.iter().any(|&g| g >= stored.held_out.len())
            || stored.odd.len() > most_odd(stored.held_out.len());
        if wrong {
            return Err(Error::Inconsistent {
                part: "calibration reference",
                reason: "a spread, a distance or a group that cannot be one".to_owned(),
            });
        }
        let tail = tail(&stored.held_out, |g| !stored.odd.contains(&g));
        Ok(Self { stored, tail })
    }
}

impl From<CalibrationReference> for Stored {
    fn from(reference: CalibrationReference) -> Self {
        reference.stored
    }
}
