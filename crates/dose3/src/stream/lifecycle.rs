//! The alarm of a stream through its life.

use super::alarm::{Alarm, AlarmKind, GroupChance};
use super::ring::Ring;
use super::scale::{SPAN_RECOVERY, Scale};
use super::state::MOST;
use super::{Monitor, Said};
use crate::reasons;
use dose3_datasets::Frame;
use dose3_ood::alarm::{
    AlarmReference, Change, RaisedBy, SpanRow, SpanWatch, Watch, WatchStep, span_name,
};
use dose3_ood::localise::pose_numbers;
use dose3_ood::{DetectorStatistics, Sample, Score};
use serde::{Deserialize, Serialize};

/// Groups of statistics that an alarm names.
const GROUPS: usize = 3;
/// A window that is so many times as far as the one that was put into words is put into words again.
const FAR_WORSE: f64 = 1.5;
/// What stands for a test where single numbers are looked at.
const NUMBERS: &str = "numbers";

/// What a window or a span has to say.
pub(super) struct Evidence<'a> {
    /// Whose it is: windows of every length, then spans.
    pub watcher: usize,
    pub poses: usize,
    /// Of the first and the last pose.
    pub stamps: [i64; 2],
    pub chance: f64,
    pub excess: f64,
    pub unusual: bool,
    /// What is beyond its level, if it was not before.
    pub raised: Option<RaisedBy>,
    pub shown: Shown<'a>,
    pub ring: &'a Ring,
    pub frame: Frame,
}

/// What it shows in.
pub(super) enum Shown<'a> {
    /// Scores of the groups of statistics, and the test that is farthest out.
    Groups(&'a DetectorStatistics, usize, &'a [Score]),
    /// One number.
    Number(usize),
}

/// All watchers, and the alarm that stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Lifecycle {
    windows: Vec<Watch>,
    spans: Vec<SpanWatch>,
    /// Of windows, then of spans.
    seen: Vec<Seen>,
    standing: Option<Alarm>,
    raised: u64,
    /// How far the window is that was put into words.
    worded: f64,
}

/// What one watcher saw last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Seen {
    /// Whether the last window is unusual.
    unusual: bool,
    /// Last stamp of the last window that was not unusual.
    usual_until: Option<i64>,
    /// First stamp of the first of the windows in a row that are not unusual.
    usual_from: Option<i64>,
}

impl Lifecycle {
    pub fn new(monitor: &Monitor) -> Self {
        let windows: Vec<Watch> = monitor.alarms().map(AlarmReference::watch).collect();
        let spans = vec![SpanWatch::default(); monitor.spans().len()];
        Self {
            seen: vec![Seen::default(); windows.len() + spans.len()],
            windows,
            spans,
            standing: None,
            raised: 0,
            worded: 0.0,
        }
    }

    pub fn fits(&self, monitor: &Monitor) -> bool {
        let fresh = Self::new(monitor);
        let mut each = self.windows.iter().zip(&fresh.windows);
        self.windows.len() == fresh.windows.len()
            && self.spans.len() == fresh.spans.len()
            && self.seen.len() == fresh.seen.len()
            && each.all(|(own, fresh)| own.fits(fresh))
            && (self.standing.is_some() || !self.is_raised())
            && self.raised < MOST
    }

    pub fn standing(&self) -> Option<Alarm> {
        self.standing.clone()
    }

    /// Takes the scores of the next window in the tests.
    pub fn watch(&mut self, of: &Scale, scale: usize, tests: &[Score]) -> WatchStep {
        self.windows[scale].push(&of.statistics, &of.alarm, tests)
    }

    /// Takes the numbers of the next span, and says what they have changed.
    pub fn look_at(
        &mut self,
        monitor: &Monitor,
        span: usize,
        row: &SpanRow,
        (ring, frame): (&Ring, Frame),
        said: &mut Vec<Said>,
    ) {
        let of = &monitor.spans()[span];
        let step = self.spans[span].push(&of.levels, row, SPAN_RECOVERY);
        let evidence = Evidence {
            watcher: self.windows.len() + span,
            poses: of.poses,
            stamps: [ring.first_stamp(of.poses), ring.last_stamp()],
            chance: of.levels.chance(row),
            excess: step.excess,
            unusual: step.unusual,
            raised: (step.change == Some(Change::Raised)).then_some(RaisedBy::Number),
            shown: Shown::Number(step.number),
            ring,
            frame,
        };
        self.push(monitor, &evidence, said);
    }

