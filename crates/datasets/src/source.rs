//! Where poses came from: rows and stamps of the user's file.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::read::numbers::decimal;

/// Stamps and rows of a log as they were recorded.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Source {
    /// Nanoseconds, strictly increasing.
    pub stamps: Vec<i64>,
    /// Where each stands in the file, as [`RowKind`] counts.
    pub rows: Vec<u64>,
}

impl Source {
    /// Index of the stamp nearest to `stamp`, the earlier one of two equally near; `None` without any.
    pub fn nearest(&self, stamp: i64) -> Option<usize> {
        nearest(&self.stamps, stamp)
    }
}

/// Index of the entry nearest to `stamp` in increasing `stamps`.
pub(crate) fn nearest(stamps: &[i64], stamp: i64) -> Option<usize> {
    let last = stamps.len().checked_sub(1)?;
    let after = stamps.partition_point(|other| *other < stamp).min(last);
    let before = after.saturating_sub(1);
    let closer_before = stamps[before].abs_diff(stamp) <= stamps[after].abs_diff(stamp);
    Some(if closer_before { before } else { after })
}

/// What a row number counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum RowKind {
    /// Lines of a text file from 1, as editors count; headers, comments and blank lines count too.
    Line,
    /// Poses from 0, as numpy counts: entries of an array, of a list, of a table.
    Record,
    /// Messages of one topic of a recording from 0, in the order recorded.
    Message,
    /// Files of a folder with one pose each, by the number in the name.
    File,
}

impl fmt::Display for RowKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Line => "line",
            Self::Record => "pose",
            Self::Message => "message",
            Self::File => "file",
        })
    }
}

/// The unit of stamps in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StampUnit {
    /// Seconds, mostly with decimals.
    Seconds,
    /// Thousandths of a second.
    Milliseconds,
    /// Millionths of a second.
    Microseconds,
    /// The unit of [`crate::Trajectory::stamps`].
    Nanoseconds,
}

impl StampUnit {
    /// All units, the longest first.
    pub const ALL: [Self; 4] = [
        Self::Seconds,
        Self::Milliseconds,
        Self::Microseconds,
        Self::Nanoseconds,
    ];

    /// Power of ten that makes nanoseconds of it.
    pub(crate) fn shift(self) -> i32 {
        match self {
            Self::Seconds => 9,
            Self::Milliseconds => 6,
            Self::Microseconds => 3,
            Self::Nanoseconds => 0,
        }
    }

    /// `s`, `ms`, `us`, `ns`.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Seconds => "s",
            Self::Milliseconds => "ms",
            Self::Microseconds => "us",
            Self::Nanoseconds => "ns",
        }
    }

    /// The nanoseconds of a decimal number of this unit, every digit kept; `None` for what is no number, or none of a
    /// time before the year 2096.
    ///
    /// ```
    /// use dose3_datasets::StampUnit;
    ///
    /// assert_eq!(StampUnit::Seconds.parse_stamp("1305031098.665912"), Some(1_305_031_098_665_912_000));
    /// assert_eq!(StampUnit::Nanoseconds.parse_stamp("noon"), None);
    /// ```
    pub fn parse_stamp(self, text: &str) -> Option<i64> {
        decimal(text, self.shift()).ok()
    }

    /// A stamp as a decimal number of this unit, without trailing zeros.
    pub(crate) fn write(self, nanoseconds: i64) -> String {
        let sign = if nanoseconds < 0 { "-" } else { "" };
        let unit = 10_u64.pow(self.shift().unsigned_abs());
        let (whole, part) = (
            nanoseconds.unsigned_abs() / unit,
            nanoseconds.unsigned_abs() % unit,
        );
        if part == 0 {
            return format!("{sign}{whole}");
        }
        let digits = self.shift().unsigned_abs() as usize;
        let part = format!("{part:0digits$}");
        format!("{sign}{whole}.{}", part.trim_end_matches('0'))
    }
}

impl fmt::Display for StampUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Seconds => "seconds",
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        })
    }
}

impl std::str::FromStr for StampUnit {
    type Err = crate::Error;

    fn from_str(text: &str) -> Result<Self, crate::Error> {
        let lower = text.to_ascii_lowercase();
        Self::ALL
            .into_iter()
            .find(|unit| lower == unit.symbol() || lower == unit.to_string())
            .ok_or_else(|| crate::Error::UnknownName {
                what: "unit of stamps",
                found: text.to_owned(),
                expected: Self::ALL.map(Self::symbol).join(", "),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_takes_the_earlier_of_two() {
        assert_eq!(nearest(&[], 3), None);
        let stamps = [10, 20, 40];
        for (stamp, index) in [(-5, 0), (14, 0), (15, 0), (16, 1), (40, 2), (99, 2)] {
            assert_eq!(nearest(&stamps, stamp), Some(index), "{stamp}");
        }
    }

    #[test]
    fn stamps_are_written_as_in_the_file() {
        assert_eq!(
            StampUnit::Seconds.write(1_600_000_000_100_000_000),
            "1600000000.1"
        );
        assert_eq!(StampUnit::Seconds.write(-50_000_000), "-0.05");
        assert_eq!(StampUnit::Milliseconds.write(100_000_000), "100");
        assert_eq!(StampUnit::Nanoseconds.write(7), "7");
        for unit in StampUnit::ALL {
            assert_eq!(unit.symbol().parse::<StampUnit>().unwrap(), unit);
        }
        assert!("minutes".parse::<StampUnit>().is_err());
    }
}
