//! Results of many logs as a table: a row for each log, whether it could be judged or not.
//!
//! [`Row`] is such a row as a value; with the feature `parquet`, `TableWriter` writes rows to a Parquet file.

#[cfg(feature = "parquet")]
mod columns;
mod row;
#[cfg(feature = "parquet")]
mod writer;

pub use row::{Row, Stretch, Versions};
#[cfg(feature = "parquet")]
pub use writer::TableWriter;
