//! How the log was read.

use super::{list, section};
use crate::escape::Text;
use dose3::Report;
use dose3::datasets::Trajectory;

/// Repairs, assumptions and notes; `log` as it was read.
pub fn html(report: &Report, log: &Trajectory) -> String {
    let repairs = log.report.lines();
    let remarks: Vec<String> = log.report.remarks.iter().map(ToString::to_string).collect();
    let known = |note: &&String| repairs.contains(note) || remarks.contains(note);
    let notes = report.notes.iter().filter(|note| !known(note));
    let repaired = match repairs.is_empty() {
        true => "<p>Nothing had to be repaired.</p>".to_owned(),
        false => format!("<h3>Repaired</h3>{}", list(&repairs)),
    };
    let assumed = titled("Assumed, and noticed", &list(&remarks));
    let notes = titled("To know", &list(notes));
    let file = match report.log.path.is_empty() {
        true => String::new(),
        false => format!(
            "<p>Read from <code>{}</code> as {}, axes {}.</p>",
            Text(&report.log.path),
            Text(log.format.name()),
            Text(log.frame.name())
        ),
    };
    section(
        "reading",
        "Reading the file",
        &format!("{file}{repaired}{assumed}{notes}"),
    )
}

fn titled(title: &str, list: &str) -> String {
    match list.is_empty() {
        true => String::new(),
        false => format!("<h3>{title}</h3>{list}"),
    }
}
