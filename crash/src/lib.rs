//! Kills programs at random moments and at every step of writing, fails their writes, and holds them to what is
//! promised: every file is the old one or the new one, and the next run ends as if nothing had been.
//!
//! [`scenarios`] are the programs and what they write, [`fault`] strikes a chosen call, [`trial`] judges.

pub mod fault;
pub mod folder;
pub mod scenario;
pub mod scenarios;
pub mod trial;

/// What went wrong, in words.
pub type Result<T, E = String> = std::result::Result<T, E>;
