//! One log in memory.

use std::path::PathBuf;
use std::sync::Arc;

use dose3_lie::Pose;
use sha2::{Digest, Sha256};

use crate::hex::hex;
use crate::memory;
use crate::stretch;
use crate::{Error, Format, Frame, LoadReport, Rate, RateSource, RowKind, Source, StampUnit};

/// One log: poses of a body in a fixed world, in order of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Short name, unique among the logs loaded together: KITTI `00`, RobotCar the traversal.
    pub name: String,
    /// Logs of one group stay together in every split (the same video, the same drive). The name, unless known better.
    pub group: String,
    /// Where it was read from; empty for synthetic logs.
    pub path: PathBuf,
    /// How it was written.
    pub format: Format,
    /// What the body's axes are.
    pub frame: Frame,
    /// Poses a second.
    pub rate: Rate,
    /// Nanoseconds, strictly increasing, one per pose. From an epoch of the data set's own choice.
    pub stamps: Vec<i64>,
    /// `T_world_body`, metres, one per stamp, all finite.
    pub poses: Vec<Pose>,
    /// Where in the user's file each pose stands, one per pose, counted as [`Self::row_kind`] says. For a
    /// resampled log the row of the recorded pose nearest in time.
    pub rows: Vec<u64>,
    /// What [`Self::rows`] count.
    pub row_kind: RowKind,
    /// The unit of the stamps in the file; `None` where the file has none.
    pub stamp_unit: Option<StampUnit>,
    /// Stamps and rows as they were recorded, where the log was resampled since; `None` where its own are those.
    pub source: Option<Arc<Source>>,
    /// Indices of poses that do not continue the pose before, whatever their stamps say. Increasing.
    pub breaks: Vec<usize>,
    /// A step longer than this many seconds ends a stretch; `None` is the rule of [`crate::stretches`].
    pub max_gap: Option<f64>,
    /// What was repaired while reading.
    pub report: LoadReport,
}

impl Trajectory {
    /// A log from parts, its rate taken from the median step of the stamps; `group` is `name`.
    ///
    /// `stamps` must be as many as `poses` and strictly increasing; with fewer than two poses the rate is 1 Hz.
    pub fn new(
        name: impl Into<String>,
        format: Format,
        frame: Frame,
        stamps: Vec<i64>,
        poses: Vec<Pose>,
    ) -> Self {
        debug_assert_eq!(stamps.len(), poses.len());
        debug_assert!(stamps.windows(2).all(|pair| pair[0] < pair[1]));
        let name = name.into();
        let hertz = stretch::median_step(&stamps).map_or(1.0, |step| 1.0 / step);
        Self {
            group: name.clone(),
            name,
            path: PathBuf::new(),
            format,
            frame,
            rate: Rate {
                hertz,
                source: RateSource::Stamps,
            },
            rows: (0..poses.len() as u64).collect(),
            row_kind: RowKind::Record,
            stamp_unit: Some(StampUnit::Nanoseconds),
            source: None,
            stamps,
            poses,
            breaks: Vec::new(),
            max_gap: None,
            report: LoadReport::default(),
        }
    }

    /// A log from poses in memory: `T_world_body` in metres, one stamp each, in nanoseconds from any epoch. Its
    /// rate is one over the median step of the stamps, its group its name.
    ///
    /// Rotations off by more than rounding (1e-5) are replaced by the nearest rotation, as readers of files do;
    /// [`Self::report`] counts them.
    ///
    /// # Errors
    /// [`Error::Memory`] with the pose at fault: another number of stamps than of poses, fewer than two of them,
    /// stamps that do not increase, numbers that are not finite, coordinates beyond 1e9 m, matrices that are no
    /// rotations (off by more than 1e-3).
    ///
    /// ```
    /// use dose3_datasets::{Frame, Trajectory};
    /// use dose3_lie::nalgebra::{Isometry3, Vector3};
    ///
    /// let ahead = |x| Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::zeros());
    /// let log = Trajectory::from_poses("ahead", Frame::BodyFlu, vec![0, 100_000_000], [ahead(0.0), ahead(1.5)])?;
    /// assert_eq!((log.len(), log.rate.hertz, log.distance()), (2, 10.0, 1.5));
    /// assert!(Trajectory::from_poses("still", Frame::BodyFlu, vec![5, 5], [ahead(0.0), ahead(1.5)]).is_err());
    /// # Ok::<(), dose3_datasets::Error>(())
    /// ```
    pub fn from_poses<P: Into<Pose>>(
        name: impl Into<String>,
        frame: Frame,
        stamps_ns: impl Into<Vec<i64>>,
        poses: impl IntoIterator<Item = P>,
    ) -> Result<Self, Error> {
        let (name, stamps) = (name.into(), stamps_ns.into());
        let mut poses: Vec<Pose> = poses.into_iter().map(Into::into).collect();
        let report = memory::check(&name, &stamps, &mut poses)?;
        Ok(Self {
            report,
            ..Self::new(name, Format::Memory, frame, stamps, poses)
        })
    }

