//! The parts of the `dose3` program that other programs of the workspace use too.

pub mod plot;
