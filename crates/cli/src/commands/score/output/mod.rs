//! The forms of results, a file each.

mod csv;
mod json;
mod jsonl;
mod junit;
mod line;
mod page;
#[cfg(feature = "parquet")]
mod parquet;
mod recording;
#[cfg(all(test, feature = "schema"))]
pub mod schema;
mod table;

pub use csv::Csv;
pub use json::{Head, Json};
pub use jsonl::Jsonl;
pub use junit::Junit;
pub use page::Pages;
#[cfg(feature = "parquet")]
pub use parquet::Parquet;
pub use recording::Recordings;
pub use table::Table;
