//! For people: a line for each log, or everything that is known of it.

use super::super::judge::Judged;
use super::super::sink::{Sink, Target};
use super::super::summary::Summary;
use super::line::{chance, place, words};
use crate::args::Showing;
use crate::terminal::{Style, colours, columns, paint, wrap};
use anyhow::Result;
use dose3::Report;
use std::fmt::Write as _;

/// Names are this wide at least, half of it on a narrow terminal; longer ones push their own line.
const NAME: usize = 24;
/// A terminal with fewer columns is narrow.
const NARROW: usize = 100;

pub struct Table {
    to: Target,
    details: bool,
    windows: bool,
    quiet: bool,
    colours: bool,
    columns: Option<usize>,
    /// Whether the head was written.
    begun: bool,
}

impl Table {
    pub fn new(to: Target, showing: &Showing) -> Self {
        let terminal = matches!(to, Target::StandardOutput);
        Self {
            to,
            details: showing.verbose || showing.windows,
            windows: showing.windows,
            quiet: showing.quiet,
            colours: terminal && colours(),
            columns: columns().filter(|_| terminal),
            begun: false,
        }
    }

    fn name_width(&self) -> usize {
        match self.columns {
            Some(columns) if columns < NARROW => NAME / 2,
            _ => NAME,
        }
    }

    /// The log in one line, cut at the edge of a terminal.
    fn row(&self, report: &Report) -> String {
        let (words, style) = words(report.verdict);
        let rest = format!(
            "  {:>7}  {:>7}  {:<width$}  {}",
            chance(report.evidence.p_value),
            far(report.evidence.excess),
            report.log.name,
            place(report),
            width = self.name_width()
        );
        let rest = cut(
            rest.trim_end(),
            self.columns.map(|all| all.saturating_sub(19)),
        );
        format!(
            "{}{rest}\n",
            paint(&format!("{words:<19}"), style, self.colours)
        )
    }

    fn head(&self) -> String {
        let head = format!(
            "{:<19}  {:>7}  {:>7}  {:<width$}  where",
            "verdict",
            "chance",
            "far",
            "log",
            width = self.name_width()
        );
        format!(
            "{}\n",
            paint(&cut(&head, self.columns), Style::Faint, self.colours)
        )
    }
}

impl Sink for Table {
    fn log(&mut self, judged: &Judged, many: bool) -> Result<()> {
        let Some(report) = judged.report() else {
            return Ok(());
        };
        if self.quiet && !report.verdict.differs() {
            return Ok(());
        }
        if many && !self.details {
            let head = match !self.begun && !self.quiet {
                true => self.head(),
                false => String::new(),
            };
            self.begun = true;
            return self.to.write(&format!("{head}{}", self.row(report)));
        }
        let text = details(report, self.windows);
        let text = wrap(&text, self.columns);
        self.to.write(&self.painted(report, text))
    }

    fn end(self: Box<Self>, _: &Summary) -> Result<()> {
        self.to.end()
    }
}

impl Table {
    /// With the verdict's words in the first line standing out.
    fn painted(&self, report: &Report, text: String) -> String {
        let (words, style) = words(report.verdict);
        match self.colours {
            true => text.replacen(words, &paint(words, style, true), 1),
            false => text,
        }
    }
}

/// How many times a trusted extreme.
fn far(excess: f64) -> String {
    match excess {
        x if x < 9999.5 => format!("{x:.1}"),
        x => format!("{x:.0e}"),
    }
}

/// The first `columns` characters.
fn cut(text: &str, columns: Option<usize>) -> String {
    match columns {
        Some(columns) if text.chars().count() > columns => {
            let kept: String = text.chars().take(columns.saturating_sub(1)).collect();
            format!("{}…", kept.trim_end())
        }
        _ => text.to_owned(),
    }
}

/// The library's summary, and every window where it is asked for.
fn details(report: &Report, windows: bool) -> String {
    let mut out = report.to_string();
    for w in report.windows.iter().filter(|_| windows) {
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "  window      {}s {:>6} to {:>6}  score {:>9.3}  p {:.3}{}",
            report.log.row_kind,
            w.first_row,
            w.last_row,
            w.score.value(),
            w.p_value,
            if w.beyond { "  beyond" } else { "" }
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{cut, far};

    #[test]
    fn lines_end_at_the_edge_and_numbers_stay_short() {
        assert_eq!(cut("abcdef", Some(4)), "abc…");
        assert_eq!(cut("ab  ef", Some(4)), "ab…");
        assert_eq!(cut("abcd", Some(4)), "abcd");
        assert_eq!(
            (far(15.13), far(1.0e6)),
            ("15.1".to_owned(), "1e6".to_owned())
        );
    }
}
