//! Which of the poses that come are taken, and where stretches begin.

use super::event::Fault;
use super::sampler::Sampler;
use super::stamps::Stamps;
use super::state::{Flat, MOST};
use super::{Event, EventKind, Monitor, Said};
use dose3_datasets::same_rate;
use dose3_lie::nalgebra::Quaternion;
use dose3_lie::project::{orthogonality_error, project};
use dose3_lie::{Pose, Rotation, Vector};
use dose3_ood::timing::StampLevels;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Largest entry of `|R^T R - I|` that is taken for rounding of single precision.
const ROUNDING: f64 = 1e-5;
/// Largest one that is repaired.
pub(super) const REPAIRED: f64 = 1e-3;
/// How far a quaternion's norm may be from 1.
const NORM: f64 = 1e-2;
/// Largest coordinate, metres, as of whole logs.
pub(super) const FARTHEST: f64 = 1e9;
/// Poses whose steps say the rate.
const RATE_POSES: usize = 32;
/// What is wrong again and again is said once in so many nanoseconds.
const AGAIN: i64 = 10_000_000_000;

/// A pose or the beginning of a stretch.
pub(super) enum Taken {
    Pose(i64, Pose),
    NewStretch,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Intake {
    pushed: u64,
    /// Poses not yet fed, with their number; more than one while the rate is being found.
    waiting: VecDeque<(i64, u64, Flat)>,
    /// Number of the last pose fed.
    taken: u64,
    /// The last pose fed.
    last: Option<(i64, Flat)>,
    /// Stamp of the last pose taken in.
    newest: Option<i64>,
    /// Of the poses as they come.
    hertz: Option<f64>,
    /// Whether the rate was told or has been said.
    settled: bool,
    /// The detector's rate; none where poses are counted.
    needed: Option<f64>,
    /// Seconds that end a stretch, where they were told.
    told_gap: Option<f64>,
    reset: Option<f64>,
    late: Muted,
    worst_late: f64,
    doubled: Muted,
    bad: Muted,
    unmeasured: Muted,
    resets: Muted,
    stamps: Stamps,
}

/// Counts what happens again and again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Muted {
    count: u64,
    said: Option<i64>,
}

impl Muted {
    fn fits(&self) -> bool {
        self.count < MOST
    }

    /// The number to be said now, if any.
    fn count(&mut self, stamp: i64) -> Option<u64> {
        self.count += 1;
        let recent = |said: i64| stamp.abs_diff(said) < AGAIN as u64;
        if self.said.is_some_and(recent) {
            return None;
        }
        self.said = Some(stamp);
        Some(std::mem::take(&mut self.count))
    }
}

/// The pose with its rotation as one, as poses of whole logs are checked.
pub(super) fn checked(pose: Pose) -> Result<Pose, Fault> {
    if !pose.is_finite() {
        return Err(Fault::NotFinite);
    }
    if pose.translation.amax() > FARTHEST {
        return Err(Fault::TooFar);
    }
    let matrix = pose.rotation.matrix();
    if orthogonality_error(matrix) <= ROUNDING && matrix.determinant() > 0.0 {
        return Ok(pose);
    }
    match project(matrix, REPAIRED) {
        Ok(projected) => Ok(Pose::new(projected.rotation, pose.translation)),
        Err(_) if *matrix == Rotation::identity().matrix() * 0.0 => Err(Fault::ZeroQuaternion),
        Err(_) => Err(Fault::NoRotation),
    }
}

pub(super) fn checked_quaternion(
    position: [f64; 3],
    quaternion: &Quaternion<f64>,
) -> Result<(), Fault> {
    let finite = |x: &f64| x.is_finite();
    if !position.iter().all(finite) || !quaternion.coords.iter().all(finite) {
        return Err(Fault::NotFinite);
    }
    if position.iter().any(|x| x.abs() > FARTHEST) {
        return Err(Fault::TooFar);
    }
    let norm = quaternion.norm();
    if norm < 1e-6 {
        return Err(Fault::ZeroQuaternion);
    }
    if (norm - 1.0).abs() > NORM {
        return Err(Fault::NoRotation);
    }
    Ok(())
}

impl Intake {
    pub fn new(monitor: &Monitor) -> Self {
        let options = monitor.options();
        Self {
            pushed: 0,
            waiting: VecDeque::with_capacity(RATE_POSES),
            taken: 0,
            last: None,
            newest: None,
            hertz: options.rate_hz,
            settled: false,
            needed: monitor.needs().exacting().then(|| monitor.rate()),
            told_gap: options.max_gap_s,
            reset: monitor.reset(),
            late: Muted::default(),
            worst_late: 0.0,
            doubled: Muted::default(),
            bad: Muted::default(),
            unmeasured: Muted::default(),
            resets: Muted::default(),
            stamps: Stamps::new(),
        }
    }

