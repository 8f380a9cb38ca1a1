//! The page that lists many logs.

use crate::escape::{Text, fill};
use crate::{BEGINS, Told, sections, words};
use dose3::Report;
use std::fmt::Write as _;

/// A log in the list.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    name: String,
    /// The address of its page, seen from the list.
    page: String,
    verdict: &'static str,
    differs: bool,
    chance: f64,
    beyond: usize,
    windows: usize,
    /// Rows of its worst stretch, where it differs.
    worst: Option<String>,
    /// The strongest reason.
    reason: Option<String>,
}

impl Entry {
    /// Of a log whose page has that address, seen from the list.
    #[must_use]
    pub fn new(report: &Report, page: String) -> Self {
        let evidence = &report.evidence;
        let differs = evidence.verdict.differs();
        let worst = report.segments.iter().max_by_key(|s| s.worst_score);
        let reason = report.reasons.first().filter(|_| differs);
        Self {
            name: report.log.name.clone(),
            page,
            verdict: words::verdict(report).0,
            differs,
            chance: evidence.p_value,
            beyond: evidence.beyond,
            windows: evidence.windows,
            worst: worst
                .filter(|_| differs)
                .map(|s| words::rows(report, &s.place)),
            reason: reason.map(|reason| reason.sentence.clone()),
        }
    }

    fn row(&self) -> String {
        format!(
            "<tr class=\"{}\"><th scope=\"row\"><a href=\"{}\">{}</a></th><td>{} {}</td><td>{}</td><td>{} of {}</td>\
             <td>{}</td><td>{}</td></tr>",
            if self.differs { "out" } else { "in" },
            Text(&self.page),
            Text(&self.name),
            if self.differs { "!" } else { "✓" },
            self.verdict,
            words::chance(self.chance),
            self.beyond,
            self.windows,
            Text(self.worst.as_deref().unwrap_or_default()),
            Text(self.reason.as_deref().unwrap_or_default()),
        )
    }
}

/// A table of logs, the most unusual first, each with a link to its page; `failed` are the paths of those that could
/// not be judged, with the reason.
#[must_use]
pub fn list(entries: &[Entry], failed: &[(String, String)], told: &Told) -> String {
    let mut order: Vec<&Entry> = entries.iter().collect();
    order.sort_by(|a, b| a.chance.total_cmp(&b.chance));
    let differ = entries.iter().filter(|e| e.differs).count();
    let head = format!(
        "<header class=\"{}\"><h1>{differ} of {} logs {}</h1></header>",
        if differ > 0 { "out" } else { "in" },
        entries.len(),
        if differ == 1 {
            "is not like the trusted ones"
        } else {
            "are not like the trusted ones"
        }
    );
    let rows: String = order.into_iter().map(Entry::row).collect();
    let mut errors = String::new();
    for (path, reason) in failed {
        let _ = write!(
            errors,
            "<li><code>{}</code>: {}</li>",
            Text(path),
            Text(reason)
        );
    }
    if !errors.is_empty() {
        errors = format!("<section><h2>Not judged</h2><ul>{errors}</ul></section>");
    }
    fill(
        include_str!("assets/index.html"),
        &[
            ("begins", BEGINS),
            ("style", include_str!("assets/page.css")),
            ("head", &head),
            ("rows", &rows),
            ("errors", &errors),
            ("repeat", &sections::repeat::command(told)),
            ("copy", include_str!("assets/copy.js")),
        ],
    )
}
