//! What can go wrong. A message is a whole sentence with what was found and what was expected; it names no
//! flag of any program, the fields say what a program needs to name its own.

use crate::backend::Backend;
use dose3_datasets::Frame;
use std::path::PathBuf;

/// The result of everything in this crate that can fail.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Logs that cannot be read, cut into windows or represented.
    #[error(transparent)]
    Data(#[from] dose3_datasets::Error),
    /// Statistics, densities or calibration that cannot be computed.
    #[error(transparent)]
    Statistics(#[from] dose3_ood::Error),
    /// The diffusion process or training.
    #[error(transparent)]
    Diffusion(#[from] dose3_diffusion::Error),
    /// A network, or a file of weights.
    #[error(transparent)]
    Network(#[from] dose3_model::ModelError),
    /// The operating system refused a file.
    #[error("cannot {action} {path}: {reason}", path = path.display())]
    Io {
        /// `read`, `write` or `create`.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What it said.
        reason: std::io::Error,
    },
    /// A file that holds no model or detector that can be used.
    #[error("{path} is not a usable {what} file: {reason}", path = path.display())]
    File {
        /// `model` or `detector`.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: Box<Error>,
    },
    /// A safetensors file of another program.
    #[error("a safetensors file without `{key}` metadata: not written by dose3")]
    NotAModel {
        /// The metadata that is missing.
        key: &'static str,
    },
    /// A model file where a detector was expected.
    #[error("a model that was not fitted to trusted logs, expected a detector")]
    NotADetector,
    /// A pose log where a detector was expected.
    #[error("{path} is a pose log ({poses} poses), expected a detector", path = path.display())]
    LogForDetector {
        /// The file.
        path: PathBuf,
        /// Its poses.
        poses: usize,
    },
    /// A file of a version that this build does not read.
    #[error("{what} format {found}, this build reads {oldest} to {newest}; update dose3")]
    FormatVersion {
        /// `model` or `detector`.
        what: &'static str,
        /// The version of the file.
        found: u32,
        /// The oldest version that can be read.
        oldest: u32,
        /// The newest.
        newest: u32,
    },
    /// Metadata that is not what it must be.
    #[error("the {what} header cannot be read: {reason}")]
    Header {
        /// `model` or `detector`.
        what: &'static str,
        /// What the reader of JSON said.
        reason: serde_json::Error,
    },
    /// Parts of a file or a report that contradict each other.
    #[error("the {what} is not sound: {reason}")]
    Unsound {
        /// `model`, `detector` or `report`.
        what: &'static str,
        /// What contradicts what.
        reason: String,
    },
    /// A setting out of range.
    #[error("the {setting} is {found}, expected {expected}")]
    Setting {
        /// Which one.
        setting: Setting,
        /// Its value.
        found: String,
        /// What it must be.
        expected: String,
    },
    /// A name that nothing has.
    #[error("no {what} is named {found:?}, expected one of {known}")]
    UnknownName {
        /// `backend` or `log`.
        what: &'static str,
        /// The name.
        found: String,
        /// The names there are.
        known: String,
    },
    /// No log where at least one is needed.
    #[error("no log to {purpose}")]
    NoLog {
        /// `fit on`, `train on`, `evaluate on`.
        purpose: &'static str,
    },
    /// A path with no log in it.
    #[error("{path}: no pose log in it", path = path.display())]
    NoLogIn {
        /// The file or folder.
        path: PathBuf,
    },
    /// A log without stamps, whose format has no rate either.
    #[error("log {log} says neither when its poses were nor their rate, {needed:.4} Hz are needed")]
    UnknownRate {
        /// Name of the log.
        log: String,
        /// The rate that is needed, hertz.
        needed: f64,
    },
    /// Every log is held out of training.
    #[error("all {logs} logs are held out, nothing is left to train on")]
    AllHeldOut {
        /// Number of logs.
        logs: usize,
    },
    /// No log of the training has a window.
    #[error("no training log has {poses} poses without a gap, which one window needs")]
    NoWindow {
        /// Poses of a window.
        poses: usize,
    },
    /// A rate was named for a log whose stamps say another.
    #[error("log {log} has stamps, which say {hertz:.4} Hz; a nominal rate is for logs without")]
    HasStamps {
        /// Name of the log.
        log: String,
        /// Its rate, hertz.
        hertz: f64,
    },
    /// A log whose body axes are not those of the trusted logs, or not known.
    #[error("log {log} is in frame {found}, expected {expected}: its body axes must be named")]
    Frame {
        /// Name of the log.
        log: String,
        /// Its body frame.
        found: Frame,
        /// That of the trusted logs.
        expected: Frame,
    },
    /// Training logs of frames that cannot be brought together.
    #[error("log {log} is in frame {found}, log {first} in {expected}: train on one frame")]
    MixedFrames {
        /// Name of the log.
        log: String,
        /// Its body frame.
        found: Frame,
        /// Name of the first log.
        first: String,
        /// The body frame of that.
        expected: Frame,
    },
    /// Training logs of several rates.
    #[error(
        "log {log} has {found:.1} Hz, log {first} {expected:.1} Hz: representation motion needs one rate"
    )]
    MixedRates {
        /// Name of the log.
        log: String,
        /// Its rate, hertz.
        found: f64,
        /// Name of the first log.
        first: String,
        /// The rate of that, hertz.
        expected: f64,
    },
    /// Positions that are hardly metres.
    #[error(
        "log {log} moves {step:.3} m a step, the model's data {expected:.3} m: its positions are \
         hardly metres"
    )]
    NotMetres {
        /// Name of the log.
        log: String,
        /// Its median step at the model's rate, metres.
        step: f64,
        /// The largest scale of the model's data, metres a step.
        expected: f64,
    },
    /// A log that is slower than it must be.
    #[error(
        "log {log} has {found:.4} Hz, {needed:.4} Hz are needed and poses in between cannot be \
         invented; {}",
        if *nominal {
            "its rate is the data set's nominal one, because it has no stamps"
        } else {
            "its rate is that of its stamps"
        }
    )]
    TooSlow {
        /// Name of the log.
        log: String,
        /// Its rate, hertz.
        found: f64,
        /// The rate needed, hertz.
        needed: f64,
        /// Whether its rate is the data set's nominal one.
        nominal: bool,
    },
    /// A fault of one log among several.
    #[error("log {log}: {reason}")]
    Log {
        /// Name of the log.
        log: String,
        /// What is wrong.
        reason: Box<Error>,
    },
    /// Denoising errors of a path on which no noise is drawn.
    #[error(
        "`{statistics}` measures denoising errors, which a path without drawn noise does not have"
    )]
    NoNoise {
        /// The statistics set.
        statistics: String,
    },
    /// Statistics of the joint network with a model that has none.
    #[error("the model has no joint network, which the statistics `joint` and their like ask")]
    NoJointNetwork,
    /// A window that does not lie in the logs it is said to come from.
    #[error("window at pose {start} of log {log} lies outside of the logs")]
    OutsideWindow {
        /// Index of the log.
        log: usize,
        /// First pose.
        start: usize,
    },
    /// A backend that was not built in.
    #[error("this build lacks backend {backend}")]
    MissingBackend {
        /// The backend.
        backend: Backend,
        /// The cargo feature that builds it in.
        feature: &'static str,
    },
    /// Networks that a backend cannot run.
    #[error("cannot set up the networks on backend {backend}: {reason}")]
    Backend {
        /// The backend.
        backend: Backend,
        /// What it said.
        reason: Box<Error>,
    },
    /// A table of results that cannot be written.
    #[error("the table cannot be written: {reason}")]
    Table {
        /// What the writer said.
        reason: String,
    },
    /// The caller's [`Progress`](crate::Progress) asked to end it.
    #[error("stopped before it was done")]
    Stopped,
    /// A checkpoint that this run cannot go on from.
    #[error(
        "{reason}; delete the checkpoint to start afresh, or repeat the settings of the first run"
    )]
    Checkpoint {
        /// What differs.
        reason: dose3_diffusion::Error,
    },
}

