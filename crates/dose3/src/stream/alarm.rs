//! Alarms as they are told: since when, how bad, why.

use super::ring::Ring;
use super::scale::Scale;
use super::state::MOST;
use super::{Monitor, Said, WindowResult};
use crate::reasons;
use dose3_datasets::Frame;
use dose3_ood::Sample;
use dose3_ood::Score;
use dose3_ood::alarm::{AlarmReference, Change, RaisedBy, Watch, WatchStep};
use dose3_ood::localise::pose_numbers;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Groups of statistics that an alarm names.
const GROUPS: usize = 3;
/// A window that is so many times as far as the one that was put into words is put into words again.
const FAR_WORSE: f64 = 1.5;

/// What is said of an alarm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alarm {
    /// Whether it is raised, stands, or has ended.
    pub alarm: AlarmKind,
    /// Which alarm of the stream it is, from 1.
    pub number: u64,
    /// Stamp of the first pose that seems to be wrong, nanoseconds.
    pub since_ns: i64,
    /// Stamp of the pose at which it was raised.
    pub raised_ns: i64,
    /// Stamp of the pose that this is said at.
    pub at_ns: i64,
    /// Stamp by which the fault had ended; none while it stands.
    pub ended_ns: Option<i64>,
    /// What raised it: one window, a run of them, or evidence that added up.
    pub raised_by: RaisedBy,
    /// How far the last window is: 0 is the median of trusted windows, 1 what one in a thousand reaches.
    pub excess: f64,
    /// The same of the worst window so far.
    pub worst_excess: f64,
    /// Chance of the worst window among trusted ones.
    pub worst_chance: f64,
    /// Stamps of the first and last pose of the worst window.
    pub worst_window_ns: [i64; 2],
    /// The test that the worst window is farthest out in.
    pub test: String,
    /// What is unusual about the worst window in plain words, the strongest first; as of when the alarm was raised, or of
    /// a window that is far worse.
    pub why: Vec<String>,
    /// Groups of statistics that are unusual in the worst window, the strongest first.
    pub groups: Vec<GroupChance>,
}

/// Whether an alarm is raised, stands or has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlarmKind {
    /// It was raised now.
    Raised,
    /// It stands.
    Standing,
    /// The fault has ended.
    Ended,
}

/// A group of statistics that is unusual.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroupChance {
    /// Its name.
    pub group: String,
    /// Chance of its score among trusted windows.
    pub chance: f64,
}

/// What a window has to say.
pub(super) struct Evidence<'a> {
    pub window: &'a WindowResult,
    pub scale: usize,
    pub step: &'a WatchStep,
    pub groups: &'a [Score],
    pub ring: &'a Ring,
    pub frame: Frame,
}

/// The alarm of a stream through its life.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Lifecycle {
    watched: Vec<Watched>,
    standing: Option<Alarm>,
    raised: u64,
    /// How far the window is that was put into words.
    worded: f64,
}

/// Windows of one length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Watched {
    watch: Watch,
    /// Last stamp of the last window that was not unusual.
    usual_until: Option<i64>,
    /// First stamp of the first of the windows in a row that are not unusual.
    usual_from: Option<i64>,
}

impl Lifecycle {
    pub fn new(monitor: &Monitor) -> Self {
        let watched = |reference: &AlarmReference| Watched {
            watch: reference.watch(),
            usual_until: None,
            usual_from: None,
        };
        Self {
            watched: monitor.alarms().map(watched).collect(),
            standing: None,
            raised: 0,
            worded: 0.0,
        }
    }

    pub fn fits(&self, monitor: &Monitor) -> bool {
        let fresh = Self::new(monitor).watched;
        let mut each = self.watched.iter().zip(&fresh);
        self.watched.len() == fresh.len()
            && each.all(|(own, fresh)| own.watch.fits(&fresh.watch))
            && self.is_raised() == self.standing.is_some()
            && self.raised < MOST
    }

