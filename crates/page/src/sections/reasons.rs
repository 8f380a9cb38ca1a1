//! Why, in words.

use super::{place_button, section};
use crate::escape::Text;
use dose3::Report;
use dose3::report::Reason;
use std::fmt::Write as _;

/// The strongest reasons of the whole log.
pub fn html(report: &Report) -> String {
    let differs = report.verdict.differs();
    let content = match report.reasons.is_empty() {
        false => list(report, &report.reasons),
        true if differs => {
            "<p>No single quantity stands out; “How the verdict is made” names the statistics.</p>"
                .to_owned()
        }
        true => String::new(),
    };
    let heading = match differs {
        true => "Why",
        false => "What stands out most, and is no alarm",
    };
    section("why", heading, &content)
}

/// Reasons, each with where it shows; nothing without any.
pub fn list(report: &Report, reasons: &[Reason]) -> String {
    let mut out = String::new();
    for reason in reasons {
        let _ = write!(
            out,
            "<li>{} {}</li>",
            Text(&reason.sentence),
            place_button(report, &reason.place)
        );
    }
    match out.is_empty() {
        true => out,
        false => format!("<ul class=\"reasons\">{out}</ul>"),
    }
}