/// A setting that can be out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Setting {
    /// Metres in one unit of position.
    Unit,
    /// Rate of logs without stamps, hertz.
    NominalRate,
    /// Diffusion steps visited.
    Steps,
    /// Noise draws a window.
    Draws,
    /// Poses between the starts of windows.
    Stride,
    /// Rate at which logs are measured, hertz.
    MeasuringRate,
    /// Steps of a window.
    Window,
    /// Share of trusted logs that may be rejected.
    Alpha,
    /// Poses a second of a stream.
    Rate,
    /// Seconds without a pose that end a stretch.
    Gap,
    /// Metres a step that are a jump of the estimator's world.
    Reset,
    /// False alarms an hour.
    AlarmsPerHour,
    /// Poses from one window of a stream to the next.
    Every,
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Unit => "unit of position",
            Self::NominalRate => "nominal rate",
            Self::Steps => "number of diffusion steps",
            Self::Draws => "number of noise draws",
            Self::Stride => "stride of windows",
            Self::MeasuringRate => "rate of measurement",
            Self::Window => "length of windows",
            Self::Alpha => "alpha",
            Self::Rate => "rate of the stream",
            Self::Gap => "pause that ends a stretch",
            Self::Reset => "distance of a jump",
            Self::AlarmsPerHour => "number of false alarms an hour",
            Self::Every => "number of poses from window to window",
        })
    }
}

impl Error {
    /// This error, said of a log.
    #[must_use]
    pub fn of_log(self, log: &str) -> Self {
        Self::Log {
            log: log.to_owned(),
            reason: Box::new(self),
        }
    }

    pub(crate) fn io(
        action: &'static str,
        path: &std::path::Path,
    ) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |reason| Self::Io {
            action,
            path,
            reason,
        }
    }

    pub(crate) fn unsound(what: &'static str, reason: impl Into<String>) -> Self {
        Self::Unsound {
            what,
            reason: reason.into(),
        }
    }

    pub(crate) fn setting(
        setting: Setting,
        found: impl ToString,
        expected: impl Into<String>,
    ) -> Self {
        Self::Setting {
            setting,
            found: found.to_string(),
            expected: expected.into(),
        }
    }
}
