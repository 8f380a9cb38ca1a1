//! Plots, as SVG text.

use anyhow::{Result, anyhow};
use dose3_diffusion::trainer::LogRow;
use plotters::prelude::*;

const TRAIN: RGBColor = RGBColor(0x1f, 0x77, 0xb4);
const VALIDATION: RGBColor = RGBColor(0xd6, 0x27, 0x28);

/// Training and validation loss per branch against the optimiser step, logarithmic loss axis.
///
/// # Errors
/// A log without rows, or values that cannot be drawn.
pub fn losses(rows: &[LogRow]) -> Result<String> {
    if rows.is_empty() {
        return Err(anyhow!("the training log has no rows to plot"));
    }
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (900, 360)).into_drawing_area();
        let draw = |e: &dyn std::fmt::Display| anyhow!("cannot draw the loss plot: {e}");
        root.fill(&WHITE).map_err(|e| draw(&e))?;
        let (left, right) = root.split_horizontally(450);
        panel(
            &left,
            "translation noise, mean L1",
            rows,
            |r| r.translation_eps,
            |r| r.translation_validation,
        )?;
        panel(
            &right,
            "rotation noise, mean squared angle (rad²)",
            rows,
            |r| r.rotation_eps,
            |r| r.rotation_validation,
        )?;
        root.present().map_err(|e| draw(&e))?;
    }
    Ok(svg)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn panel(
    area: &Area<'_>,
    title: &str,
    rows: &[LogRow],
    train: impl Fn(&LogRow) -> f64,
    validation: impl Fn(&LogRow) -> Option<f64>,
) -> Result<()> {
    let draw = |e: &dyn std::fmt::Display| anyhow!("cannot draw {title}: {e}");
    let train: Vec<(f64, f64)> = rows.iter().map(|r| (r.step as f64, train(r))).collect();
    let validation: Vec<(f64, f64)> = rows
        .iter()
        .filter_map(|r| Some((r.step as f64, validation(r)?)))
        .collect();
    let values = train
        .iter()
        .chain(&validation)
        .map(|p| p.1)
        .filter(|v| *v > 0.0);
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    let last = rows.last().map_or(1.0, |r| r.step as f64);
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 15))
        .margin(8)
        .x_label_area_size(32)
        .y_label_area_size(48)
        .build_cartesian_2d(0.0..last, (low * 0.9..high * 1.1).log_scale())
        .map_err(|e| draw(&e))?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .x_desc("optimiser step")
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&|y| format!("{y:.2}"))
        .x_labels(6)
        .y_labels(8)
        .draw()
        .map_err(|e| draw(&e))?;
    chart
        .draw_series(LineSeries::new(train, TRAIN.stroke_width(1)))
        .map_err(|e| draw(&e))?
        .label("training")
        .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], TRAIN.stroke_width(2)));
    if !validation.is_empty() {
        chart
            .draw_series(LineSeries::new(validation, VALIDATION.stroke_width(2)))
            .map_err(|e| draw(&e))?
            .label("held-out logs")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], VALIDATION.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .draw()
        .map_err(|e| draw(&e))?;
    Ok(())
}
