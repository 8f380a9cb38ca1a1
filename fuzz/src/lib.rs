//! Hostile input for everything that reads what others wrote.
//!
//! A [`Target`] is a function of bytes that must never panic, hang or ask for memory out of proportion to its input,
//! and that checks properties of what it accepts. Two drivers share the targets: the program of this crate, which
//! alters seeds by a seeded generator (the same cases in every run, no special compiler), and `fuzz/libfuzzer`,
//! which is guided by coverage.

pub mod memory;
pub mod mutate;
pub mod seeds;
pub mod targets;

/// One entry for bytes of others.
pub struct Target {
    /// Its name on the command line and in names of finds.
    pub name: &'static str,
    /// Feeds it; panics where a property is broken.
    pub run: fn(&[u8]),
    /// Well-formed inputs to start from.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Words that its formats are made of.
    pub dictionary: &'static [&'static [u8]],
}

/// The target of this name.
pub fn target(name: &str) -> Option<&'static Target> {
    targets::ALL.iter().find(|target| target.name == name)
}

/// Largest memory in bytes that an input of `length` bytes may ask for at any one time.
///
/// Text of seven small numbers a row, some 14 bytes, becomes a pose, a stamp and a row number (112 bytes) and passes
/// through vectors that double; recordings are unpacked to a bounded multiple of their size.
pub fn allowance(length: usize) -> usize {
    (64 << 20) + 512 * length
}

/// Runs a target on `bytes` as every driver does: within [`allowance`] of memory.
///
/// # Panics
/// Where a property of the target is broken, or too much memory was asked for.
pub fn check(target: &Target, bytes: &[u8]) {
    let before = memory::start();
    (target.run)(bytes);
    let peak = memory::peak().saturating_sub(before);
    let allowed = allowance(bytes.len());
    assert!(
        peak <= allowed,
        "{peak} bytes of memory for an input of {} bytes, {allowed} allowed",
        bytes.len()
    );
}
