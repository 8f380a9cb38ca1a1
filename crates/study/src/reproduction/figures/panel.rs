//! One set of axes.

use super::canvas::{Anchor, Canvas, Stroke};
use super::palette::{BLACK, GREY};
use super::ticks;
use anyhow::Result;
use std::ops::Range;

/// Font size of tick labels, display pixels.
pub const SMALL: f64 = 10.5;
/// Font size of axis labels and legends.
pub const NORMAL: f64 = 12.0;
/// Font size of titles.
pub const LARGE: f64 = 13.0;
const TICK: f64 = 4.0;

/// A rectangle of the page that shows a rectangle of the data.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Left edge, display pixels.
    pub left: f64,
    /// Upper edge.
    pub top: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
    /// What lies between the left and right edge.
    pub x: Range<f64>,
    /// What lies between the lower and upper edge.
    pub y: Range<f64>,
}

impl Panel {
    /// The point of the page that shows `(x, y)`.
    pub fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (
            self.left + (x - self.x.start) / (self.x.end - self.x.start) * self.width,
            self.top + (self.y.end - y) / (self.y.end - self.y.start) * self.height,
        )
    }

    /// A line in the data's coordinates.
    ///
    /// # Errors
    /// Coordinates that are not finite.
    pub fn line(&self, canvas: &Canvas<'_>, points: &[(f64, f64)], stroke: Stroke) -> Result<()> {
        let points: Vec<_> = points.iter().map(|p| self.at(*p)).collect();
        canvas.line(&points, stroke)
    }

    /// The frame.
    ///
    /// # Errors
    /// Coordinates that are not finite.
    pub fn frame(&self, canvas: &Canvas<'_>) -> Result<()> {
        let far = (self.left + self.width, self.top + self.height);
        canvas.rectangle([(self.left, self.top), far], GREY, false)
    }

    /// A title `above` pixels above the frame.
    ///
    /// # Errors
    /// Coordinates that are not finite.
    pub fn title(&self, canvas: &Canvas<'_>, title: &str, above: f64) -> Result<()> {
        let middle = (self.left + self.width / 2.0, self.top - above);
        canvas.heading(title, middle, LARGE, Anchor::Middle)
    }

    /// Ticks, their labels and the name of the horizontal axis, about `count` of them.
    ///
    /// # Errors
    /// Coordinates that are not finite.
    pub fn x_axis(&self, canvas: &Canvas<'_>, name: &str, count: usize) -> Result<()> {
        let ticks = ticks::ticks(&self.x, count);
        let bottom = self.top + self.height;
        for (tick, label) in ticks.iter().zip(ticks::labels(&ticks)) {
            let (x, _) = self.at((*tick, self.y.start));
            canvas.line(&[(x, bottom), (x, bottom + TICK)], axis())?;
            canvas.text(&label, (x, bottom + 12.0), SMALL, BLACK, Anchor::Middle)?;
        }
        let below = (self.left + self.width / 2.0, bottom + 29.0);
        canvas.text(name, below, NORMAL, BLACK, Anchor::Middle)
    }

    /// As [`Self::x_axis`] for the vertical axis.
    ///
    /// # Errors
    /// Coordinates that are not finite.
    pub fn y_axis(&self, canvas: &Canvas<'_>, name: &str, count: usize) -> Result<()> {
        let ticks = ticks::ticks(&self.y, count);
        let labels = ticks::labels(&ticks);
        for (tick, label) in ticks.iter().zip(&labels) {
            let (_, y) = self.at((self.x.start, *tick));
            canvas.line(&[(self.left - TICK, y), (self.left, y)], axis())?;
            canvas.text(label, (self.left - 7.0, y), SMALL, BLACK, Anchor::End)?;
        }
        let widest = labels.iter().map(|l| l.chars().count()).max().unwrap_or(0);
        let beside = self.left - 18.0 - widest as f64 * 6.6;
        let middle = (beside, self.top + self.height / 2.0);
        canvas.text(name, middle, NORMAL, BLACK, Anchor::Upwards)
    }
}

fn axis() -> Stroke {
    Stroke::solid(GREY, 1.0)
}

/// The narrowest ranges of one scale, centred on the data, that show all `points` in `width` by `height` pixels.
pub fn equal_aspect(
    points: impl Iterator<Item = (f64, f64)> + Clone,
    width: f64,
    height: f64,
) -> (Range<f64>, Range<f64>) {
    let extent = |pick: fn((f64, f64)) -> f64| {
        points
            .clone()
            .map(pick)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            })
    };
    let ((left, right), (low, high)) = (extent(|p| p.0), extent(|p| p.1));
    if !(left <= right && low <= high) {
        return (0.0..1.0, 0.0..height / width);
    }
    let unit = (1.1 * ((right - left) / width).max((high - low) / height)).max(1e-9);
    let around = |a: f64, b: f64, pixels: f64| {
        let (middle, half) = ((a + b) / 2.0, unit * pixels / 2.0);
        middle - half..middle + half
    };
    (around(left, right, width), around(low, high, height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_the_data_are_corners_of_the_panel() {
        let panel = Panel {
            left: 10.0,
            top: 20.0,
            width: 100.0,
            height: 50.0,
            x: -1.0..1.0,
            y: 0.0..5.0,
        };
        assert_eq!(panel.at((-1.0, 0.0)), (10.0, 70.0));
        assert_eq!(panel.at((1.0, 5.0)), (110.0, 20.0));
        assert_eq!(panel.at((0.0, 2.5)), (60.0, 45.0));
    }

    #[test]
    fn both_axes_have_the_same_metres_a_pixel_and_hold_all_points() {
        let points = [(0.0, 0.0), (10.0, 40.0)];
        let (x, y) = equal_aspect(points.into_iter(), 200.0, 100.0);
        assert!(((x.end - x.start) / 200.0 - (y.end - y.start) / 100.0).abs() < 1e-12);
        assert!((x.start + x.end - 10.0).abs() < 1e-9 && (y.start + y.end - 40.0).abs() < 1e-9);
        assert!(y.start < 0.0 && y.end > 40.0);
        let (x, y) = equal_aspect([(3.0, 3.0)].into_iter(), 10.0, 10.0);
        assert!(x.start < x.end && y.start < y.end);
    }
}
