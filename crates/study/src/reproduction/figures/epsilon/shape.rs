//! Panels of probability densities.

use super::super::canvas::{Canvas, Stroke};
use super::super::legend::Swatch;
use super::super::panel::Panel;
use super::super::select::Selection;
use super::super::{kde, palette};
use anyhow::Result;
use std::ops::Range;

/// Opacity of the area under a curve.
const AREA: f64 = 0.13;

/// One curve of a panel.
pub struct Shape {
    curve: Vec<(f64, f64)>,
    stroke: Stroke,
    filled: bool,
}

impl Shape {
    /// The density of a set's values, in the colour of the `index`-th set.
    pub fn of_set(values: &[f64], range: &Range<f64>, index: usize) -> Self {
        Self {
            curve: kde::density(values, range),
            stroke: Stroke::solid(palette::category(index), 2.0),
            filled: true,
        }
    }

    /// A dashed normal density to compare with.
    pub fn normal(mean: f64, deviation: f64, range: &Range<f64>) -> Self {
        Self {
            curve: kde::normal(mean, deviation, range),
            stroke: reference(),
            filled: false,
        }
    }

    /// Its highest point.
    pub fn peak(&self) -> f64 {
        self.curve.iter().map(|p| p.1).fold(0.0, f64::max)
    }
}

fn reference() -> Stroke {
    Stroke::solid(palette::BLACK, 1.0).dashed(4.0, 3.0)
}

/// Draws the areas, then the lines, then the frame.
///
/// # Errors
/// Coordinates that are not finite.
pub fn draw(canvas: &Canvas<'_>, panel: &Panel, shapes: &[Shape], title: &str) -> Result<()> {
    for shape in shapes.iter().filter(|s| s.filled && !s.curve.is_empty()) {
        let mut area = shape.curve.clone();
        area.extend([(panel.x.end, 0.0), (panel.x.start, 0.0)]);
        let area: Vec<_> = area.into_iter().map(|p| panel.at(p)).collect();
        let mut colour = shape.stroke.colour;
        colour.3 = AREA;
        canvas.polygon(&area, colour)?;
    }
    for shape in shapes {
        panel.line(canvas, &shape.curve, shape.stroke)?;
    }
    panel.frame(canvas)?;
    panel.title(canvas, title, 11.0)
}

/// An entry for each set, and one for the dashed line.
pub fn legend_entries(selections: &[Selection<'_>], dashed: &str) -> Vec<(Swatch, String)> {
    let mut entries: Vec<(Swatch, String)> = selections
        .iter()
        .map(|s| {
            let stroke = Stroke::solid(palette::category(s.index), 2.0);
            (Swatch::Line(stroke), s.set.name.to_string())
        })
        .collect();
    entries.push((Swatch::Line(reference()), dashed.to_string()));
    entries
}
