//! ROC curves, a panel for each pair of sets.

use super::super::record::Curve;
use super::canvas::{Anchor, Canvas, Stroke, page};
use super::legend::{LEGEND_ROW, Swatch, legend, legend_rows};
use super::panel::{Panel, SMALL};
use super::simplify::simplify;
use super::{Figure, RocPanel, palette};
use anyhow::{Result, bail};

const WIDTH: f64 = 960.0;
const COLUMNS: usize = 3;
/// Side of a panel.
const SIDE: f64 = 244.0;
/// From one column to the next.
const ACROSS: f64 = 308.0;
/// Areas in a line above a panel.
const AREAS: usize = 6;
/// Height of such a line.
const LINE: f64 = 15.0;
/// What a row needs beside the panels and the lines of areas.
const AROUND: f64 = 78.0;
/// A point closer to the line than this is not drawn: a tenth of a pixel.
const TOLERANCE: f64 = 0.1 / SIDE;

/// Draws all panels, three a row, with the area under each curve above them.
///
/// # Errors
/// No panel; a curve with a point outside [0, 1] or that does not ascend.
pub fn roc(panels: &[RocPanel]) -> Result<Figure> {
    if panels.is_empty() {
        bail!("a ROC figure needs a pair of sets");
    }
    panels.iter().flat_map(|p| &p.curves).try_for_each(check)?;
    let methods = methods(panels);
    let entries: Vec<(Swatch, String)> = methods
        .iter()
        .enumerate()
        .map(|(i, label)| (Swatch::Line(stroke(i)), (*label).to_string()))
        .chain([(Swatch::Line(chance()), "chance".to_string())])
        .collect();
    let head = 12.0 + LEGEND_ROW * legend_rows(WIDTH, &entries).len() as f64;
    let areas = LINE * methods.len().div_ceil(AREAS) as f64;
    let row = AROUND + SIDE + areas;
    let height = head + row * panels.len().div_ceil(COLUMNS) as f64;
    let svg = page(WIDTH, height, |canvas| {
        legend(canvas, (0.0, WIDTH), 16.0, &entries)?;
        for (i, roc) in panels.iter().enumerate() {
            let panel = Panel {
                left: 66.0 + ACROSS * (i % COLUMNS) as f64,
                top: head + 32.0 + areas + row * (i / COLUMNS) as f64,
                width: SIDE,
                height: SIDE,
                x: 0.0..1.0,
                y: 0.0..1.0,
            };
            draw(canvas, &panel, roc, &methods)?;
        }
        Ok(())
    })?;
    let titles: Vec<&str> = panels.iter().map(|p| p.title.as_str()).collect();
    Ok(Figure {
        key: "roc",
        title: "ROC curves of every pair of data sets".into(),
        caption: format!(
            "ROC curves, a panel for each pair ID/OOD ({}), out-of-distribution windows positive. Numbers above \
             a panel: the area under each curve, in the colour and order of the legend. Dashed: chance.",
            titles.join(", ")
        ),
        svg,
    })
}

fn check(curve: &Curve) -> Result<()> {
    let inside = |p: &(f64, f64)| (0.0..=1.0).contains(&p.0) && (0.0..=1.0).contains(&p.1);
    let ascends = |p: &[(f64, f64)]| p[0].0 <= p[1].0 && p[0].1 <= p[1].1;
    if !curve.points.iter().all(inside) || !curve.points.windows(2).all(ascends) {
        bail!("the points of {} are no ROC curve", curve.label);
    }
    Ok(())
}

/// The methods of all panels, in the order in which they first appear.
fn methods(panels: &[RocPanel]) -> Vec<&str> {
    let mut methods: Vec<&str> = Vec::new();
    for curve in panels.iter().flat_map(|p| &p.curves) {
        if !methods.contains(&curve.label.as_str()) {
            methods.push(&curve.label);
        }
    }
    methods
}

fn stroke(method: usize) -> Stroke {
    let solid = Stroke::solid(palette::category(method), 1.8);
    match palette::round(method) {
        0 => solid,
        n => solid.dashed(4.0 * n as f64, 3.0),
    }
}