    /// Whether it can be that of a stream which began as `fresh`, as what comes from a file must.
    pub fn fits(&self, fresh: &Self) -> bool {
        let muted = [
            &self.late,
            &self.doubled,
            &self.bad,
            &self.unmeasured,
            &self.resets,
        ];
        let rates = |hertz: f64| hertz > 0.0 && hertz.is_finite();
        let flats = self.waiting.iter().map(|(.., flat)| flat);
        let mut flats = flats.chain(self.last.iter().map(|(_, flat)| flat));
        (self.needed, self.told_gap, self.reset) == (fresh.needed, fresh.told_gap, fresh.reset)
            && self.pushed < MOST
            && self.hertz.is_none_or(rates)
            && fresh.hertz.is_none_or(|told| self.hertz == Some(told))
            && (!self.settled || self.is_fast_enough() && self.waiting.is_empty())
            && self.waiting.len() < RATE_POSES
            && self.waiting.iter().all(|(_, number, _)| *number < MOST)
            && flats.all(Flat::is_pose)
            && muted.iter().all(|muted| muted.fits())
            && self.taken < MOST
            && self.stamps.fits()
    }

    fn is_fast_enough(&self) -> bool {
        let fast = |hertz: f64, needed: f64| hertz > needed || same_rate(hertz, needed);
        let known = self.hertz;
        known.is_some_and(|hertz| self.needed.is_none_or(|needed| fast(hertz, needed)))
    }

    /// Whether poses are judged as they come, without being brought to another rate.
    pub fn are_samples(&self) -> bool {
        let same = |needed| self.hertz.is_some_and(|hertz| same_rate(hertz, needed));
        self.settled && self.needed.is_none_or(same)
    }

    /// Stamp of the last pose fed in this stretch.
    pub fn last_fed(&self) -> Option<i64> {
        self.last.as_ref().map(|(stamp, _)| *stamp)
    }

    pub fn pushed(&self) -> u64 {
        self.pushed
    }

    /// A pose that is none.
    pub fn refuse(&mut self, stamp: i64, what: Fault, said: &mut Vec<Said>) {
        let pose = self.pushed;
        self.pushed += 1;
        if let Some(count) = self.bad.count(stamp) {
            said.push(event(stamp, pose, EventKind::BadPose { count, what }));
        }
    }

    /// A window that cannot be measured.
    pub fn unmeasured(&mut self, stamp: i64, said: &mut Vec<Said>) {
        if let Some(count) = self.unmeasured.count(stamp) {
            let kind = EventKind::Unmeasured { count };
            said.push(event(stamp, self.pushed.saturating_sub(1), kind));
        }
    }

    /// A sound pose came; answers whether it is taken.
    pub fn arrive(&mut self, stamp: i64, pose: Pose, said: &mut Vec<Said>) -> bool {
        let number = self.pushed;
        self.pushed += 1;
        if let Some(newest) = self.newest.filter(|newest| stamp <= *newest) {
            let back = newest.abs_diff(stamp) as f64 * 1e-9;
            if stamp == newest {
                self.stamps.repeat();
                if let Some(count) = self.doubled.count(stamp) {
                    said.push(event(stamp, number, EventKind::Doubled { count }));
                }
                return false;
            }
            if back <= self.gap() {
                self.worst_late = self.worst_late.max(back);
                if let Some(count) = self.late.count(stamp) {
                    let seconds = std::mem::take(&mut self.worst_late);
                    said.push(event(stamp, number, EventKind::Late { count, seconds }));
                }
                return false;
            }
        }
        self.newest = Some(stamp);
        self.waiting.push_back((stamp, number, Flat::from(&pose)));
        true
    }

    /// What comes before the next pose is a new stretch, whatever its stamp.
    pub fn forget(&mut self) {
        self.last = None;
        self.newest = None;
        self.stamps.begin_stretch();
    }

    /// The next of what waits; nothing while the rate is not known. `ending`: no more will come.
    pub fn next(
        &mut self,
        ending: bool,
        sampler: &mut Sampler,
        said: &mut Vec<Said>,
    ) -> Option<Taken> {
        if !self.settled && !self.settle(ending, sampler, said) {
            return None;
        }
        let &(stamp, number, flat) = self.waiting.front()?;
        if let Some((last, before)) = &self.last {
            let seconds = stamp.saturating_sub(*last) as f64 * 1e-9;
            let kind = if stamp <= *last {
                Some(EventKind::ClockBack { seconds: -seconds })
            } else if seconds > self.gap() {
                Some(EventKind::Gap { seconds })
            } else {
                let metres = length(&(flat.pose().translation - before.pose().translation));
                let jumped = self.reset.is_some_and(|reset| metres > reset);
                jumped.then_some(EventKind::Reset { count: 0, metres })
            };
            if let Some(kind) = kind {
                self.begin(stamp, number, kind, said);
                return Some(Taken::NewStretch);
            }
        }
        self.waiting.pop_front();
        self.last = Some((stamp, flat));
        self.taken = number;
        Some(Taken::Pose(stamp, flat.pose()))
    }

