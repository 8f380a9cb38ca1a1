//! A white SVG page with primitives in display pixels. The plotters backend knows whole pixels only, so
//! everything is drawn larger and shown smaller.

use anyhow::{Result, anyhow, bail};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Drawn pixels a display pixel.
const SCALE: f64 = 4.0;
/// plotters divides font sizes by this before it writes them.
const FONT_FACTOR: f64 = 1.24;
/// Mean width of a character over the font size, on the wide side.
const CHARACTER: f64 = 0.58;

/// A page under the pen.
pub struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

/// How a line is drawn.
#[derive(Clone, Copy)]
pub struct Stroke {
    /// Colour and opacity.
    pub colour: RGBAColor,
    /// Width, display pixels.
    pub width: f64,
    /// Dash and gap, display pixels; solid without.
    pub dash: Option<(f64, f64)>,
}

impl Stroke {
    /// A solid line.
    pub fn solid(colour: RGBColor, width: f64) -> Self {
        Self {
            colour: colour.into(),
            width,
            dash: None,
        }
    }

    /// The same line, dashed.
    pub fn dashed(self, dash: f64, gap: f64) -> Self {
        Self {
            dash: Some((dash, gap)),
            ..self
        }
    }
}

/// Where a text stands relative to its point; vertically it is always centred.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// It begins there.
    Start,
    /// It is centred there.
    Middle,
    /// It ends there.
    End,
    /// It is centred there and runs upwards.
    Upwards,
}

/// Draws a page of `width` by `height` display pixels.
///
/// # Errors
/// Whatever `draw` answers; a page that cannot be written.
pub fn page(
    width: f64,
    height: f64,
    draw: impl FnOnce(&Canvas<'_>) -> Result<()>,
) -> Result<String> {
    let size = ((width * SCALE) as u32, (height * SCALE) as u32);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        let canvas = Canvas { area };
        draw(&canvas)?;
        canvas.area.present().map_err(failed)?;
    }
    let drawn = format!(r#"<svg width="{}" height="{}""#, size.0, size.1);
    let shown = format!(r#"<svg width="{width}" height="{height}" stroke-linejoin="round""#);
    Ok(svg.replacen(&drawn, &shown, 1))
}

fn failed(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("cannot draw a figure: {error}")
}

/// Estimated width of `text`, display pixels.
pub fn text_width(text: &str, size: f64) -> f64 {
    text.chars().count() as f64 * size * CHARACTER
}

impl Canvas<'_> {
    /// A line through `points`; fewer than two draw nothing.
    ///
    /// # Errors
    /// A coordinate that is not finite.
    pub fn line(&self, points: &[(f64, f64)], stroke: Stroke) -> Result<()> {
        let mut drawn = drawn(points)?;
        drawn.dedup();
        if drawn.len() < 2 {
            return Ok(());
        }
        let style = ShapeStyle {
            color: stroke.colour,
            filled: false,
            stroke_width: length(stroke.width),
        };
        match stroke.dash {
            None => self.area.draw(&PathElement::new(drawn, style)),
            Some((dash, gap)) => {
                let series = DashedLineSeries::new(drawn, length(dash), length(gap), style);
                return series
                    .into_iter()
                    .try_for_each(|element| self.area.draw(&element).map_err(failed));
            }
        }
        .map_err(failed)
    }

    /// A filled polygon.
    ///
    /// # Errors
    /// A coordinate that is not finite.
    pub fn polygon(&self, points: &[(f64, f64)], colour: RGBAColor) -> Result<()> {
        let polygon = Polygon::new(drawn(points)?, colour);
        self.area.draw(&polygon).map_err(failed)
    }

    /// A rectangle between two corners, filled or outlined by one pixel.
    ///
    /// # Errors
    /// A coordinate that is not finite.
    pub fn rectangle(
        &self,
        corners: [(f64, f64); 2],
        colour: RGBColor,
        filled: bool,
    ) -> Result<()> {
        let [a, b] = corners;
        if !filled {
            let outline = [a, (b.0, a.1), b, (a.0, b.1), a];
            return self.line(&outline, Stroke::solid(colour, 1.0));
        }
        let corners = [pixel(a)?, pixel(b)?];
        let rectangle = Rectangle::new(corners, colour.filled());
        self.area.draw(&rectangle).map_err(failed)
    }

    /// A rectangle between two corners in `steps` colours from left, `colour(0)`, to right, `colour(1)`.
    ///
    /// # Errors
    /// A coordinate that is not finite.
    pub fn gradient(
        &self,
        [a, b]: [(f64, f64); 2],
        steps: usize,
        colour: impl Fn(f64) -> RGBColor,
    ) -> Result<()> {
        // Each piece reaches to the right end, so that no seam shows between two.
        (0..steps).try_for_each(|i| {
            let left = a.0 + (b.0 - a.0) * i as f64 / steps as f64;
            let middle = (i as f64 + 0.5) / steps as f64;
            self.rectangle([(left, a.1), b], colour(middle), true)
        })
    }

    /// A disc with a white rim, so that it stands out from lines.
    ///
    /// # Errors
    /// A coordinate that is not finite.
    pub fn dot(&self, at: (f64, f64), radius: f64, colour: RGBColor) -> Result<()> {
        for (radius, colour) in [(radius + 1.2, WHITE), (radius, colour)] {
            let circle = Circle::new(pixel(at)?, length(radius), colour.filled());
            self.area.draw(&circle).map_err(failed)?;
        }
        Ok(())
    }

    /// A text of `size` display pixels.
    ///
    /// # Errors
    /// A coordinate that is not finite.
    pub fn text(
        &self,
        text: &str,
        at: (f64, f64),
        size: f64,
        colour: RGBColor,
        anchor: Anchor,
    ) -> Result<()> {
        self.write(text, at, size, colour, anchor, FontStyle::Normal)
    }

    /// A bold text in black.
    ///
    /// # Errors
    /// A coordinate that is not finite.
    pub fn heading(&self, text: &str, at: (f64, f64), size: f64, anchor: Anchor) -> Result<()> {
        self.write(text, at, size, BLACK, anchor, FontStyle::Bold)
    }

    fn write(
        &self,
        text: &str,
        at: (f64, f64),
        size: f64,
        colour: RGBColor,
        anchor: Anchor,
        weight: FontStyle,
    ) -> Result<()> {
        let horizontal = match anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle | Anchor::Upwards => HPos::Center,
            Anchor::End => HPos::Right,
        };
        let transform = match anchor {
            Anchor::Upwards => FontTransform::Rotate270,
            _ => FontTransform::None,
        };
        let font = FontDesc::new(FontFamily::SansSerif, size * SCALE * FONT_FACTOR, weight);
        let style = TextStyle::from(font.transform(transform))
            .color(&colour)
            .pos(Pos::new(horizontal, VPos::Center));
        self.area
            .draw_text(text, &style, pixel(at)?)
            .map_err(failed)
    }
}

