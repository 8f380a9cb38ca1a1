//! Recordings in MCAP, as they are written; what reads them is [`load`](crate::load).

pub use crate::recording::write::{Channel, Recording};

/// What such a file begins and ends with.
pub const MAGIC: &[u8] = crate::recording::MAGIC;
