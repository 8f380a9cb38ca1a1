//! What a detector file says beside its model: everything that fitting decided, each fact once.

use super::extent::{LONGEST, MOST_STRIDE};
use super::short::ShortWindows;
use super::whole::WholeReference;
use crate::error::{Error, Result};
use crate::model_file::{self, FASTEST, LogRecord, Model};
use crate::probe::{MOST_DRAWS, ProbePlan, ProbeReference};
use crate::series::TrustedRanges;
use dose3_datasets::{Frame, Kind};
use dose3_diffusion::NoiseSharing;
use dose3_ood::alarm::SpanReference;
use dose3_ood::{DetectorStatistics, PoseReference};
use serde::{Deserialize, Serialize};

/// Metadata key of [`DetectorHeader`].
pub const KEY: &str = "dose3.detector";
/// Version of [`DetectorHeader`] that this build writes. Version 2 added what single trusted poses look like;
/// version 3 says every fact once, and what statistics learn from the trusted logs; version 4 added the ranges that plain
/// quantities have in trusted logs, a digest of the file, windows of other lengths than the model's, and the joint network.
pub const VERSION: u32 = 4;
/// The first version whose files say their own digest.
pub(super) const SEALED: u32 = 4;
/// The oldest version that this build reads.
const OLDEST: u32 = 1;

/// What a detector file says beside its model. Number of noise draws, their seed and the set of statistics stand in
/// the settings of `statistics`, the representation in the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectorHeader {
    /// Version of this header.
    pub format_version: u32,
    /// Rate of the trusted logs as they were measured, hertz.
    pub rate: f64,
    /// Body frame of the trusted logs.
    pub frame: Frame,
    /// Diffusion steps visited.
    pub steps: usize,
    /// Whether windows share their noise.
    pub noise: NoiseSharing,
    /// Poses between the starts of windows.
    pub stride: usize,
    /// Steps of a window; none: as many as the model's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<usize>,
    /// The trusted logs.
    pub trusted: Vec<LogRecord>,
    /// Densities and calibration.
    pub statistics: DetectorStatistics,
    /// What statistics learnt from the trusted logs before they were computed.
    #[serde(default, skip_serializing_if = "ProbeReference::is_empty")]
    pub reference: ProbeReference,
    /// What trusted poses look like one by one; none in detectors of format 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<PoseReference>,
    /// What trusted logs look like as wholes.
    #[serde(default, skip_serializing_if = "WholeReference::is_empty")]
    pub whole: WholeReference,
    /// Which values plain quantities (speeds, turn rates, their roughness) take in trusted logs; none in detectors of
    /// format 3 and older, and of models that only count poses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ranges: Option<TrustedRanges>,
    /// Short windows, for streams and for short logs, the longer ones first; none in detectors of format 3 and where
    /// networks take windows of the model's length alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub short: Vec<ShortWindows>,
    /// A few steps by single numbers, for streams; none in detectors of format 3 and of models that only count poses.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub spans: Vec<SpanReference>,
    /// Version of the software that fitted it.
    pub version: String,
}

/// Windows of one length, with what trusted ones are like.
#[derive(Clone, Copy)]
pub(crate) struct Windows<'a> {
    /// Steps of a window.
    pub steps: usize,
    /// Poses between their starts.
    pub stride: usize,
    /// Densities and calibration.
    pub statistics: &'a DetectorStatistics,
}

