//! What all streams by one detector share: densities, levels, networks, buffers.

use super::scale::{Scale, Span, scales, spans, stamps};
use super::{Stream, StreamOptions, frame_error};
use crate::detector::{Detector, DetectorHeader};
use crate::error::Result;
use crate::logs::Needs;
use crate::probe::Probe;
use dose3_datasets::Frame;
use dose3_ood::Score;
use dose3_ood::alarm::AlarmReference;
use dose3_ood::timing::StampLevels;
use serde_json::json;
use sha2::{Digest, Sha256};
use std::sync::{Arc, Mutex, PoisonError};

pub(super) use super::measure::Work;

/// How far the groups of trusted logs are apart; see [`Monitor::apart`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Apart {
    /// Groups that would raise an alarm.
    pub groups: usize,
    /// Groups.
    pub of: usize,
    /// Hours of trusted windows.
    pub hours: f64,
    /// Alarms an hour that are allowed.
    pub asked: f64,
}

/// So seldom would as many groups raise an alarm by chance that it is said.
const SELDOM: f64 = 0.05;

impl Apart {
    /// Whether they are so many that the rate cannot be promised.
    #[must_use]
    pub fn breaks_the_promise(&self) -> bool {
        // Chance of fewer under a Poisson distribution.
        let mean = self.asked * self.hours;
        let mut term = (-mean).exp();
        let mut fewer = 0.0;
        for count in 0..self.groups {
            fewer += term;
            term *= mean / (count + 1) as f64;
        }
        self.groups > 0 && 1.0 - fewer < SELDOM
    }
}

impl std::fmt::Display for Apart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            groups,
            of,
            hours,
            asked,
        } = self;
        write!(
            f,
            "{groups} of {of} groups of trusted logs, {hours:.2} hours together, would raise an alarm if the others alone \
             had set the levels: they differ from each other by more than {asked} alarms an hour allows. Logs of a rig or a \
             place that the trusted ones lack will raise more"
        )
    }
}

/// A detector made ready to judge streams; see [`Detector::monitor`].
pub struct Monitor {
    pub(super) header: DetectorHeader,
    needs: Needs,
    options: StreamOptions,
    poses: usize,
    every: usize,
    scales: Vec<Scale>,
    spans: Vec<Span>,
    /// Of stamps, where the trusted logs have some.
    stamps: Option<StampLevels>,
    /// Networks, or a representation, where the statistics need more than steps of motion.
    pub(super) probe: Option<Mutex<Probe>>,
    fingerprint: String,
    /// Buffers that no stream uses at the moment.
    spare: Mutex<Vec<Work>>,
    template: Work,
}

impl Monitor {
    pub(super) fn new(detector: &Detector, options: &StreamOptions) -> Result<Self> {
        let header = detector.header().clone();
        options.check(header.stride)?;
        let every = options.every(header.stride);
        let model = &detector.model().header;
        let poses = model
            .representation
            .kind
            .poses(header.window.unwrap_or(model.window));
        let set = &header.statistics.config().statistics;
        let probe = match set.needs_trace() || set.needs_window() || set.needs_joint() {
            true => Some(Mutex::new(detector.probe()?)),
            false => None,
        };
        let needs = detector.needs();
        let scales = scales(&header, poses, every, needs.rate, options)?;
        let said = serde_json::to_vec(&header).map_err(|reason| crate::Error::Header {
            what: "detector",
            reason,
        })?;
        // Whether windows are told changes no state.
        let said_of = StreamOptions {
            windows: true,
            ..*options
        };
        let options_said = json!(said_of).to_string();
        let digest = Sha256::new().chain_update(said).chain_update(options_said);
        let fingerprint = digest.finalize()[..8]
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        Ok(Self {
            template: Work::new(scales.iter().map(|scale| &scale.statistics))?,
            needs,
            options: *options,
            poses,
            every,
            spans: spans(&header, options),
            stamps: stamps(&header, options),
            header,
            scales,
            probe,
            fingerprint,
            spare: Mutex::default(),
        })
    }

    /// A stream of poses of a body whose axes are those of `frame`.
    ///
    /// # Errors
    /// A frame that the detector does not take.
    pub fn stream(self: &Arc<Self>, frame: Frame) -> Result<Stream> {
        if self.needs.exacting() && !self.needs.accepts(frame) {
            return Err(frame_error(frame, self.needs.frame));
        }
        Ok(Stream::new(self.clone(), frame))
    }

