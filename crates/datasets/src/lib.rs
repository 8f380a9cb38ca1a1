#![doc = include_str!("../README.md")]

mod cut;
mod detect;
mod error;
pub mod faults;
mod format;
mod load;
mod naming;
mod options;
mod read;
mod report;
mod represent;
mod resample;
mod source;
mod split;
mod stretch;
pub mod synthetic;
mod trajectory;
mod window;
pub mod write;

pub use detect::detect;
pub use error::{Error, InputError, Place};
pub use format::{Format, Frame, Rate, RateSource};
pub use load::{Survey, discover, load, load_all, survey};
pub use naming::group_logs;
pub use options::LoadOptions;
pub use report::LoadReport;
pub use represent::{Kind, Representation, Scaling, WindowTensor};
pub use resample::{at_rate, resample};
pub use source::{RowKind, Source, StampUnit};
pub use split::{Split, folds, leave_one_out, split_by_log};
pub use stretch::stretches;
pub use trajectory::Trajectory;
pub use window::{Window, windows, windows_of_each};
