//! What can go wrong, said so that a person can mend it: file, line, expected, found, hint.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::ReadOption;

/// Everything this crate refuses to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder could not be opened or read.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The content of a file is not what its format says it must be.
    #[error(transparent)]
    Input(Box<InputError>),
    /// No log, or more than one, where exactly one was asked for.
    #[error("{path}: expected exactly one log, found {found}{names}; hint: {hint}", path = path.display())]
    NotOneLog {
        /// The file or folder that was given.
        path: PathBuf,
        /// How many logs are there.
        found: usize,
        /// The first few of them, for the reader of the message.
        names: String,
        /// What to do about it.
        hint: &'static str,
    },
    /// No log at all where some were asked for.
    #[error("{path}: no log found; hint: {hint}", path = path.display())]
    NoLog {
        /// The file or folder that was given.
        path: PathBuf,
        /// What to do about it.
        hint: &'static str,
    },
    /// A name (format, platform, ...) that nobody knows.
    #[error("unknown {what} `{found}`; expected one of {expected}")]
    UnknownName {
        /// What kind of name was asked for.
        what: &'static str,
        /// The name given.
        found: String,
        /// The names that exist, separated by commas.
        expected: String,
    },
    /// A log has too few poses in one piece for a window.
    #[error(
        "{name}: the longest gap-free stretch has {longest} poses, a window needs {needed}; hint: {hint}"
    )]
    TooShort {
        /// Name of the log.
        name: String,
        /// Poses in its longest gap-free stretch.
        longest: usize,
        /// Poses that a window needs.
        needed: usize,
        /// What to do about it.
        hint: &'static str,
    },
    /// A resampling to a rate that the log does not hold.
    #[error("{name}: recorded at {from:.3} Hz, cannot be brought up to {to:.3} Hz; hint: {hint}")]
    Upsampling {
        /// Name of the log.
        name: String,
        /// Rate of the log in hertz.
        from: f64,
        /// Rate asked for in hertz.
        to: f64,
        /// What to do about it.
        hint: &'static str,
    },
    /// Poses in memory that are no log.
    #[error("{name}: pose {pose}: expected {expected}, found {found}")]
    Memory {
        /// Name of the log.
        name: String,
        /// The pose at fault, counted from 0.
        pose: usize,
        /// What it must be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
    /// A parameter outside its range.
    #[error("{what} must be {expected}, found {found}")]
    Parameter {
        /// Name of the parameter.
        what: &'static str,
        /// The range in words.
        expected: &'static str,
        /// The value given.
        found: String,
    },
}

/// One fault in one file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputError {
    /// The file or folder at fault.
    pub path: PathBuf,
    /// Where in it.
    pub place: Place,
    /// What belongs there.
    pub expected: String,
    /// What is there.
    pub found: String,
    /// What to do about it; may be empty.
    pub hint: String,
    /// The setting that helps, where one does.
    pub option: Option<ReadOption>,
}

/// Where in a file a fault is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of text, counted from 1 as editors do.
    Line(usize),
    /// An array of a stream of `.npy` arrays, counted from 0 as numpy does.
    Array(usize),
    /// A pose of an array or a list, counted from 0.
    Pose(usize),
    /// A message of a topic, counted from 0.
    Message(usize),
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        match self.place {
            Place::File => {}
            Place::Line(line) => write!(f, ":{line}")?,
            Place::Array(array) => write!(f, ": array {array}")?,
            Place::Pose(pose) => write!(f, ": pose {pose}")?,
            Place::Message(message) => write!(f, ": message {message}")?,
        }
        write!(f, ": expected {}, found {}", self.expected, self.found)?;
        if !self.hint.is_empty() {
            write!(f, "; hint: {}", self.hint)?;
        }
        Ok(())
    }
}

impl std::error::Error for InputError {}

impl Error {
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io {
            path: path.to_path_buf(),
            source,
        }
    }

    pub(crate) fn input(
        path: &Path,
        place: Place,
        expected: impl Into<String>,
        found: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        Self::Input(Box::new(InputError {
            path: path.to_path_buf(),
            place,
            expected: expected.into(),
            found: found.into(),
            hint: hint.into(),
            option: None,
        }))
    }

    /// Points to the setting that helps.
    pub(crate) fn option(mut self, option: ReadOption) -> Self {
        if let Self::Input(fault) = &mut self {
            fault.option = Some(option);
        }
        self
    }

    /// The setting of [`crate::LoadOptions`] that would help, where one does.
    pub fn read_option(&self) -> Option<ReadOption> {
        match self {
            Self::Input(fault) => fault.option,
            Self::NotOneLog { found: 0, .. } | Self::NoLog { .. } => Some(ReadOption::Format),
            _ => None,
        }
    }
}