    pub fn standing(&self) -> Option<Alarm> {
        self.standing.clone()
    }

    /// Takes the scores of the next window in the tests.
    pub fn watch(&mut self, of: &Scale, scale: usize, tests: &[Score]) -> WatchStep {
        let watch = &mut self.watched[scale].watch;
        watch.push(&of.statistics, &of.alarm, tests)
    }

    fn is_raised(&self) -> bool {
        self.watched.iter().any(|own| own.watch.is_raised())
    }

    /// The next window does not continue the last one.
    pub fn begin_stretch(&mut self) {
        for watched in &mut self.watched {
            watched.watch.begin_stretch();
        }
    }

    /// Says what the window has changed.
    pub fn push(&mut self, monitor: &Monitor, evidence: &Evidence<'_>, said: &mut Vec<Said>) {
        let (window, step) = (evidence.window, evidence.step);
        let usual = !step.unusual;
        let watched = &mut self.watched[evidence.scale];
        match usual {
            true => watched.usual_from = watched.usual_from.or(Some(window.first_stamp_ns)),
            false => watched.usual_from = None,
        }
        let (usual_until, usual_from) = (watched.usual_until, watched.usual_from);
        if usual {
            watched.usual_until = Some(window.last_stamp_ns);
        }
        // An alarm stands while windows of either length are beyond their levels.
        let change = match (step.change, self.standing.is_some()) {
            (Some(Change::Raised), false) => Some(Change::Raised),
            (Some(Change::Ended), true) if !self.is_raised() => Some(Change::Ended),
            _ => None,
        };
        match change {
            Some(Change::Raised) => {
                self.raised += 1;
                let since = first_wrong(monitor, evidence, usual_until);
                let alarm = self.raise(monitor, evidence, since);
                self.worded = alarm.worst_excess;
                said.push(Said::Alarm(alarm.clone()));
                self.standing = Some(alarm);
            }
            Some(Change::Ended) => {
                if let Some(alarm) = self.standing.take() {
                    said.push(Said::Alarm(Alarm {
                        alarm: AlarmKind::Ended,
                        at_ns: window.last_stamp_ns,
                        ended_ns: Some(usual_from.unwrap_or(window.first_stamp_ns)),
                        excess: window.excess,
                        ..alarm
                    }));
                }
            }
            None => {
                if let Some(alarm) = &mut self.standing {
                    alarm.alarm = AlarmKind::Standing;
                    alarm.at_ns = window.last_stamp_ns;
                    alarm.excess = window.excess;
                    if window.excess > alarm.worst_excess {
                        worsen(alarm, monitor, evidence);
                    }
                    if window.excess > FAR_WORSE * self.worded {
                        self.worded = window.excess;
                        alarm.why = why(monitor, evidence);
                    }
                }
            }
        }
    }

    fn raise(&self, monitor: &Monitor, evidence: &Evidence<'_>, since: i64) -> Alarm {
        let window = evidence.window;
        let mut alarm = Alarm {
            alarm: AlarmKind::Raised,
            number: self.raised,
            since_ns: since,
            raised_ns: window.last_stamp_ns,
            at_ns: window.last_stamp_ns,
            ended_ns: None,
            raised_by: evidence.step.by.unwrap_or(RaisedBy::Window),
            excess: window.excess,
            worst_excess: window.excess,
            worst_chance: window.chance,
            worst_window_ns: [window.first_stamp_ns, window.last_stamp_ns],
            test: String::new(),
            why: why(monitor, evidence),
            groups: Vec::with_capacity(GROUPS),
        };
        worsen(&mut alarm, monitor, evidence);
        alarm
    }
}