    /// The options.
    #[must_use]
    pub fn options(&self) -> &StreamOptions {
        &self.options
    }

    /// The levels of the alarm, and what they rest on: by the windows of verdicts, then, where the detector has them, by
    /// short ones.
    pub fn alarms(&self) -> impl Iterator<Item = &AlarmReference> {
        self.scales.iter().map(|scale| &scale.alarm)
    }

    pub(super) fn scales(&self) -> &[Scale] {
        &self.scales
    }

    pub(super) fn stamps(&self) -> Option<&StampLevels> {
        self.stamps.as_ref()
    }

    pub(super) fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// Poses of the longest window or span.
    pub(super) fn longest(&self) -> usize {
        let spans = self.spans.iter().map(|span| span.poses);
        spans.fold(self.poses, usize::max)
    }

    /// Poses of the shortest window or span: before there are so many, nothing is known.
    #[must_use]
    pub fn first_look(&self) -> usize {
        let windows = self.scales.iter().map(|scale| scale.poses);
        let spans = self.spans.iter().map(|span| span.poses);
        windows.chain(spans).fold(self.poses, usize::min)
    }

    /// What the trusted logs themselves say of the rate: groups of them that would raise an alarm if the others alone had
    /// set the levels, and the hours that they are. Where these are more than the rate allows, logs that are as unlike the
    /// trusted ones as these are unlike each other raise more alarms than were asked for.
    #[must_use]
    pub fn apart(&self) -> Apart {
        let mut groups: Vec<usize> = self
            .alarms()
            .flat_map(|a| a.basis().apart.clone())
            .collect();
        groups.sort_unstable();
        groups.dedup();
        Apart {
            groups: groups.len(),
            of: self.alarms().map(|a| a.basis().groups).max().unwrap_or(0),
            hours: self.alarms().map(|a| a.basis().hours).fold(0.0, f64::max),
            asked: self.options.alarms_per_hour,
        }
    }

    /// Poses a second that are judged.
    #[must_use]
    pub fn rate(&self) -> f64 {
        self.needs.rate
    }

    /// Poses of a window.
    #[must_use]
    pub fn poses(&self) -> usize {
        self.poses
    }

    /// Poses from one window to the next.
    #[must_use]
    pub fn every(&self) -> usize {
        self.every
    }

    /// Poses from one window of a verdict to the next.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.header.stride
    }

    /// The frame of the trusted logs.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.needs.frame
    }

    /// Of the detector and the options, 16 hexadecimal digits.
    #[must_use]
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    pub(super) fn needs(&self) -> &Needs {
        &self.needs
    }

    pub(super) fn keeps_poses(&self) -> bool {
        self.probe.is_some() || self.header.ranges.is_some()
    }

    /// Metres a step that are a jump of the world; none where nothing is known of the usual step.
    pub(super) fn reset(&self) -> Option<f64> {
        let usual = self.needs.representation.scaling.stored();
        let usual = usual.filter(|_| self.needs.exacting());
        let largest = usual.map(|(axes, _)| axes.into_iter().fold(0.0, f64::max));
        self.options.reset_m.or(largest.map(|usual| 100.0 * usual))
    }

    pub(super) fn borrow(&self) -> Work {
        let spare = self.spare().pop();
        spare.unwrap_or_else(|| self.template.clone())
    }

    pub(super) fn give_back(&self, work: Work) {
        self.spare().push(work);
    }

    fn spare(&self) -> std::sync::MutexGuard<'_, Vec<Work>> {
        // Buffers hold nothing that a result depends on.
        self.spare.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn p_value(&self, score: Score) -> f64 {
        let calibration = self.header.statistics.calibration();
        calibration.windows.p_value(score)
    }

    pub(super) fn is_beyond(&self, score: Score) -> bool {
        score > self.header.statistics.calibration().threshold
    }
}

#[cfg(test)]
mod tests {
    use super::Apart;

    #[test]
    fn more_groups_than_chance_allows_break_the_promise() {
        let of = |groups, hours| Apart {
            groups,
            of: 10,
            hours,
            asked: 1.0,
        };
        assert!(!of(0, 0.5).breaks_the_promise());
        // One in half an hour has a chance of .39, three of .014.
        assert!(!of(1, 0.5).breaks_the_promise());
        assert!(of(3, 0.5).breaks_the_promise());
        assert!(!of(3, 3.0).breaks_the_promise());
        assert!(of(3, 0.5).to_string().starts_with("3 of 10 groups"));
    }
}
