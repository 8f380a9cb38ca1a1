//! Readers, windows and representations for sequences of 3-D poses.