    /// The stamps as recorded, nanoseconds: those before a resampling, else [`Self::stamps`].
    pub fn source_stamps(&self) -> &[i64] {
        self.source
            .as_ref()
            .map_or(&self.stamps, |source| &source.stamps)
    }

    /// The rows of [`Self::source_stamps`].
    pub fn source_rows(&self) -> &[u64] {
        self.source
            .as_ref()
            .map_or(&self.rows, |source| &source.rows)
    }

    /// Where pose `index` stands in the user's file: `line 1001`, `pose 17`; `None` beyond the log.
    pub fn place(&self, index: usize) -> Option<String> {
        let row = self.rows.get(index)?;
        Some(format!("{} {row}", self.row_kind))
    }

    /// The stamp of pose `index` (for a resampled log, of the recorded pose nearest to it) in the unit that the
    /// file has, every digit kept; `None` beyond the log or where the file has no stamps.
    pub fn stamp_in_file(&self, index: usize) -> Option<String> {
        let unit = self.stamp_unit?;
        let stamp = *self.stamps.get(index)?;
        let nearest = self.source.as_ref().map_or(Some(stamp), |source| {
            source.stamps.get(source.nearest(stamp)?).copied()
        })?;
        Some(unit.write(nearest))
    }

    /// Number of poses.
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// True without any pose.
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// Seconds from the first to the last stamp.
    pub fn duration(&self) -> f64 {
        match (self.stamps.first(), self.stamps.last()) {
            (Some(first), Some(last)) => last.saturating_sub(*first) as f64 * 1e-9,
            _ => 0.0,
        }
    }

    /// Seconds within gap-free stretches: the time in which [`Self::distance`] was travelled.
    pub fn time_in_stretches(&self) -> f64 {
        stretch::stretches(self, self.max_gap)
            .into_iter()
            .map(|range| self.stamps[range.end - 1].saturating_sub(self.stamps[range.start]))
            .map(|nanoseconds| nanoseconds as f64 * 1e-9)
            .sum()
    }

    /// Metres travelled, summed within gap-free stretches.
    pub fn distance(&self) -> f64 {
        stretch::stretches(self, self.max_gap)
            .into_iter()
            .flat_map(|range| self.poses[range].windows(2))
            .map(|pair| (pair[1].translation - pair[0].translation).norm())
            .sum()
    }

    /// SHA-256 over stamps and poses, 64 hexadecimal digits: names the data a detector was trained on.
    ///
    /// Name, path and format do not enter, so a renamed or converted copy is still recognised where its
    /// numbers are the same to the last bit.
    pub fn fingerprint(&self) -> String {
        let mut hash = Sha256::new();
        hash.update(b"dose3 trajectory 1\0");
        for (stamp, pose) in self.stamps.iter().zip(&self.poses) {
            hash.update(stamp.to_le_bytes());
            // Adding zero turns -0.0 into 0.0: equal poses have equal bytes.
            for value in pose.rotation.matrix().iter().chain(pose.translation.iter()) {
                hash.update((value + 0.0).to_le_bytes());
            }
        }
        hex(hash.finalize())
    }
}

#[cfg(test)]
mod tests {
    use crate::synthetic::{Platform, trajectory};

    #[test]
    fn fingerprint_names_the_numbers_and_nothing_else() {
        let log = trajectory(Platform::Vehicle, 1, 50, 10.0);
        let print = log.fingerprint();
        assert_eq!(print.len(), 64);
        let mut other = log.clone();
        other.name = "renamed".to_owned();
        other.poses[3].translation.x = log.poses[3].translation.x;
        assert_eq!(other.fingerprint(), print);
        other.poses[3].translation.x = log.poses[3].translation.x.next_up();
        assert_ne!(other.fingerprint(), print);
        let mut other = log.clone();
        other.stamps[49] += 1;
        assert_ne!(other.fingerprint(), print);
        let mut other = log.clone();
        other.poses.truncate(49);
        other.stamps.truncate(49);
        assert_ne!(other.fingerprint(), print);
    }

    #[test]
    fn distance_and_duration_are_those_of_the_log() {
        let mut log = trajectory(Platform::Vehicle, 1, 50, 10.0);
        for (index, pose) in log.poses.iter_mut().enumerate() {
            pose.translation = dose3_lie::Vector::new(0.5 * index as f64, 0.0, 0.0);
        }
        assert!((log.distance() - 24.5).abs() < 1e-12);
        assert!((log.duration() - 4.9).abs() < 1e-12);
        // The step into a new stretch is not travelled.
        log.breaks = vec![10];
        assert!((log.distance() - 24.0).abs() < 1e-12);
        assert!((log.time_in_stretches() - 4.8).abs() < 1e-12);
    }
}
