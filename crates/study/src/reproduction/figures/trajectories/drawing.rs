//! Panels of coloured logs over a colour bar.

use super::super::canvas::{Anchor, Canvas, Stroke, page};
use super::super::legend::{Swatch, legend};
use super::super::palette::{BLACK, LIGHT_GREY};
use super::super::panel::{Panel, SMALL, equal_aspect};
use super::super::plane::Plane;
use super::super::simplify::simplify;
use super::scale::ScoreScale;
use super::scored::ScoredLog;
use anyhow::Result;

const WIDTH: f64 = 960.0;
const COLUMNS: usize = 2;
const PANEL: (f64, f64) = (398.0, 300.0);
const ACROSS: f64 = 472.0;
const DOWN: f64 = 396.0;
const BAR: f64 = 96.0;
/// A pose closer to the line than this many pixels is not drawn.
const TOLERANCE: f64 = 0.15;

/// Draws all logs.
///
/// # Errors
/// Coordinates that are not finite.
pub fn draw(logs: &[ScoredLog<'_>], scale: &ScoreScale, trusted: &str) -> Result<String> {
    let rows = DOWN * logs.len().div_ceil(COLUMNS) as f64;
    page(WIDTH, rows + BAR, |canvas| {
        for (i, log) in logs.iter().enumerate() {
            let corner = (
                76.0 + ACROSS * (i % COLUMNS) as f64,
                48.0 + DOWN * (i / COLUMNS) as f64,
            );
            panel(canvas, corner, log, scale)?;
        }
        let entries = [
            (Swatch::Dot(BLACK), "start".to_string()),
            (
                Swatch::Line(Stroke::solid(LIGHT_GREY, 2.4)),
                "in no whole window".to_string(),
            ),
        ];
        legend(canvas, (690.0, 940.0), rows + 34.0, &entries[..1])?;
        legend(canvas, (690.0, 940.0), rows + 54.0, &entries[1..])?;
        scale.bar(canvas, (76.0, rows + 34.0), 600.0, trusted)
    })
}

fn panel(
    canvas: &Canvas<'_>,
    (left, top): (f64, f64),
    scored: &ScoredLog<'_>,
    scale: &ScoreScale,
) -> Result<()> {
    let poses = &scored.log.poses[scored.poses.clone()];
    let plane = Plane::of_motion(scored.log.frame, poses);
    let (x0, y0) = poses
        .first()
        .map_or((0.0, 0.0), |p| plane.project(&p.translation));
    let points: Vec<(f64, f64)> = poses
        .iter()
        .map(|p| plane.project(&p.translation))
        .map(|(x, y)| (x - x0, y - y0))
        .collect();
    let (x, y) = equal_aspect(points.iter().copied(), PANEL.0, PANEL.1);
    let panel = Panel {
        left,
        top,
        width: PANEL.0,
        height: PANEL.1,
        x,
        y,
    };
    let drawn: Vec<(f64, f64)> = points.iter().map(|p| panel.at(*p)).collect();
    let levels: Vec<Option<usize>> = scored.surprise.iter().map(|s| scale.level(*s)).collect();
    for (level, line) in pieces(&drawn, &levels) {
        let stroke = Stroke::solid(scale.colour(level), 2.4);
        canvas.line(&simplify(line, TOLERANCE), stroke)?;
    }
    if let Some(start) = drawn.first() {
        canvas.dot(*start, 4.0, BLACK)?;
    }
    panel.frame(canvas)?;
    panel.title(
        canvas,
        &format!("{}, log {}", scored.set.name, scored.log.name),
        27.0,
    )?;
    let said = format!(
        "{} of {} windows beyond the threshold",
        scored.beyond, scored.windows
    );
    let below = (left + PANEL.0 / 2.0, top - 11.0);
    canvas.text(&said, below, SMALL, BLACK, Anchor::Middle)?;
    panel.x_axis(canvas, &format!("{} (m)", plane.names[0]), 6)?;
    panel.y_axis(canvas, &format!("{} (m)", plane.names[1]), 6)
}

/// A level and the part of a line that has it.
type Piece<'a> = (Option<usize>, &'a [(f64, f64)]);

/// The line in pieces of one level each; a piece ends where the next begins.
fn pieces<'a>(line: &'a [(f64, f64)], levels: &[Option<usize>]) -> Vec<Piece<'a>> {
    let mut pieces = Vec::new();
    let mut start = 0;
    for i in 1..=line.len().min(levels.len()) {
        if i == line.len() || levels[i] != levels[start] {
            pieces.push((levels[start], &line[start..(i + 1).min(line.len())]));
            start = i;
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_meet() {
        let line: Vec<(f64, f64)> = (0..5).map(|i| (f64::from(i), 0.0)).collect();
        let levels = [Some(1), Some(1), Some(2), None, None];
        let found = pieces(&line, &levels);
        assert_eq!(
            found,
            [
                (Some(1), &line[..3]),
                (Some(2), &line[2..4]),
                (None, &line[3..])
            ]
        );
        assert!(pieces(&[], &[]).is_empty());
    }
}
