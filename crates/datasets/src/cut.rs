//! Parts of a log as logs of their own.

use std::ops::Range;
use std::sync::Arc;

use crate::{Source, Trajectory};

impl Trajectory {
    /// Poses `range` as a log of their own, with the same name and rate. Of the stamps before a resampling it keeps
    /// those from its own first to its own last.
    ///
    /// ```
    /// use dose3_datasets::synthetic;
    ///
    /// let drive = synthetic::trajectory(synthetic::Platform::Vehicle, 7, 400, 10.0);
    /// let piece = drive.cut(100..300);
    /// assert_eq!((piece.len(), piece.poses[0]), (200, drive.poses[100]));
    /// ```
    ///
    /// # Panics
    /// Where the range is not within the log.
    #[must_use]
    pub fn cut(&self, range: Range<usize>) -> Self {
        let stamps = self.stamps[range.clone()].to_vec();
        let source = self.source.as_ref().map(|source| {
            let recorded = match (stamps.first(), stamps.last()) {
                (Some(first), Some(last)) => {
                    let from = source.stamps.partition_point(|stamp| stamp < first);
                    let to = source.stamps.partition_point(|stamp| stamp <= last);
                    from..to.max(from)
                }
                _ => 0..0,
            };
            Arc::new(Source {
                stamps: source.stamps[recorded.clone()].to_vec(),
                rows: source.rows[recorded].to_vec(),
            })
        });
        let within = self
            .breaks
            .iter()
            .filter(|pose| range.start < **pose && **pose < range.end);
        Self {
            name: self.name.clone(),
            group: self.group.clone(),
            path: self.path.clone(),
            breaks: within.map(|pose| pose - range.start).collect(),
            poses: self.poses[range.clone()].to_vec(),
            rows: self.rows[range].to_vec(),
            report: self.report.clone(),
            stamps,
            source,
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::resample;
    use crate::synthetic::{Platform, trajectory};

    #[test]
    fn a_piece_keeps_what_belongs_to_it() {
        let mut log = trajectory(Platform::Vehicle, 1, 200, 20.0);
        log.breaks = vec![40, 100, 150];
        let piece = log.cut(100..160);
        assert_eq!(piece.breaks, [50]);
        assert_eq!(piece.stamps, log.stamps[100..160]);
        assert_eq!(piece.rows, log.rows[100..160]);
        assert_eq!(piece.source_stamps(), piece.stamps);
        assert!(log.cut(10..10).is_empty());

        log.breaks.clear();
        let slow = resample(&log, 10.0).unwrap();
        let piece = slow.cut(20..40);
        assert_eq!(piece.source_stamps(), &log.stamps[40..79]);
        assert_eq!(piece.source_rows(), &log.rows[40..79]);
        assert!(slow.cut(10..10).source_stamps().is_empty());
    }
}
