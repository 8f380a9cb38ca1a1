//! A strip of small panels in columns.

use super::super::canvas::{Anchor, Canvas, Stroke, page};
use super::super::palette::{BLACK, ramp};
use super::super::panel::{NORMAL, Panel, SMALL};
use super::super::ticks;
use super::{Column, ROWS, Sequence, Strip, TICK_EVERY};
use anyhow::Result;
use plotters::style::RGBColor;

/// Length of a heading tick, display pixels.
const TICK: f64 = 11.0;
/// Pieces of different colour along a sequence.
const PIECES: usize = 16;
const WIDTH: f64 = 968.0;
const SIDE: f64 = 104.0;
const ACROSS: f64 = 111.0;
/// Between samples and real windows.
const GAP: f64 = 28.0;
const LEFT: f64 = 40.0;
const TOP: f64 = 50.0;

/// The colour of a pose by its place in the window, first to last.
const ORDER: [(f64, RGBColor); 4] = [
    (0.0, RGBColor(0x2a, 0x1a, 0x6e)),
    (0.4, RGBColor(0x00, 0x72, 0xb2)),
    (0.7, RGBColor(0x00, 0x9e, 0x73)),
    (1.0, RGBColor(0xe6, 0x9f, 0x00)),
];

/// Draws samples to the left and real windows to the right.
///
/// # Errors
/// Coordinates that are not finite.
pub fn draw(samples: &Strip, real: &Strip) -> Result<String> {
    let bottom = TOP + ACROSS * ROWS as f64;
    page(WIDTH, bottom + 88.0, |canvas| {
        draw_strip(canvas, LEFT, samples)?;
        let right = LEFT + ACROSS * samples.columns.len() as f64 + GAP;
        draw_strip(canvas, right, real)?;
        order_bar(canvas, bottom + 64.0)
    })
}

fn draw_strip(canvas: &Canvas<'_>, left: f64, strip: &Strip) -> Result<()> {
    for (i, column) in strip.columns.iter().enumerate() {
        draw_column(canvas, left + ACROSS * i as f64, column, &strip.axes[0])?;
    }
    let width = ACROSS * strip.columns.len() as f64 - (ACROSS - SIDE);
    let middle = left + width / 2.0;
    canvas.heading(strip.heading, (middle, 13.0), NORMAL, Anchor::Middle)?;
    canvas.text(
        &strip.name,
        (middle, TOP - 12.0),
        NORMAL,
        BLACK,
        Anchor::Middle,
    )?;
    for row in 0..ROWS {
        let beside = (left - 12.0, TOP + ACROSS * row as f64 + SIDE / 2.0);
        canvas.text(&strip.axes[1], beside, NORMAL, BLACK, Anchor::Upwards)?;
    }
    Ok(())
}

/// The panels of a column, all of one scale that is named below the last.
fn draw_column(canvas: &Canvas<'_>, left: f64, column: &Column, axis: &str) -> Result<()> {
    let points = column.sequences.iter().flat_map(|s| &s.points);
    let largest = points.fold(0.0_f64, |m, (x, y)| m.max(x.abs()).max(y.abs()));
    // Room for a heading tick on every side.
    let half = largest.max(0.5) * SIDE / (SIDE - 2.0 * (TICK + 2.0));
    let above = (left + SIDE / 2.0, TOP - 12.0);
    canvas.text(&column.title, above, NORMAL, BLACK, Anchor::Middle)?;
    for (row, sequence) in column.sequences.iter().enumerate() {
        let panel = Panel {
            left,
            top: TOP + ACROSS * row as f64,
            width: SIDE,
            height: SIDE,
            x: -half..half,
            y: -half..half,
        };
        draw_sequence(canvas, &panel, sequence)?;
        panel.frame(canvas)?;
        if row + 1 == column.sequences.len() {
            scale(canvas, &panel, axis)?;
        }
    }
    Ok(())
}

/// Ticks at zero and at a round number on both sides.
fn scale(canvas: &Canvas<'_>, panel: &Panel, axis: &str) -> Result<()> {
    let bottom = panel.top + panel.height;
    let ticks = ticks::ticks(&panel.x, 5);
    for (tick, label) in ticks.iter().zip(ticks::labels(&ticks)) {
        let (x, _) = panel.at((*tick, 0.0));
        canvas.line(&[(x, bottom), (x, bottom + 4.0)], Stroke::solid(BLACK, 1.0))?;
        canvas.text(&label, (x, bottom + 12.0), SMALL, BLACK, Anchor::Middle)?;
    }
    let below = (panel.left + panel.width / 2.0, bottom + 27.0);
    canvas.text(axis, below, NORMAL, BLACK, Anchor::Middle)
}

fn draw_sequence(canvas: &Canvas<'_>, panel: &Panel, sequence: &Sequence) -> Result<()> {
    let points: Vec<(f64, f64)> = sequence.points.iter().map(|p| panel.at(*p)).collect();
    let colour = |i: usize| ramp(&ORDER, i as f64 / (points.len() - 1).max(1) as f64);
    for (i, (heading, (x, y))) in sequence.headings.iter().zip(&points).enumerate() {
        if i % TICK_EVERY == 0 {
            // Page coordinates grow downwards.
            let tip = (x + TICK * heading.0, y - TICK * heading.1);
            canvas.line(&[(*x, *y), tip], Stroke::solid(BLACK, 0.8))?;
        }
    }
    let length = points.len().div_ceil(PIECES).max(1);
    for start in (0..points.len()).step_by(length) {
        let end = (start + length + 1).min(points.len());
        let middle = (start + end - 1) / 2;
        canvas.line(&points[start..end], Stroke::solid(colour(middle), 1.2))?;
    }
    Ok(())
}

/// The colours from the first to the last pose.
fn order_bar(canvas: &Canvas<'_>, y: f64) -> Result<()> {
    const BAR: (f64, f64) = (330.0, 180.0);
    let (left, width) = BAR;
    let corners = [(left, y - 5.0), (left + width, y + 5.0)];
    canvas.gradient(corners, 90, |share| ramp(&ORDER, share))?;
    canvas.text("first pose", (left - 8.0, y), NORMAL, BLACK, Anchor::End)?;
    canvas.text(
        "last pose",
        (left + width + 8.0, y),
        NORMAL,
        BLACK,
        Anchor::Start,
    )?;
    let tick = left + width + 110.0;
    canvas.line(&[(tick, y), (tick + TICK, y)], Stroke::solid(BLACK, 0.8))?;
    canvas.text(
        "where the body looks",
        (tick + TICK + 8.0, y),
        NORMAL,
        BLACK,
        Anchor::Start,
    )
}