fn drawn(points: &[(f64, f64)]) -> Result<Vec<(i32, i32)>> {
    points.iter().map(|p| pixel(*p)).collect()
}

fn pixel((x, y): (f64, f64)) -> Result<(i32, i32)> {
    if !(x.is_finite() && y.is_finite()) {
        bail!("a figure would hold a coordinate that is not finite: ({x}, {y})");
    }
    Ok(((x * SCALE).round() as i32, (y * SCALE).round() as i32))
}

fn length(pixels: f64) -> u32 {
    (pixels * SCALE).round().max(1.0) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_drawn_at_its_pixels_on_a_page_of_the_size_asked_for() {
        let svg = page(100.0, 50.0, |canvas| {
            canvas.line(&[(1.0, 2.0), (10.5, 20.25)], Stroke::solid(BLACK, 1.5))
        })
        .unwrap();
        assert!(svg.starts_with(r#"<svg width="100" height="50""#), "{svg}");
        assert!(svg.contains(r#"viewBox="0 0 400 200""#), "{svg}");
        assert!(
            svg.contains(r#"stroke-width="6" points="4,8 42,81 ""#),
            "{svg}"
        );
    }

    #[test]
    fn what_is_not_finite_is_an_error() {
        for bad in [f64::NAN, f64::INFINITY] {
            let svg = page(100.0, 50.0, |canvas| {
                canvas.line(&[(0.0, 0.0), (bad, 1.0)], Stroke::solid(BLACK, 1.0))
            });
            assert!(svg.unwrap_err().to_string().contains("not finite"));
        }
    }
}
