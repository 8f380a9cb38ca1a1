//! The parts of the `dose3` program that other programs of the workspace use too: plots, and everything that is read of
//! what people and robots write, so that it can be tried without running anything.

pub mod args;
pub mod command_line;
pub mod list;
pub mod plot;
pub mod pose_line;
