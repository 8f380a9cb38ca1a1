//! A report in one line.

use crate::terminal::Style;
use dose3::{Report, Verdict};

/// A verdict as people read it; those that call the log stand out.
pub fn words(verdict: Verdict) -> (&'static str, Style) {
    match verdict {
        Verdict::InDistribution => ("in distribution", Style::Good),
        Verdict::OutOfDistribution => ("OUT OF DISTRIBUTION", Style::Bad),
        Verdict::Like => ("like", Style::Good),
        Verdict::Unlike => ("UNLIKE", Style::Bad),
    }
}

/// A chance in digits that people read: `0.43`, `0.0012`, `3e-7`.
pub fn chance(p: f64) -> String {
    match p {
        p if p >= 0.0095 => format!("{p:.2}"),
        p if p >= 0.000_095 => format!("{p:.4}"),
        p => format!("{p:.0e}"),
    }
}

/// Where a log that differs does so most, and by which test.
pub fn place(report: &Report) -> String {
    if !report.verdict.differs() {
        return String::new();
    }
    let by = &report.evidence.deciding().name;
    match report
        .segments
        .iter()
        .max_by_key(|segment| segment.worst_score)
    {
        Some(worst) => format!("{}, {by}", report.place(&worst.place)),
        None => by.clone(),
    }
}

/// Verdict, chance and place.
pub fn headline(report: &Report) -> String {
    let (words, _) = words(report.verdict);
    let place = match place(report) {
        place if place.is_empty() => place,
        place => format!(": {place}"),
    };
    format!(
        "{}, chance {}{place}",
        words.to_lowercase(),
        chance(report.evidence.p_value)
    )
}