    /// Looks at the stamp of a pose that was taken; `sorted` is a buffer.
    pub fn look_at_stamp(
        &mut self,
        stamp: i64,
        levels: &StampLevels,
        sorted: &mut Vec<f64>,
        said: &mut Vec<Said>,
    ) {
        let (period, pose) = (self.hertz.map_or(0.0, f64::recip), self.taken);
        self.stamps.push(stamp, period, levels, sorted, |finding| {
            said.push(event(stamp, pose, EventKind::Stamps(finding)));
        });
    }

    /// A new stretch begins; an estimator that jumps again and again is told once in a while.
    fn begin(&mut self, stamp: i64, number: u64, kind: EventKind, said: &mut Vec<Said>) {
        self.last = None;
        self.stamps.begin_stretch();
        let kind = match kind {
            EventKind::Reset { metres, .. } => match self.resets.count(stamp) {
                Some(count) => EventKind::Reset { count, metres },
                None => return,
            },
            other => other,
        };
        said.push(event(stamp, number, kind));
    }

    /// Seconds without a pose that end a stretch.
    fn gap(&self) -> f64 {
        let usual = self.hertz.map_or(0.0, |hertz| 10.0 / hertz);
        self.told_gap.unwrap_or(usual.max(0.5))
    }

    /// Finds the rate, and what is to be done about it.
    fn settle(&mut self, ending: bool, sampler: &mut Sampler, said: &mut Vec<Said>) -> bool {
        let hertz = match self.hertz {
            Some(hertz) => hertz,
            None if self.waiting.len() < RATE_POSES && !ending => return false,
            None => match self.median_rate() {
                Some(hertz) => hertz,
                None => {
                    self.backwards(said);
                    return false;
                }
            },
        };
        let Some(&(stamp, number, _)) = self.waiting.back() else {
            return false;
        };
        let needed = self.needed.filter(|needed| !same_rate(hertz, *needed));
        if let Some(needed_hz) = needed.filter(|needed| hertz < *needed) {
            said.push(event(
                stamp,
                number,
                EventKind::TooSlow { hertz, needed_hz },
            ));
            self.waiting.clear();
            return false;
        }
        let judged_hz = needed.unwrap_or(hertz);
        said.push(event(stamp, number, EventKind::Rate { hertz, judged_hz }));
        sampler.set_as_they_are(needed.is_none());
        self.hertz = Some(hertz);
        self.settled = true;
        true
    }

    /// No step leads forward: nothing can be made of what waits, but of the last.
    fn backwards(&mut self, said: &mut Vec<Said>) {
        let last = self.waiting.len().saturating_sub(1);
        let stamps = (
            self.waiting.get(last),
            self.waiting.get(last.wrapping_sub(1)),
        );
        if let (Some((stamp, number, _)), Some((before, ..))) = stamps {
            let seconds = before.abs_diff(*stamp) as f64 * 1e-9;
            said.push(event(*stamp, *number, EventKind::ClockBack { seconds }));
        }
        self.waiting.drain(..last);
    }

    /// One over the median step of the poses that wait.
    fn median_rate(&self) -> Option<f64> {
        let stamps = self.waiting.iter().map(|(stamp, ..)| *stamp);
        let later = stamps.clone().skip(1);
        let mut steps: Vec<i64> = stamps
            .zip(later)
            .map(|(a, b)| b.saturating_sub(a))
            .filter(|step| *step > 0)
            .collect();
        let middle = steps.len() / 2;
        if steps.is_empty() {
            return None;
        }
        let (_, median, _) = steps.select_nth_unstable(middle);
        Some(1e9 / *median as f64)
    }
}

/// The length of a vector whose square may overflow; never infinite.
fn length(vector: &Vector) -> f64 {
    let largest = vector.amax();
    if largest == 0.0 || !largest.is_finite() {
        return largest.min(f64::MAX);
    }
    ((vector / largest).norm() * largest).min(f64::MAX)
}

fn event(stamp_ns: i64, pose: u64, kind: EventKind) -> Said {
    Said::Event(Event {
        stamp_ns,
        pose,
        kind,
    })
}
