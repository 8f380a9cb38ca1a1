//! Reports for a terminal: the Markdown of the documents, laid out with blanks.

use std::fmt::Write as _;
use std::io::IsTerminal;

/// Prose is no wider than this.
const PROSE: usize = 100;

/// Prints a report's Markdown for people at a terminal; headings stand out where standard output is one that shows
/// colours and `NO_COLOR` (no-color.org) does not forbid them.
pub fn print(markdown: &str) {
    let forbidden = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
    let bold = std::io::stdout().is_terminal() && !forbidden && !dumb;
    let columns = std::env::var("COLUMNS").ok();
    let columns = columns.and_then(|columns| columns.parse().ok());
    say!(
        "\n{}",
        plain(markdown, columns.unwrap_or(PROSE).clamp(40, PROSE), bold)
    );
}

/// The text of `markdown` without its marks: tables aligned with blanks, prose broken at `columns`, headings bold where
/// that is wanted.
#[must_use]
pub fn plain(markdown: &str, columns: usize, bold: bool) -> String {
    let mut out = String::new();
    let mut table: Vec<&str> = Vec::new();
    for line in markdown.lines() {
        if line.starts_with('|') {
            table.push(line);
            continue;
        }
        aligned(&mut out, &std::mem::take(&mut table), bold);
        let marks = line.len() - line.trim_start_matches('#').len();
        if marks > 0 {
            emphasised(&mut out, &bare(line[marks..].trim()), bold);
            out.push('\n');
        } else {
            wrapped(&mut out, &bare(line), columns);
        }
    }
    aligned(&mut out, &table, bold);
    out
}

/// A line of Markdown without marks: emphasis, code, links and pictures as their text.
fn bare(line: &str) -> String {
    let mut out = String::new();
    let mut rest = line;
    while let Some(c) = rest.chars().next() {
        let label = rest.strip_prefix("![").or(rest.strip_prefix('['));
        let link = label.and_then(|label| label.split_once("]("));
        let link = link.and_then(|(text, to)| Some((text, to.split_once(')')?.1)));
        if let Some((text, behind)) = link {
            out.push_str(&bare(text));
            rest = behind;
            continue;
        }
        // A star between blanks is a times sign or a list.
        let spaced = c == '*' && rest[1..].starts_with(' ');
        if !(c == '`' || c == '*' && !spaced) {
            out.push(c);
        }
        rest = &rest[c.len_utf8()..];
    }
    out
}

fn emphasised(out: &mut String, text: &str, bold: bool) {
    match bold {
        true => {
            let _ = write!(out, "\u{1b}[1m{text}\u{1b}[0m");
        }
        false => out.push_str(text),
    }
}

/// A table without lines around it: columns of numbers end at the same place, others begin there.
fn aligned(out: &mut String, table: &[&str], bold: bool) {
    let cells = |line: &str| -> Vec<String> {
        let inner = line.trim().trim_start_matches('|').trim_end_matches('|');
        inner.split('|').map(|cell| bare(cell.trim())).collect()
    };
    let is_rule = |line: &&&str| line.chars().all(|c| matches!(c, '|' | '-' | ':' | ' '));
    let rows: Vec<Vec<String>> = table
        .iter()
        .filter(|line| !is_rule(line))
        .map(|line| cells(line))
        .collect();
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let layout: Vec<(usize, bool)> = (0..columns)
        .map(|column| {
            let cells = || rows.iter().filter_map(|row| row.get(column));
            let width = cells().map(|cell| cell.chars().count()).max().unwrap_or(0);
            (
                width,
                column > 0 && cells().skip(1).all(|cell| is_number(cell)),
            )
        })
        .collect();
    for (index, row) in rows.iter().enumerate() {
        let mut line = String::new();
        for (cell, (width, right)) in row.iter().zip(&layout) {
            let gap = if line.is_empty() { "" } else { "  " };
            let _ = match right {
                true => write!(line, "{gap}{cell:>width$}"),
                false => write!(line, "{gap}{cell:<width$}"),
            };
        }
        match index {
            0 => emphasised(out, line.trim_end(), bold),
            _ => out.push_str(line.trim_end()),
        }
        out.push('\n');
    }
}

/// Whether a cell reads as a number, with what stands behind it; a dash is one that is not there.
fn is_number(cell: &str) -> bool {
    let start = cell.trim_start_matches(['-', '−', '+', '<', '.', ' ']);
    start.is_empty() || start == "–" || start.starts_with(|c: char| c.is_ascii_digit())
}

fn wrapped(out: &mut String, line: &str, columns: usize) {
    let item = line.trim_start().starts_with("- ");
    let indent = if item {
        line.len() - line.trim_start().len() + 2
    } else {
        0
    };
    let mut length = 0;
    for word in line.split(' ') {
        let wide = word.chars().count();
        if length > indent && length + 1 + wide > columns {
            out.push('\n');
            out.extend(std::iter::repeat_n(' ', indent));
            length = indent;
        } else if length > 0 {
            out.push(' ');
            length += 1;
        }
        out.push_str(word);
        length += wide;
    }
    out.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_has_aligned_tables_and_no_marks() {
        let markdown = "### AUROC, split `held-out`\n\n| method | A/B | note |\n|---|---|---|\n| **ours**, [why](x.md) | 0.9 | a |\n\
            | *paper* | 10.25 ± 0.1 | |\n\n![loss](loss.svg)\n- one two three four five six seven eight nine ten";
        let expected = "AUROC, split held-out\n\nmethod             A/B  note\nours, why          0.9  a\n\
            paper      10.25 ± 0.1\n\nloss\n- one two three four five six seven\n  eight nine ten\n";
        assert_eq!(plain(markdown, 40, false), expected);
        let bold = plain(markdown, 40, true);
        assert!(
            bold.starts_with("\u{1b}[1mAUROC, split held-out\u{1b}[0m\n"),
            "{bold}"
        );
        assert!(!bold.contains('|') && !bold.contains("**"), "{bold}");
    }

    #[test]
    fn a_star_between_blanks_stays() {
        assert_eq!(bare("3 * 4 of *all*"), "3 * 4 of all");
    }
}
