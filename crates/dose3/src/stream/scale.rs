//! Windows of one length: the model's, and short ones beside it.

use super::StreamOptions;
use crate::detector::DetectorHeader;
use crate::error::Result;
use dose3_ood::DetectorStatistics;
use dose3_ood::alarm::{AlarmConfig, AlarmReference};

/// Densities and levels for windows of one length.
pub(super) struct Scale {
    /// Poses of a window.
    pub poses: usize,
    pub statistics: DetectorStatistics,
    pub alarm: AlarmReference,
}

/// The windows of a verdict first; behind them, where the detector has them, short ones. They share the rate.
pub(super) fn scales(
    header: &DetectorHeader,
    poses: usize,
    every: usize,
    rate: f64,
    options: &StreamOptions,
) -> Result<Vec<Scale>> {
    let short = header.short.as_ref();
    let short = short.filter(|short| short.stride.is_multiple_of(every));
    let mut lengths = vec![(poses, header.stride, &header.statistics)];
    lengths.extend(short.map(|short| (short.poses, short.stride, &short.statistics)));
    let per_hour = options.alarms_per_hour / lengths.len() as f64;
    let scale = |(poses, stride, statistics): (usize, usize, &DetectorStatistics)| {
        let config = AlarmConfig {
            per_hour,
            spacing: stride / every,
            overlap: (poses - 1).div_ceil(every).max(1),
            trusted_every: stride as f64 / rate,
        };
        Ok(Scale {
            poses,
            alarm: AlarmReference::new(statistics, config)?,
            statistics: statistics.clone(),
        })
    };
    lengths.into_iter().map(scale).collect()
}
