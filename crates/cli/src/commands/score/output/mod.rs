//! The forms of results, a file each.

mod csv;
mod json;
mod jsonl;
mod junit;
mod line;
mod page;
mod recording;
#[cfg(all(test, feature = "schema"))]
pub mod schema;
mod table;

pub use csv::Csv;
pub use json::{Head, Json};
pub use jsonl::Jsonl;
pub use junit::Junit;
pub use page::Pages;
pub use recording::Recordings;
pub use table::Table;
