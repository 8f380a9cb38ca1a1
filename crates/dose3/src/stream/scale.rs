//! Windows of one length: the model's, and short ones beside it; and spans of a few steps.

use super::StreamOptions;
use crate::detector::DetectorHeader;
use crate::error::Result;
use dose3_ood::DetectorStatistics;
use dose3_ood::alarm::{AlarmConfig, AlarmReference, SpanLevels};
use dose3_ood::timing::StampLevels;

/// Share of the rate of all spans, where there are any.
const SPANS: f64 = 0.3;
/// Steps from one span that is looked at to the next.
pub(super) const SPAN_EVERY: u64 = 4;
/// Steps without an unusual span that end what a span has raised.
const RECOVERY: u64 = 32;
/// Spans in so many steps.
pub(super) const SPAN_RECOVERY: usize = (RECOVERY / SPAN_EVERY) as usize;

/// Densities and levels for windows of one length.
pub(super) struct Scale {
    /// Poses of a window.
    pub poses: usize,
    pub statistics: DetectorStatistics,
    pub alarm: AlarmReference,
}

/// Spans of one length with the levels of their numbers.
pub(super) struct Span {
    /// Poses of a span.
    pub poses: usize,
    pub levels: SpanLevels,
}

/// Spans of every length, which share their share of the rate.
pub(super) fn spans(header: &DetectorHeader, options: &StreamOptions) -> Vec<Span> {
    let per_hour = SPANS * options.alarms_per_hour / header.spans.len().max(1) as f64;
    let span = |reference: &dose3_ood::alarm::SpanReference| Span {
        poses: reference.steps() + 1,
        levels: reference.levels(per_hour),
    };
    header.spans.iter().map(span).collect()
}

/// What stamps may show as often as alarms may be false; it is an event, not an alarm.
pub(super) fn stamps(header: &DetectorHeader, options: &StreamOptions) -> Option<StampLevels> {
    let timing = header.whole.timing.as_ref();
    timing.map(|timing| timing.levels(options.alarms_per_hour))
}

/// The windows of a verdict first; behind them, where the detector has them, short ones. They share the rate.
pub(super) fn scales(
    header: &DetectorHeader,
    poses: usize,
    every: usize,
    rate: f64,
    options: &StreamOptions,
) -> Result<Vec<Scale>> {
    // A stream measures short windows by their steps of motion alone.
    let set = &header.statistics.config().statistics;
    let of_steps = !(set.needs_trace() || set.needs_window() || set.needs_joint());
    let short = header.short.last();
    let short = short.filter(|short| of_steps && short.stride.is_multiple_of(every));
    let mut lengths = vec![(poses, header.stride, &header.statistics)];
    lengths.extend(short.map(|short| (short.steps + 1, short.stride, &short.statistics)));
    let of_windows = if header.spans.is_empty() {
        1.0
    } else {
        1.0 - SPANS
    };
    let per_hour = of_windows * options.alarms_per_hour / lengths.len() as f64;
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
