//! Detectors: a model, and what trusted logs look like to it.

mod extent;
mod fit;
mod header;
mod judge;
mod loaded;
mod options;
mod short;
mod span;
mod summary;
mod trial;
mod whole;

pub use fit::{DetectorBuilder, Fitted, LeftOut};
use header::SEALED;
pub use header::{DetectorHeader, KEY, VERSION};
pub use judge::JudgeOptions;
pub use options::{Defaults, FitOptions, MOTION_SHARES, MOTION_STATISTICS};
pub use short::{SHORT_STEPS, ShortWindows};
pub use summary::{DetectorSummary, OddGroup, QuantitySummary};
pub use whole::{CALIBRATION_SHARE, TIMING_SHARE, WholeFindings, WholeReference};

use crate::atomic;
use crate::backend::Computing;
use crate::error::{Error, Result};
use crate::logs::Needs;
use crate::model_file::{self, Model};
use crate::seal;
use dose3_datasets::Trajectory;
use dose3_model::Precision;
use dose3_ood::statistics::LinearPredictor;
use loaded::Loaded;
use std::path::Path;

/// A detector: judges logs by what it learnt from trusted ones.
///
/// It carries its model, so one value (and one file) judges a log. Networks are loaded when the first log is judged
/// and then kept; threads may judge by one detector, one after another.
#[derive(Clone, Debug, PartialEq)]
pub struct Detector {
    model: Model,
    header: DetectorHeader,
    computing: Computing,
    loaded: Loaded,
}

impl Detector {
    /// Fits a detector to trusted logs with the built-in model of body-frame motion and settings that were measured
    /// to be good; [`Detector::builder`] has the others. No network is trained.
    ///
    /// # Errors
    /// No log; logs that do not fit together or are shorter than every window (33 poses); too few windows.
    pub fn fit(trusted: &[Trajectory]) -> Result<Self> {
        Self::builder().fit(trusted)
    }

    /// Settings of a fit.
    #[must_use]
    pub fn builder() -> DetectorBuilder {
        DetectorBuilder::default()
    }

    fn new(model: Model, header: DetectorHeader, computing: Computing) -> Self {
        Self {
            model,
            header,
            computing,
            loaded: Loaded::default(),
        }
    }

    /// The model it carries.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The fitted part.
    #[must_use]
    pub fn header(&self) -> &DetectorHeader {
        &self.header
    }

    /// What predicts each axis of the motion from the others; none where no statistic needs it.
    pub(crate) fn linear(&self) -> Option<&LinearPredictor> {
        self.header.reference.linear.as_ref()
    }

    /// The same detector, whose networks run elsewhere. Scores agree to rounding.
    #[must_use]
    pub fn on(self, computing: Computing) -> Self {
        Self::new(self.model, self.header, computing)
    }

    /// What a log must be like to be judged.
    #[must_use]
    pub fn needs(&self) -> Needs {
        Needs {
            representation: self.model.header.representation,
            metric: self
                .header
                .statistics
                .config()
                .statistics
                .needs_increments(),
            rate: self.header.rate,
            frame: self.header.frame,
        }
    }

    /// Serialises the detector. Weights are kept as f32: they are the ones it was fitted with.
    ///
    /// # Errors
    /// A header that cannot be serialised.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let json = model_file::json("detector", &self.header)?;
        let [digest, mark] = seal::entries();
        let bytes = self
            .model
            .to_bytes(Precision::F32, &[(KEY, json), digest, mark])?;
        seal::close("detector", bytes)
    }

    /// Reads a detector and checks all of it.
    ///
    /// # Errors
    /// Bytes that are no detector or not those that were written, a version from the future, parts that contradict each
    /// other.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let (model, mut metadata) = Model::from_bytes(bytes)?;
        let json = metadata.remove(KEY).ok_or(Error::NotADetector)?;
        let version = DetectorHeader::version(&json)?;
        seal::check("detector", bytes, &mut metadata, version >= SEALED)?;
        let header = DetectorHeader::read(&json, &model)?;
        Ok(Self::new(model, header, Computing::default()))
    }

    /// Reads a detector file.
    ///
    /// # Errors
    /// As [`Detector::from_bytes`], with the path.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let read = model_file::read("detector", path, Self::from_bytes);
        let Err(error @ Error::File { .. }) = read else {
            return read;
        };
        // The two are easily given in each other's place.
        match Self::is_file(path) || model_file::is_model(path) {
            true => Err(error),
            false => match dose3_datasets::load(path, &dose3_datasets::LoadOptions::default()) {
                Ok(log) => Err(Error::LogForDetector {
                    path: path.to_path_buf(),
                    poses: log.len(),
                }),
                Err(_) => Err(error),
            },
        }
    }

    /// Whether a file says that it is a detector, whatever else is wrong with it.
    #[must_use]
    pub fn is_file(path: impl AsRef<Path>) -> bool {
        model_file::has_key(path.as_ref(), KEY)
    }

    /// Writes a detector file, whole or not at all.
    ///
    /// # Errors
    /// As [`Detector::to_bytes`], or where the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        atomic::write(path.as_ref(), &self.to_bytes()?)
    }
}