/// The window is the worst so far.
fn worsen(alarm: &mut Alarm, monitor: &Monitor, evidence: &Evidence<'_>) {
    let window = evidence.window;
    alarm.worst_excess = window.excess;
    alarm.worst_chance = window.chance;
    alarm.worst_window_ns = [window.first_stamp_ns, window.last_stamp_ns];
    let statistics = &monitor.scales()[evidence.scale].statistics;
    let names = statistics.config().statistics.test_names();
    alarm.test = names.get(evidence.step.test).cloned().unwrap_or_default();
    let references = &statistics.calibration().groups;
    let groups = statistics.groups().iter().zip(evidence.groups);
    let mut chances: Vec<(f64, &str)> = groups
        .zip(references)
        .map(|((group, score), reference)| (reference.ln_p(*score), group.name.as_str()))
        .collect();
    chances.sort_by(|a, b| a.0.total_cmp(&b.0));
    let strongest = chances.into_iter().take(GROUPS);
    alarm.groups = strongest
        .map(|(ln_p, group)| GroupChance {
            group: group.to_owned(),
            chance: ln_p.exp(),
        })
        .collect();
}

/// In plain words; nothing where the detector knows no trusted ranges, or a quantity cannot be computed.
fn why(monitor: &Monitor, evidence: &Evidence<'_>) -> Vec<String> {
    let header = &monitor.header;
    let Some(ranges) = &header.ranges else {
        return Vec::new();
    };
    let log = evidence.ring.window(monitor.poses(), evidence.frame);
    let linear = header.reference.linear.as_ref();
    let found = reasons::of_window(&log, monitor.rate(), linear, ranges);
    let sentences = found.into_iter().flatten().map(|reason| reason.sentence);
    sentences.collect()
}

/// Stamp of the first pose of the last window, but none that a usual window held, that is beyond the pose threshold;
/// where none is, of the first pose looked at.
fn first_wrong(monitor: &Monitor, evidence: &Evidence<'_>, usual_until: Option<i64>) -> i64 {
    let (ring, poses) = (evidence.ring, monitor.scales()[evidence.scale].poses);
    let stamps = ring.stamps(poses);
    let new = usual_until.map_or(0, |until| stamps.partition_point(|s| *s <= until));
    let fallback = stamps.get(new).or(stamps.last()).copied();
    let numbers = pose_numbers(&Sample {
        increments: Some(ring.steps(poses)),
        linear: monitor.header.reference.linear.as_ref(),
        ..Sample::default()
    });
    let wrong = match (&monitor.header.poses, numbers) {
        (Some(reference), Ok(numbers)) => {
            // The numbers of step i are those of the pose that it leads to.
            (new.max(1)..stamps.len()).find(|&pose| {
                let score = numbers.get(pose - 1).map(|row| reference.score(row));
                matches!(score, Some(Ok(score)) if score > reference.threshold())
            })
        }
        _ => None,
    };
    let found = wrong.and_then(|pose| stamps.get(pose)).copied();
    found.or(fallback).unwrap_or_default()
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = |from: i64, to: i64| to.saturating_sub(from) as f64 * 1e-9;
        let stamp = |ns: i64| format!("{:.3} s", ns as f64 * 1e-9);
        match self.alarm {
            AlarmKind::Raised => write!(
                f,
                "alarm {}: since {} the motion is unlike the trusted logs",
                self.number,
                stamp(self.since_ns)
            )?,
            AlarmKind::Standing => write!(
                f,
                "alarm {} stands, {:.1} s since its start",
                self.number,
                seconds(self.since_ns, self.at_ns)
            )?,
            AlarmKind::Ended => write!(
                f,
                "alarm {} has ended: the motion was unlike the trusted logs from {} to about {}",
                self.number,
                stamp(self.since_ns),
                stamp(self.ended_ns.unwrap_or(self.at_ns))
            )?,
        }
        write!(
            f,
            "; at worst {:.1} times as far as one trusted window in a thousand",
            self.worst_excess
        )?;
        match (self.why.first(), self.groups.first()) {
            (Some(why), _) => write!(f, "; {why}"),
            (None, Some(first)) => write!(f, ", mostly by {}", first.group),
            (None, None) => Ok(()),
        }
    }
}
