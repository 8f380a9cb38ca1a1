//! What the program says, and the terminal it says it to.

use anyhow::Result;
use dose3::progress::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};

/// Narrower than this nothing can be laid out.
const NARROWEST: usize = 40;
/// Where the texts of a report begin, behind two blanks and a label.
const LABELS: usize = 14;

/// A line for people, to standard error.
pub fn say(text: &str) {
    // Nobody is left to tell where standard error is closed.
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Results, to standard output. Where nobody reads on (`| head`) the rest is dropped quietly.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => Ok(other?),
    }
}

/// A value as one indented JSON document.
pub fn print_json(value: &impl serde::Serialize) -> Result<()> {
    print(&format!("{}\n", serde_json::to_string_pretty(value)?))
}

/// `1 log`, `2 logs`.
pub fn count(n: usize, what: &str) -> String {
    if n == 1 {
        format!("1 {what}")
    } else {
        format!("{n} {what}s")
    }
}

/// Columns of the lines on standard output: those that `COLUMNS` says, else those of the terminal. None where lines go
/// to a file or a pipe, which has no edge.
pub fn columns() -> Option<usize> {
    let told = std::env::var("COLUMNS").ok();
    let told = told.and_then(|text| text.parse().ok());
    let found = || {
        let (width, _) = terminal_size::terminal_size_of(std::io::stdout())?;
        Some(usize::from(width.0))
    };
    let columns = told.or_else(found).filter(|columns| *columns > 0)?;
    Some(columns.max(NARROWEST))
}

/// Whether standard output is a terminal that shows colours and `NO_COLOR` (no-color.org) does not forbid them.
pub fn colours() -> bool {
    let forbidden = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    !forbidden && !dumb && std::io::stdout().is_terminal()
}

/// A way to make a word stand out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    Good,
    Bad,
    Faint,
}

/// `text` in that style where colours are wanted.
pub fn paint(text: &str, style: Style, colours: bool) -> String {
    if !colours {
        return text.to_owned();
    }
    let code = match style {
        Style::Good => "32",
        Style::Bad => "1;31",
        Style::Faint => "2",
    };
    format!("\u{1b}[{code}m{text}\u{1b}[0m")
}

/// Breaks the lines of `text` that are longer than `columns` between words; what follows stands below the text of its
/// line, past a label and two blanks.
pub fn wrap(text: &str, columns: Option<usize>) -> String {
    let Some(columns) = columns else {
        return text.to_owned();
    };
    let mut out = String::new();
    for line in text.lines() {
        let indent = indent(line).min(columns / 2);
        let mut length = 0;
        // Blanks are kept within a line: they align it.
        for piece in line.split_inclusive(' ') {
            let (full, bare) = (
                piece.chars().count(),
                piece.trim_end_matches(' ').chars().count(),
            );
            if length > indent && length + bare > columns {
                while out.ends_with(' ') {
                    out.pop();
                }
                out.push('\n');
                out.extend(std::iter::repeat_n(' ', indent));
                length = indent;
            }
            out.push_str(piece);
            length += full;
        }
        out.push('\n');
    }
    out
}

/// Where the text of a line begins: a report's behind the column of labels, of others behind their blanks.
fn indent(line: &str) -> usize {
    let blanks = line.len() - line.trim_start_matches(' ').len();
    let at = |column: usize| line.as_bytes().get(column).copied();
    let labelled = at(LABELS - 1) == Some(b' ') && at(LABELS).is_some_and(|c| c != b' ');
    match blanks {
        2 if labelled => LABELS,
        0 => 2,
        _ => blanks,
    }
}

/// A progress bar; nothing where standard error is no terminal, or `quiet`.
pub fn progress(total: u64, what: &'static str, quiet: bool) -> Result<ProgressBar> {
    let style = ProgressStyle::with_template(
        "{prefix} [{bar:30}] {pos}/{len} {elapsed} elapsed, {eta} left {msg}",
    )?
    .progress_chars("=> ");
    let target = match quiet {
        true => ProgressDrawTarget::hidden(),
        false => ProgressDrawTarget::stderr(),
    };
    let bar = ProgressBar::with_draw_target(Some(total), target);
    Ok(bar.with_style(style).with_prefix(what))
}

/// Windows of the logs at hand, or whole logs, as a bar.
pub struct Bar(pub ProgressBar);

impl Progress for Bar {
    fn windows(&mut self, done: usize, total: usize) {
        self.0.set_length(total as u64);
        self.0.set_position(done as u64);
    }

    fn log(&mut self, name: &str) {
        self.0.set_message(name.to_owned());
        self.0.inc(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_are_broken_below_their_text() {
        let text = "07                       in distribution\n  chance      0.41 of this in a log like your 9 logs\n\
            \x20             and 1 more segment\n";
        assert_eq!(wrap(text, None), text);
        assert_eq!(
            wrap(text, Some(40)),
            "07                       in distribution\n  chance      0.41 of this in a log like\n\
             \x20             your 9 logs\n              and 1 more segment\n"
        );
        // A label of two words, one as wide as its column, and a word that fits nowhere.
        for label in ["decided by ", "calibration"] {
            assert_eq!(
                wrap(&format!("  {label} one two three"), Some(30)),
                format!("  {label} one two three\n")
            );
            assert_eq!(
                wrap(&format!("  {label} one two three four"), Some(30)),
                format!("  {label} one two three\n{:14}four\n", "")
            );
        }
        let long = "x".repeat(50);
        assert_eq!(wrap(&long, Some(40)), format!("{long}\n"));
    }

    #[test]
    fn styles_are_left_out_where_colours_are_unwanted() {
        assert_eq!(paint("a", Style::Bad, false), "a");
        assert_eq!(paint("a", Style::Bad, true), "\u{1b}[1;31ma\u{1b}[0m");
    }
}
