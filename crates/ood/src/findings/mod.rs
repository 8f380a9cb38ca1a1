//! What is found beside the verdict, in physical terms.

pub mod calibration;
