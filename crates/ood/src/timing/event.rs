//! Where stamps are wrong, in words.

use super::cadence::without_lost;
use super::reference::TimingFinding;
use super::{Cadence, Symptom};
use crate::statistics::quantile_sorted;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;

/// One place where the stamps are unlike trusted ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum TimingEvent {
    /// Poses are missing here and there.
    Missing {
        /// The first and the last pose, and what is between them.
        poses: Range<usize>,
        /// Seconds from the first stamp of the log to those of these two poses.
        seconds: [f64; 2],
        /// Missing poses over all that should be there.
        share: f64,
        /// Largest share of steps of a span in which any was missing in trusted logs.
        trusted: f64,
    },
    /// No pose for a time.
    Pause {
        /// The poses before and after it.
        poses: Range<usize>,
        /// Seconds from the first stamp of the log to its beginning.
        from: f64,
        /// How long it lasts, seconds.
        seconds: f64,
        /// The longest step of trusted logs, seconds.
        trusted: f64,
    },
    /// Steps between stamps differ.
    Irregular {
        /// The first and the last pose, and what is between them.
        poses: Range<usize>,
        /// Seconds from the first stamp of the log to those of these two poses.
        seconds: [f64; 2],
        /// Spread of the steps (one standard deviation), seconds.
        spread: f64,
        /// The largest of trusted logs at this rate, seconds.
        trusted: f64,
    },
    /// Poses come doubled or together.
    Crowded {
        /// The first and the last pose, and what is between them.
        poses: Range<usize>,
        /// Seconds from the first stamp of the log to those of these two poses.
        seconds: [f64; 2],
        /// Share of poses that come within a quarter of a period after the one before, or do not advance.
        share: f64,
        /// The largest share in a span of trusted logs.
        trusted: f64,
    },
    /// Another rate than in the rest of the log.
    Pace {
        /// The first and the last pose, and what is between them.
        poses: Range<usize>,
        /// Seconds from the first stamp of the log to those of these two poses.
        seconds: [f64; 2],
        /// Median step here, seconds.
        period: f64,
        /// Median step of the log, seconds.
        usual: f64,
    },
    /// The whole log has another rate than the trusted ones.
    Rate {
        /// Its rate, hertz.
        hertz: f64,
        /// Lowest and highest of the trusted logs, hertz.
        trusted: [f64; 2],
    },
}

impl TimingEvent {
    /// The pose at which it begins.
    #[must_use]
    pub fn first_pose(&self) -> usize {
        match self {
            Self::Missing { poses, .. }
            | Self::Pause { poses, .. }
            | Self::Irregular { poses, .. }
            | Self::Crowded { poses, .. }
            | Self::Pace { poses, .. } => poses.start,
            Self::Rate { .. } => 0,
        }
    }
}

/// The events of a symptom, from all spans or steps whose value is beyond what is trusted.
pub(super) fn of(
    log: &Cadence<'_>,
    finding: &TimingFinding,
    beyond: &dyn Fn(f64) -> bool,
    hertz: (f64, f64),
) -> Vec<TimingEvent> {
    let trusted = finding.trusted;
    let period = log.period();
    match finding.symptom {
        Symptom::Pause => pauses(log, log.settled() + 1..log.stamps().len(), trusted, beyond),
        Symptom::Start => pauses(log, 1..log.settled() + 1, trusted, beyond),
        Symptom::Rate => vec![TimingEvent::Rate {
            hertz: 1.0 / period,
            trusted: [hertz.0, hertz.1],
        }],
        symptom => stretches(log, symptom, beyond)
            .into_iter()
            .map(|poses| match symptom {
                Symptom::Lost => missing(log, poses, trusted),
                Symptom::Crowded => crowded(log, poses, trusted),
                Symptom::Pace => TimingEvent::Pace {
                    seconds: ends(log, &poses),
                    period: quantile(steps(log, &poses), 0.5),
                    usual: period,
                    poses,
                },
                _ => TimingEvent::Irregular {
                    seconds: ends(log, &poses),
                    spread: spread(log, &poses),
                    trusted: trusted * period,
                    poses,
                },
            })
            .collect(),
    }
}

fn pauses(
    log: &Cadence<'_>,
    into: Range<usize>,
    trusted: f64,
    beyond: &dyn Fn(f64) -> bool,
) -> Vec<TimingEvent> {
    into.filter(|pose| beyond(log.step(*pose) - log.period()))
        .map(|pose| TimingEvent::Pause {
            poses: pose - 1..pose + 1,
            from: log.seconds(pose - 1),
            seconds: log.step(pose),
            trusted: log.period() + trusted,
        })
        .collect()
}

