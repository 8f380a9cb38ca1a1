//! How to get the same again.

use super::section;
use crate::Told;
use crate::escape::Text;
use dose3::Detector;

/// The command alone; nothing where it is not known.
pub fn command(told: &Told) -> String {
    section("repeat", "Repeat it", &line(told))
}

fn line(told: &Told) -> String {
    match &told.command {
        Some(command) => format!(
            "<div class=\"command\"><pre><code id=\"command\">{}</code></pre>\
             <button type=\"button\" id=\"copy\">copy</button></div>",
            Text(command)
        ),
        None => String::new(),
    }
}

/// The command, and what decided beside it.
pub fn html(detector: &Detector, told: &Told) -> String {
    let header = detector.header();
    let config = header.statistics.config();
    let file = match &told.detector {
        Some(file) => format!("<code>{}</code>", Text(file)),
        None => "in memory".to_owned(),
    };
    let facts = format!(
        "<p>Detector {file}: {} trusted logs at {:.1} Hz, axes {}, statistics <code>{}</code>, seed {}, fitted by version {}. \
         This page was written by version {}. The same log, detector and version give the same page.</p>",
        header.trusted.len(),
        header.rate,
        Text(header.frame.name()),
        Text(&config.statistics),
        config.seed,
        Text(&header.version),
        env!("CARGO_PKG_VERSION"),
    );
    section("repeat", "Repeat it", &format!("{}{facts}", line(told)))
}
