//! The `dose3` program.
fn main() {}
