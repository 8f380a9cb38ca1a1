//! Legends that stand beside panels, never in them.

use super::canvas::{Anchor, Canvas, Stroke, text_width};
use super::palette::BLACK;
use super::panel::NORMAL;
use anyhow::Result;
use plotters::style::RGBColor;

/// Height of a row.
pub const LEGEND_ROW: f64 = 19.0;

/// What an entry of a legend shows before its text.
#[derive(Clone, Copy)]
pub enum Swatch {
    /// A piece of line.
    Line(Stroke),
    /// A dot.
    Dot(RGBColor),
}

/// A legend in rows between `left` and `right`, the first at height `top`.
///
/// # Errors
/// Coordinates that are not finite.
pub fn legend(
    canvas: &Canvas<'_>,
    (left, right): (f64, f64),
    top: f64,
    entries: &[(Swatch, String)],
) -> Result<()> {
    let mut y = top;
    for row in legend_rows(right - left, entries) {
        let total: f64 = row.iter().map(|(_, text)| entry_width(text)).sum();
        let mut x = left + (right - left - total) / 2.0;
        for (swatch, text) in row {
            match swatch {
                Swatch::Line(stroke) => canvas.line(&[(x, y), (x + 24.0, y)], *stroke)?,
                Swatch::Dot(colour) => canvas.dot((x + 12.0, y), 4.0, *colour)?,
            }
            canvas.text(text, (x + 30.0, y), NORMAL, BLACK, Anchor::Start)?;
            x += entry_width(text);
        }
        y += LEGEND_ROW;
    }
    Ok(())
}

fn entry_width(text: &str) -> f64 {
    52.0 + text_width(text, NORMAL)
}

/// The entries in rows no wider than `width`.
pub fn legend_rows(width: f64, entries: &[(Swatch, String)]) -> Vec<&[(Swatch, String)]> {
    let mut rows = Vec::new();
    let (mut start, mut used) = (0, 0.0);
    for (i, (_, text)) in entries.iter().enumerate() {
        let needed = entry_width(text);
        if i > start && used + needed > width {
            rows.push(&entries[start..i]);
            (start, used) = (i, 0.0);
        }
        used += needed;
    }
    if start < entries.len() {
        rows.push(&entries[start..]);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_legend_breaks_where_the_page_ends() {
        let entry = |text: &str| (Swatch::Dot(BLACK), text.to_string());
        let entries = [entry("first"), entry("second"), entry("third")];
        let lengths = |width| -> Vec<usize> {
            let rows = legend_rows(width, &entries);
            rows.iter().map(|row| row.len()).collect()
        };
        assert_eq!(lengths(1000.0), [3]);
        assert_eq!(lengths(200.0), [2, 1]);
        assert_eq!(lengths(1.0), [1, 1, 1]);
    }
}
