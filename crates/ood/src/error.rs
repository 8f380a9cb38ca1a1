//! What can go wrong between a trace of the noise estimator and a verdict.

use crate::statistics::Statistic;

/// Errors of this crate. Every message says what was expected and what was found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A name that is no statistic of this version.
    #[error(
        "unknown statistic `{name}`; known are {known}, joined by `+` (in one block), `,` (blocks) or `/` (tests)"
    )]
    UnknownStatistic {
        /// The name as given.
        name: String,
        /// All known names.
        known: String,
    },
    /// A union without members.
    #[error("a set of statistics needs at least one member")]
    EmptySet,
    /// Two members of a union compute the same column.
    #[error("`{first}` and `{second}` both compute `{column}`: keep one of them")]
    Overlap {
        /// The member that comes first.
        first: Statistic,
        /// The member that repeats the column.
        second: Statistic,
        /// The column both compute.
        column: String,
    },
    /// A statistic asked for an input that the sample does not carry.
    #[error("`{statistic}` needs {input}, which this sample does not carry")]
    MissingInput {
        /// The statistic that asked.
        statistic: Statistic,
        /// The input in words.
        input: &'static str,
    },
    /// A slice, row or list has the wrong number of entries.
    #[error("{what}: expected {expected} entries, found {found}")]
    Shape {
        /// The thing measured.
        what: &'static str,
        /// Entries expected.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// NaN or an infinity where a number must be.
    #[error("{what}: entry {index} is {value}, not a finite number")]
    NotFinite {
        /// The thing looked at.
        what: String,
        /// Position within it.
        index: usize,
        /// The value found.
        value: f64,
    },
    /// A trace with too few diffusion steps for the statistic.
    #[error("`{statistic}` needs at least {needed} diffusion steps, the trace has {found}")]
    TooFewSteps {
        /// The statistic that asked.
        statistic: Statistic,
        /// Steps it needs.
        needed: usize,
        /// Steps of the trace.
        found: usize,
    },
    /// A setting outside of its range.
    #[error("{name} is {value}: {expected}")]
    Parameter {
        /// Name of the setting.
        name: &'static str,
        /// The value as given.
        value: String,
        /// The range that is allowed.
        expected: &'static str,
    },
    /// Not enough data for what was asked.
    #[error("{what}: {needed} needed, {found} found; {hint}")]
    TooFew {
        /// What is lacking.
        what: &'static str,
        /// How many are needed.
        needed: usize,
        /// How many there are.
        found: usize,
        /// What resolves it.
        hint: &'static str,
    },
    /// A column index that the density does not have, or one named twice.
    #[error("column {column} of a density over {dimension} columns is out of range or named twice")]
    Column {
        /// The offending index.
        column: usize,
        /// Columns of the density.
        dimension: usize,
    },
    /// A covariance that is not positive definite, from a file or a fit.
    #[error("{what} is not a positive definite covariance")]
    NotPositiveDefinite {
        /// Which covariance.
        what: &'static str,
    },
    /// A detector whose parts do not belong together.
    #[error("the detector's {part} is not sound: {reason}")]
    Inconsistent {
        /// The part that is wrong.
        part: &'static str,
        /// Why.
        reason: String,
    },
    /// Raised by linfa's k-means.
    #[error("k-means initialisation failed: {0}")]
    KMeans(#[from] linfa_clustering::KMeansError),
    /// Raised by linfa's k-means parameters.
    #[error("k-means initialisation failed: {0}")]
    KMeansParameters(#[from] linfa_clustering::KMeansParamsError),
    /// Raised by linfa itself.
    #[error(transparent)]
    Linfa(#[from] linfa::Error),
}

/// Checks a length.
pub(crate) fn expect_len(what: &'static str, expected: usize, found: usize) -> Result<(), Error> {
    if expected == found {
        Ok(())
    } else {
        Err(Error::Shape {
            what,
            expected,
            found,
        })
    }
}

/// Checks that every value is a finite number.
pub(crate) fn expect_finite<'a>(
    what: &str,
    values: impl IntoIterator<Item = &'a f64>,
) -> Result<(), Error> {
    match values.into_iter().enumerate().find(|(_, v)| !v.is_finite()) {
        None => Ok(()),
        Some((index, &value)) => Err(Error::NotFinite {
            what: what.to_owned(),
            index,
            value,
        }),
    }
}

/// Checks a table: at least one row, all rows of one length, all entries finite. Returns the columns.
pub(crate) fn expect_table(what: &'static str, rows: &[Vec<f64>]) -> Result<usize, Error> {
    let columns = rows.first().map_or(0, Vec::len);
    if columns == 0 {
        return Err(Error::TooFew {
            what,
            needed: 1,
            found: 0,
            hint: "a table needs at least one row and one column",
        });
    }
    for (index, row) in rows.iter().enumerate() {
        expect_len(what, columns, row.len())?;
        expect_finite(&format!("{what}, row {index}"), row)?;
    }
    Ok(columns)
}