fn chance() -> Stroke {
    Stroke::solid(palette::GREY, 1.0).dashed(4.0, 3.0)
}

fn draw(canvas: &Canvas<'_>, panel: &Panel, roc: &RocPanel, methods: &[&str]) -> Result<()> {
    panel.line(canvas, &[(0.0, 0.0), (1.0, 1.0)], chance())?;
    let of = |method: &str| roc.curves.iter().find(|c| c.label == method);
    // The first methods lie on top.
    for (i, method) in methods.iter().enumerate().rev() {
        if let Some(curve) = of(method) {
            panel.line(canvas, &simplify(&curve.points, TOLERANCE), stroke(i))?;
        }
    }
    let lines = methods.len().div_ceil(AREAS);
    let slots = methods.len().min(AREAS);
    for (i, method) in methods.iter().enumerate() {
        let (line, place) = (i / AREAS, i % AREAS);
        let at = (
            panel.left + (place as f64 + 0.5) * panel.width / slots as f64,
            panel.top - LINE * (lines - line) as f64 + 6.0,
        );
        let area = of(method).map_or_else(|| "–".to_string(), |c| format!("{:.3}", area(c)));
        let colour = palette::dark(palette::category(i));
        canvas.text(&area, at, SMALL, colour, Anchor::Middle)?;
    }
    panel.frame(canvas)?;
    panel.title(canvas, &roc.title, 12.0 + LINE * lines as f64)?;
    panel.x_axis(canvas, "false positive rate", 5)?;
    panel.y_axis(canvas, "true positive rate", 5)
}

/// Area under a curve from (0, 0) to (1, 1) through its points.
fn area(curve: &Curve) -> f64 {
    let points = [(0.0, 0.0)].into_iter().chain(curve.points.iter().copied());
    let ahead = curve.points.iter().copied().chain([(1.0, 1.0)]);
    let trapezoid = |(a, b): ((f64, f64), (f64, f64))| (b.0 - a.0) * (a.1 + b.1) / 2.0;
    points.zip(ahead).map(trapezoid).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(label: &str, points: &[(f64, f64)]) -> Curve {
        Curve {
            label: label.into(),
            points: points.to_vec(),
        }
    }

    fn panel(title: &str, curves: Vec<Curve>) -> RocPanel {
        RocPanel {
            title: title.into(),
            curves,
        }
    }

    #[test]
    fn a_curve_stands_where_its_points_are() {
        let step = curve("step", &[(0.0, 0.0), (0.0, 0.5), (0.5, 1.0), (1.0, 1.0)]);
        let figure = roc(&[panel("K/O", vec![step])]).unwrap();
        // The panel spans x 66 to 310 and y 78 to 322 of the page, four drawn pixels a display pixel.
        let drawn = r#"points="264,1288 264,800 752,312 1240,312 ""#;
        assert!(figure.svg.contains(drawn), "{}", figure.svg);
        assert!(figure.svg.contains("0.875") && figure.svg.contains("K/O"));
        assert!(!figure.svg.contains("NaN"));
    }

    #[test]
    fn every_method_keeps_its_colour_and_a_missing_one_is_marked() {
        let line = [(0.0, 0.0), (0.2, 0.8), (1.0, 1.0)];
        let both = vec![curve("a", &line), curve("b", &line)];
        let figure = roc(&[panel("V/H", both), panel("H/V", vec![curve("b", &line)])]).unwrap();
        let second = format!("stroke=\"#{}\"", "0072B2");
        // In the legend and in both panels.
        assert_eq!(figure.svg.matches(&second).count(), 3);
        assert!(figure.svg.contains('–'));
    }

    #[test]
    fn what_is_no_curve_is_refused() {
        assert!(roc(&[]).is_err());
        for points in [
            &[(0.0, 0.0), (1.5, 1.0)][..],
            &[(0.0, 0.0), (0.5, f64::NAN)],
            &[(0.5, 0.5), (0.4, 0.6)],
        ] {
            assert!(roc(&[panel("K/O", vec![curve("bad", points)])]).is_err());
        }
        assert_eq!(area(&curve("nothing", &[])), 0.5);
    }
}
