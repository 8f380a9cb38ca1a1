#![doc = include_str!("../README.md")]

mod cut;
mod detect;
mod error;
pub mod faults;
mod format;
mod groups;
mod hex;
mod increments;
mod load;
#[cfg(feature = "recordings")]
pub mod mcap;
mod memory;
mod naming;
mod options;
mod read;
#[cfg(feature = "recordings")]
mod recording;
mod remark;
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
pub use groups::{GroupBy, LogGroups, Overlap, Shared, overlaps};
pub use hex::hex;
pub use increments::{increment, increments};
pub use load::{
    Survey, discover, load, load_all, load_bytes, load_each, load_several, load_several_bytes,
    survey,
};
pub use naming::{group_logs, make_unique, put_folders_before, telling_folders};
pub use options::LoadOptions;
pub use read::columns::Columns;
#[cfg(feature = "recordings")]
pub use recording::{Chain, Contents, Topic, contents};
pub use remark::{LostKind, LostSpan, ReadOption, Remark, RemarkKind};
pub use report::LoadReport;
pub use represent::{Kind, Representation, Scaling, WindowTensor};
pub use resample::{at_rate, resample, same_rate};
pub use source::{RowKind, Source, StampUnit};
pub use split::{Split, folds, leave_one_out, split_by_log};
pub use stretch::stretches;
pub use trajectory::Trajectory;
pub use window::{Window, stretch_numbers, windows, windows_of_each};
