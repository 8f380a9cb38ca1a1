//! Poses at the detector's rate, in a fixed phase: every stretch is sampled from its own first stamp on, as
//! [`dose3_datasets::resample`] does with a whole log.

use super::state::Flat;
use dose3_lie::{Pose, se3};
use serde::{Deserialize, Serialize};

/// Turns arriving poses into samples. At most two poses are kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sampler {
    /// Nanoseconds from one sample to the next.
    period: f64,
    /// Poses are samples as they are; else they are interpolated.
    as_they_are: bool,
    /// First stamp of the stretch.
    first: Option<i64>,
    /// Number of the next sample within the stretch.
    index: u64,
    /// Stamp of the last sample of the stretch.
    last_sample: Option<i64>,
    before: Option<(i64, Flat)>,
    latest: Option<(i64, Flat)>,
    /// Whether the latest pose still waits, where poses are samples as they are.
    waiting: bool,
    /// Whether the stretch has ended: the last sample may lie half a nanosecond behind the last pose.
    ended: bool,
}

impl Sampler {
    pub fn new(hertz: f64) -> Self {
        Self {
            period: 1e9 / hertz,
            as_they_are: false,
            first: None,
            index: 0,
            last_sample: None,
            before: None,
            latest: None,
            waiting: false,
            ended: false,
        }
    }

    /// Whether it can be that of a stream which began as `fresh` and has taken all samples that are due, as what comes
    /// from a file must.
    pub fn fits(&self, fresh: &Self) -> bool {
        if self.period.to_bits() != fresh.period.to_bits() || self.ended {
            return false;
        }
        let mut flats = self.before.iter().chain(&self.latest);
        if !flats.all(|(_, flat)| flat.is_pose()) {
            return false;
        }
        let Some((latest, _)) = self.latest else {
            return self.before.is_none() && self.first.is_none() && self.index == 0;
        };
        let Some(first) = self.first else {
            return false;
        };
        let before = self.before.as_ref().map_or(first, |(before, _)| *before);
        let ordered = first <= before && before <= latest && latest.checked_sub(first).is_some();
        if self.as_they_are {
            return ordered && !self.waiting && self.index == 0;
        }
        let last = self.last_sample;
        let sampled = last.is_some_and(|last| first <= last && last <= latest);
        let next = self.index.checked_mul(self.period.ceil() as u64).is_some()
            && self.offset(self.index) > latest.saturating_sub(first)
            && self.offset(self.index.saturating_sub(1)) <= latest.saturating_sub(first);
        ordered && sampled && next
    }

    /// Stamp of the latest pose of the stretch.
    pub fn latest(&self) -> Option<i64> {
        self.latest.as_ref().map(|(stamp, _)| *stamp)
    }

    /// Stamp of the last sample of the stretch.
    pub fn last_sample(&self) -> Option<i64> {
        match self.as_they_are {
            true => self.latest(),
            false => self.last_sample,
        }
    }

    /// Whether poses are samples as they are.
    pub fn takes_as_they_are(&self) -> bool {
        self.as_they_are
    }

    /// Nanoseconds from the first stamp to a sample.
    fn offset(&self, index: u64) -> i64 {
        (index as f64 * self.period).round() as i64
    }

    /// Takes poses as samples, or samples between them.
    pub fn set_as_they_are(&mut self, as_they_are: bool) {
        self.as_they_are = as_they_are;
    }

    /// The next pose of the stretch. All samples that are due must have been taken.
    pub fn arrive(&mut self, stamp: i64, pose: Pose) {
        self.first.get_or_insert(stamp);
        self.before = self.latest.take();
        self.latest = Some((stamp, Flat::from(&pose)));
        self.waiting = true;
    }

    /// No pose of the stretch will come.
    pub fn end(&mut self) {
        self.ended = true;
    }

    /// A new stretch.
    pub fn begin(&mut self) {
        (self.first, self.before, self.latest) = (None, None, None);
        self.last_sample = None;
        (self.index, self.waiting, self.ended) = (0, false, false);
    }

    /// The next sample that is due.
    pub fn next(&mut self) -> Option<(i64, Pose)> {
        let (latest, pose) = self.latest.as_ref()?;
        if self.as_they_are {
            return std::mem::take(&mut self.waiting).then(|| (*latest, pose.pose()));
        }
        let first = self.first?;
        loop {
            let offset = self.index as f64 * self.period;
            // Behind the end of time nothing is due.
            let stamp = first.checked_add(self.offset(self.index))?;
            // Half a nanosecond of grace, so that rounding of the stamps does not cost the last pose.
            let due = match self.ended {
                true => offset <= (*latest - first) as f64 + 0.5,
                false => stamp <= *latest,
            };
            if !due {
                return None;
            }
            self.index += 1;
            if self.last_sample.is_some_and(|last| last >= stamp) {
                continue;
            }
            self.last_sample = Some(stamp);
            return Some((stamp, self.at(stamp)?));
        }
    }

    /// The pose at a stamp that is not beyond the latest pose by more than rounding.
    fn at(&self, stamp: i64) -> Option<Pose> {
        let (latest, pose) = self.latest.as_ref()?;
        let after = pose.pose();
        let Some((before, from)) = self.before.as_ref().filter(|_| stamp < *latest) else {
            return Some(after);
        };
        let share = (stamp - before) as f64 / (latest - before) as f64;
        Some(se3::interpolate(&from.pose(), &after, share))
    }
}