    fn is_raised(&self) -> bool {
        self.windows.iter().any(Watch::is_raised) || self.spans.iter().any(SpanWatch::is_raised)
    }

    /// The next window does not continue the last one.
    pub fn begin_stretch(&mut self) {
        for watch in &mut self.windows {
            watch.begin_stretch();
        }
    }

    /// Says what a window or a span has changed.
    pub fn push(&mut self, monitor: &Monitor, evidence: &Evidence<'_>, said: &mut Vec<Said>) {
        let [first, last] = evidence.stamps;
        let seen = &mut self.seen[evidence.watcher];
        let usual_until = seen.usual_until;
        seen.unusual = evidence.unusual;
        match evidence.unusual {
            true => seen.usual_from = None,
            false => {
                seen.usual_from = seen.usual_from.or(Some(first));
                seen.usual_until = Some(last);
            }
        }
        let Some(mut alarm) = self.standing.take() else {
            if let Some(by) = evidence.raised {
                self.raised += 1;
                let since = first_wrong(monitor, evidence, usual_until);
                let alarm = self.raise(monitor, evidence, by, since);
                self.worded = alarm.worst_excess;
                said.push(Said::Alarm(alarm.clone()));
                self.standing = Some(alarm);
            }
            return;
        };
        alarm.at_ns = last;
        alarm.excess = evidence.excess;
        // It stands while anything is beyond its level, and longer while the last of any length is unusual.
        if !self.is_raised() && !self.seen.iter().any(|seen| seen.unusual) {
            let from = self.seen.iter().filter_map(|seen| seen.usual_from).max();
            alarm.alarm = AlarmKind::Ended;
            alarm.ended_ns = Some(from.unwrap_or(first));
            said.push(Said::Alarm(alarm));
            return;
        }
        alarm.alarm = AlarmKind::Standing;
        if evidence.excess > alarm.worst_excess {
            worsen(&mut alarm, evidence);
        }
        if evidence.excess > FAR_WORSE * self.worded {
            self.worded = evidence.excess;
            alarm.why = why(monitor, evidence);
        }
        self.standing = Some(alarm);
    }

    fn raise(
        &self,
        monitor: &Monitor,
        evidence: &Evidence<'_>,
        raised_by: RaisedBy,
        since_ns: i64,
    ) -> Alarm {
        let mut alarm = Alarm {
            alarm: AlarmKind::Raised,
            number: self.raised,
            since_ns,
            raised_ns: evidence.stamps[1],
            at_ns: evidence.stamps[1],
            ended_ns: None,
            raised_by,
            excess: evidence.excess,
            worst_excess: evidence.excess,
            worst_chance: evidence.chance,
            worst_window_ns: evidence.stamps,
            test: String::new(),
            why: why(monitor, evidence),
            groups: Vec::with_capacity(GROUPS),
        };
        worsen(&mut alarm, evidence);
        alarm
    }
}

/// The window is the worst so far.
fn worsen(alarm: &mut Alarm, evidence: &Evidence<'_>) {
    alarm.worst_excess = evidence.excess;
    alarm.worst_chance = evidence.chance;
    alarm.worst_window_ns = evidence.stamps;
    let (statistics, test, scores) = match evidence.shown {
        Shown::Groups(statistics, test, scores) => (statistics, test, scores),
        Shown::Number(number) => {
            NUMBERS.clone_into(&mut alarm.test);
            let (group, chance) = (span_name(number), evidence.chance);
            alarm.groups = vec![GroupChance { group, chance }];
            return;
        }
    };
    let names = statistics.config().statistics.test_names();
    alarm.test = names.get(test).cloned().unwrap_or_default();
    let references = &statistics.calibration().groups;
    let groups = statistics.groups().iter().zip(scores);
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
    let (ring, poses) = (evidence.ring, evidence.poses);
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
