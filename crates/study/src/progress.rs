//! Progress bars.

use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;

/// A progress bar with ETA on a terminal; elsewhere nothing.
///
/// # Errors
/// Never with the template that stands here.
pub fn progress(total: u64, what: &str) -> Result<ProgressBar> {
    if !std::io::stderr().is_terminal() {
        return Ok(ProgressBar::hidden());
    }
    let style = ProgressStyle::with_template(
        "{prefix:<28} [{bar:30}] {pos}/{len} {elapsed} elapsed, {eta} left",
    )?
    .progress_chars("=> ");
    Ok(ProgressBar::new(total)
        .with_style(style)
        .with_prefix(what.to_string()))
}
