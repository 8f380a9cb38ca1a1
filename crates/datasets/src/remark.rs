//! What a reader assumed, and what looks wrong in a log that could be read.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Something a person should know about how a log was read or about what it holds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Remark {
    /// What it is about.
    pub kind: RemarkKind,
    /// A sentence for people; rows are named as in the user's file.
    pub text: String,
    /// The setting of [`crate::LoadOptions`] that decides it.
    pub option: Option<ReadOption>,
}

/// Kinds of remark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum RemarkKind {
    /// The unit of the stamps was taken from the header or from the size of the numbers.
    StampUnit,
    /// The stamps count poses instead of telling the time.
    StampsAreAnIndex,
    /// Stamps far from all others, like one of zero among dates; their poses are left out.
    OutlierStamp,
    /// The file says nothing of its rate.
    UnknownRate,
    /// The order of a quaternion was taken from the header or from the data.
    QuaternionOrder,
    /// Unit or convention of angles.
    Angles,
    /// The unit of positions was taken from the header.
    LengthUnit,
    /// Which columns, which topic or which part of the file was taken.
    Columns,
    /// Rows of a table with several logs were not in the order of their stamps, and were sorted.
    Sorted,
    /// Characters, line ends or numbers are written in an unusual way.
    Encoding,
    /// The rate is none that a pose source has.
    ImplausibleRate,
    /// The speed is none that a body has.
    ImplausibleSpeed,
    /// The body turns faster than one can.
    ImplausibleTurning,
    /// The body is tilted as no vehicle is.
    ImplausibleAttitude,
    /// The body moves and never turns.
    ConstantOrientation,
    /// The body frame was taken from elsewhere than the format.
    Frame,
    /// A recording ends within a record, or parts of it cannot be read.
    DamagedRecording,
}

/// A setting of [`crate::LoadOptions`] that a remark or an error can point to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ReadOption {
    /// [`crate::LoadOptions::format`]
    Format,
    /// [`crate::LoadOptions::stamp_unit`]
    StampUnit,
    /// [`crate::LoadOptions::rate`]
    Rate,
    /// [`crate::LoadOptions::columns`]
    Columns,
    /// [`crate::LoadOptions::log_column`]
    LogColumn,
    /// [`crate::LoadOptions::lost`]
    Lost,
    /// [`crate::LoadOptions::topics`]
    Topic,
    /// [`crate::LoadOptions::tf`]
    Tf,
    /// [`crate::LoadOptions::times`]
    Times,
    /// [`crate::Trajectory::frame`], which the caller sets.
    Frame,
    /// Metres in one unit of position, which the caller applies.
    Unit,
}

impl ReadOption {
    /// Its name in lower case, words joined by hyphens.
    pub fn name(self) -> &'static str {
        match self {
            Self::Format => "format",
            Self::StampUnit => "stamp-unit",
            Self::Rate => "rate",
            Self::Columns => "columns",
            Self::LogColumn => "log-column",
            Self::Lost => "lost",
            Self::Topic => "topic",
            Self::Tf => "tf",
            Self::Times => "times",
            Self::Frame => "frame",
            Self::Unit => "unit",
        }
    }
}

impl Remark {
    pub(crate) fn new(kind: RemarkKind, text: impl Into<String>) -> Self {
        Self {
            kind,
            text: text.into(),
            option: None,
        }
    }

    pub(crate) fn option(mut self, option: ReadOption) -> Self {
        self.option = Some(option);
        self
    }

    /// True for what is suspicious, false for what was merely assumed.
    pub fn is_warning(&self) -> bool {
        matches!(
            self.kind,
            RemarkKind::StampsAreAnIndex
                | RemarkKind::Sorted
                | RemarkKind::OutlierStamp
                | RemarkKind::ImplausibleRate
                | RemarkKind::ImplausibleSpeed
                | RemarkKind::ImplausibleTurning
                | RemarkKind::ImplausibleAttitude
                | RemarkKind::ConstantOrientation
                | RemarkKind::DamagedRecording
        )
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Why a row holds no pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum LostKind {
    /// NaN, infinite or empty numbers.
    Nan,
    /// A rotation of zeros.
    Zero,
    /// The identity in the midst of a log that is elsewhere.
    Identity,
}

impl LostKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Nan, Self::Zero, Self::Identity];

    /// `nan`, `zero`, `identity`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nan => "nan",
            Self::Zero => "zero",
            Self::Identity => "identity",
        }
    }
}

impl fmt::Display for LostKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for LostKind {
    type Err = crate::Error;

    fn from_str(text: &str) -> Result<Self, crate::Error> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name().eq_ignore_ascii_case(text))
            .ok_or_else(|| crate::Error::UnknownName {
                what: "mark of lost tracking",
                found: text.to_owned(),
                expected: Self::ALL.map(Self::name).join(", "),
            })
    }
}

/// Rows in a piece that hold no pose: tracking was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LostSpan {
    /// How the rows say so; for mixed spans, how the first does.
    pub kind: LostKind,
    /// First row, counted as [`crate::Trajectory::row_kind`] says.
    pub first_row: u64,
    /// Last row.
    pub last_row: u64,
    /// How many rows.
    pub rows: usize,
    /// Poses of the log before the span.
    pub before: usize,
    /// Stamp of the first row in nanoseconds, where it has one.
    pub first_stamp: Option<i64>,
    /// Stamp of the last row.
    pub last_stamp: Option<i64>,
}
