//! Logs as a user gives them, and as a model needs them.

mod list;
mod needs;
mod note;
mod read;

pub use list::{Listing, LogFile, list};
pub use needs::{Needs, conform};
pub use note::Note;
pub use read::{Found, ReadOptions, apply, find_each, read, read_each};
