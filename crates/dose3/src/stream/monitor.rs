//! What all streams by one detector share: densities, levels, networks, buffers.

use super::scale::{Scale, scales};
use super::{Stream, StreamOptions, frame_error};
use crate::detector::{Detector, DetectorHeader};
use crate::error::Result;
use crate::logs::Needs;
use crate::probe::Probe;
use dose3_datasets::Frame;
use dose3_ood::Score;
use dose3_ood::alarm::AlarmReference;
use serde_json::json;
use sha2::{Digest, Sha256};
use std::sync::{Arc, Mutex, PoisonError};

pub(super) use super::measure::Work;

/// A detector made ready to judge streams; see [`Detector::monitor`].
pub struct Monitor {
    pub(super) header: DetectorHeader,
    needs: Needs,
    options: StreamOptions,
    poses: usize,
    every: usize,
    scales: Vec<Scale>,
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
        let options_said = json!(options).to_string();
        let digest = Sha256::new().chain_update(said).chain_update(options_said);
        let fingerprint = digest.finalize()[..8]
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        Ok(Self {
            template: Work::new(scales.iter().map(|scale| &scale.statistics))?,
            header,
            needs,
            options: *options,
            poses,
            every,
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
