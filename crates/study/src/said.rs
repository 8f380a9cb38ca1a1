//! What is said at the terminal while it is measured.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write as _, stdout};
use std::sync::OnceLock;

/// The first error of standard output, of a reader that left aside.
static LOST: OnceLock<ErrorKind> = OnceLock::new();

/// Says a line, as `println!`. What is measured is in files: where nobody reads any more (`| head`), or the output cannot be
/// written, the work goes on.
#[macro_export]
macro_rules! say {
    ($($line:tt)*) => {
        $crate::said::line(format_args!($($line)*))
    };
}

/// For [`say!`](crate::say).
pub fn line(line: Arguments<'_>) {
    if let Err(error) = writeln!(stdout(), "{line}")
        && error.kind() != ErrorKind::BrokenPipe
    {
        LOST.get_or_init(|| error.kind());
    }
}

/// Whether all that was said could be written.
///
/// # Errors
/// What standard output answered first; never that its reader left.
pub fn whole() -> anyhow::Result<()> {
    match LOST.get() {
        None => Ok(()),
        Some(kind) => anyhow::bail!("standard output: {kind}; files that were named are written"),
    }
}