/// Spans beyond, those that touch as one.
fn stretches(
    log: &Cadence<'_>,
    symptom: Symptom,
    beyond: &dyn Fn(f64) -> bool,
) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for span in log.spans() {
        if !beyond(span.values[symptom as usize]) {
            continue;
        }
        match found.last_mut() {
            Some(last) if span.poses.start < last.end => last.end = span.poses.end,
            _ => found.push(span.poses.clone()),
        }
    }
    found
}

fn missing(log: &Cadence<'_>, poses: Range<usize>, trusted: f64) -> TimingEvent {
    let poses = narrowed(poses, |pose| log.step(pose) >= 1.5 * log.period());
    let lost: f64 = steps(log, &poses)
        .map(|step| ((step / log.period()).round() - 1.0).max(0.0))
        .sum();
    TimingEvent::Missing {
        seconds: ends(log, &poses),
        share: lost / (lost + (poses.len() - 1) as f64),
        trusted,
        poses,
    }
}

fn crowded(log: &Cadence<'_>, poses: Range<usize>, trusted: f64) -> TimingEvent {
    let is_crowded = |pose: usize| log.step(pose) < 0.25 * log.period();
    let poses = narrowed(poses, |pose| is_crowded(pose) || log.is_repeated(pose));
    let own = (poses.start + 1..poses.end).filter(|pose| is_crowded(*pose));
    let repeated = log.repeated_within(&poses);
    TimingEvent::Crowded {
        seconds: ends(log, &poses),
        share: (own.count() + repeated) as f64 / (poses.len() - 1 + repeated) as f64,
        trusted,
        poses,
    }
}

/// From the first to the last step that shows it, named by the pose that it leads to.
fn narrowed(poses: Range<usize>, shows: impl Fn(usize) -> bool) -> Range<usize> {
    let mut into = (poses.start + 1..poses.end).filter(|pose| shows(*pose));
    match into.next() {
        None => poses,
        Some(first) => first - 1..into.next_back().unwrap_or(first) + 1,
    }
}

fn steps(log: &Cadence<'_>, poses: &Range<usize>) -> impl Iterator<Item = f64> {
    (poses.start + 1..poses.end).map(|pose| log.step(pose))
}

fn ends(log: &Cadence<'_>, poses: &Range<usize>) -> [f64; 2] {
    [log.seconds(poses.start), log.seconds(poses.end - 1)]
}

/// As [`Symptom::Irregular`] has it, in seconds.
fn spread(log: &Cadence<'_>, poses: &Range<usize>) -> f64 {
    let of = |q| {
        quantile(
            steps(log, poses).map(|step| without_lost(step, log.period())),
            q,
        )
    };
    (of(0.84) - of(0.16)) / 2.0
}

fn quantile(steps: impl Iterator<Item = f64>, q: f64) -> f64 {
    let mut steps: Vec<f64> = steps.collect();
    steps.sort_by(f64::total_cmp);
    quantile_sorted(&steps, q)
}

impl fmt::Display for TimingEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing {
                seconds: [from, to],
                share,
                trusted,
                ..
            } => write!(
                f,
                "{:.0} % of poses missing between {from:.1} s and {to:.1} s, trusted at most {:.0} %",
                100.0 * share,
                100.0 * trusted
            ),
            Self::Pause {
                from,
                seconds,
                trusted,
                ..
            } => write!(
                f,
                "no pose for {} from {from:.1} s on, trusted at most {}",
                Duration(*seconds),
                Duration(*trusted)
            ),
            Self::Irregular {
                seconds: [from, to],
                spread,
                trusted,
                ..
            } => write!(
                f,
                "stamps irregular between {from:.1} s and {to:.1} s: {} spread, trusted at most {}",
                Duration(*spread),
                Duration(*trusted)
            ),
            Self::Crowded {
                seconds: [from, to],
                share,
                trusted,
                ..
            } => write!(
                f,
                "{:.0} % of poses doubled or together with the one before between {from:.1} s and {to:.1} s, \
                 trusted at most {:.0} %",
                100.0 * share,
                100.0 * trusted
            ),
            Self::Pace {
                seconds: [from, to],
                period,
                usual,
                ..
            } => write!(
                f,
                "a pose every {} between {from:.1} s and {to:.1} s, every {} in the whole log",
                Duration(*period),
                Duration(*usual)
            ),
            Self::Rate {
                hertz,
                trusted: [low, high],
            } => write!(
                f,
                "{hertz:.1} poses a second, trusted {low:.1} to {high:.1}"
            ),
        }
    }
}

/// Seconds, as milliseconds below a tenth.
struct Duration(f64);

impl fmt::Display for Duration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.abs() < 0.0995 {
            write!(f, "{:.0} ms", 1e3 * self.0)
        } else {
            write!(f, "{:.1} s", self.0)
        }
    }
}
