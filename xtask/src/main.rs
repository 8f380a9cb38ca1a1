//! Tasks of the DOSE3 workspace.
fn main() {}