impl DetectorHeader {
    /// The usual windows.
    pub(crate) fn usual(&self, model: &Model) -> Windows<'_> {
        Windows {
            steps: self.window.unwrap_or(model.header.window),
            stride: self.stride,
            statistics: &self.statistics,
        }
    }

    /// How windows are noised.
    #[must_use]
    pub fn plan(&self) -> ProbePlan {
        let config = self.statistics.config();
        ProbePlan {
            steps: self.steps,
            draws: config.draws,
            seed: config.seed,
            sharing: self.noise,
        }
    }

    /// The version that a header says it has.
    ///
    /// # Errors
    /// One that this build does not read, JSON of something else.
    pub(super) fn version(json: &str) -> Result<u32> {
        model_file::check_version("detector", json, OLDEST..=VERSION)
    }

    /// Reads and checks a header of any version that was ever written, for the detector of `model`.
    ///
    /// # Errors
    /// A version from the future, JSON of something else, parts that contradict each other.
    pub(crate) fn read(json: &str, model: &Model) -> Result<Self> {
        let version = Self::version(json)?;
        let header: Self = match version {
            1 | 2 => model_file::from_json::<Before3>("detector", json)?.into_header(model)?,
            _ => model_file::from_json("detector", json)?,
        };
        header.check(model)?;
        Ok(header)
    }

    fn check(&self, model: &Model) -> Result<()> {
        let unsound = |reason: String| Err(Error::unsound("detector", reason));
        let plan = self.plan();
        if self.stride == 0 || self.stride > MOST_STRIDE {
            let found = self.stride;
            return unsound(format!("its stride {found} is not 1 to {MOST_STRIDE}"));
        }
        if plan.draws == 0 || plan.draws > MOST_DRAWS {
            let found = plan.draws;
            return unsound(format!("{found} draws are not 1 to {MOST_DRAWS}"));
        }
        let steps = model.header.process.steps;
        if !(1..=steps).contains(&plan.steps) {
            let found = plan.steps;
            return unsound(format!("it visits {found} diffusion steps of {steps}"));
        }
        if !(self.rate > 0.0 && self.rate <= FASTEST) {
            let found = self.rate;
            return unsound(format!("rate {found} Hz is not above 0 and at most 1e6"));
        }
        if let Some(poses) = &self.poses {
            poses.validate()?;
        }
        if let Some(ranges) = &self.ranges {
            ranges.check()?;
        }
        let set = &self.statistics.config().statistics;
        let usual = self.usual(model).steps;
        let mut longer = usual;
        let sound = |short: &ShortWindows| {
            let sound = short.sound(longer) && short.statistics.config().statistics == *set;
            longer = short.steps;
            sound
        };
        let length = usual > 0 && (usual <= LONGEST || usual == model.header.window);
        if !length || !self.short.iter().all(sound) {
            return unsound("its windows of several lengths do not belong together".into());
        }
        let free = model.header.representation.kind == Kind::Motion && !set.needs_trace();
        if !free && (!self.short.is_empty() || usual != model.header.window) {
            return unsound(format!("`{set}` takes windows of the model's length alone"));
        }
        if set.needs_linear() != self.reference.linear.is_some() {
            return unsound(format!(
                "`{set}` and the linear predictor do not belong together"
            ));
        }
        if set.needs_joint() != self.reference.scale.is_some() {
            return unsound(format!(
                "`{set}` and the scale of the axes do not belong together"
            ));
        }
        let positive = |scale: &[f64; 6]| scale.iter().all(|s| s.is_finite() && *s > 0.0);
        if !self.reference.scale.as_ref().is_none_or(positive) {
            return unsound("the scale of its axes is not positive".into());
        }
        if set.needs_joint() && model.joint.is_none() {
            return Err(Error::NoJointNetwork);
        }
        Ok(())
    }
}

/// Formats 1 and 2, which said representation, draws and seed twice.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Before3 {
    #[serde(rename = "format_version")]
    _format_version: u32,
    needs: NeedsBefore3,
    probe: ProbePlan,
    stride: usize,
    trusted: Vec<LogRecord>,
    statistics: DetectorStatistics,
    #[serde(default)]
    poses: Option<PoseReference>,
    version: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NeedsBefore3 {
    representation: dose3_datasets::Representation,
    #[serde(rename = "metric")]
    _metric: bool,
    rate: f64,
    frame: Frame,
}

impl Before3 {
    fn into_header(self, model: &Model) -> Result<DetectorHeader> {
        let config = self.statistics.config();
        let unsound = |reason: &str| Err(Error::unsound("detector", reason));
        if (config.draws, config.seed) != (self.probe.draws, self.probe.seed) {
            return unsound("draws and seed differ between its parts");
        }
        if self.needs.representation != model.header.representation {
            return unsound("the representations of model and detector differ");
        }
        Ok(DetectorHeader {
            format_version: VERSION,
            rate: self.needs.rate,
            frame: self.needs.frame,
            steps: self.probe.steps,
            noise: self.probe.sharing,
            stride: self.stride,
            window: None,
            trusted: self.trusted,
            statistics: self.statistics,
            reference: ProbeReference::default(),
            poses: self.poses,
            whole: WholeReference::default(),
            ranges: None,
            short: Vec::new(),
            spans: Vec::new(),
            version: self.version,
        })
    }
}
