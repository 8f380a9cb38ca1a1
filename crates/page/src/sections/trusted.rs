//! Where the log lies among the trusted ones.

use super::{section, table};
use crate::escape::Text;
use dose3::ood::detector::UnitCalibration;
use dose3::{Detector, Report};
use std::fmt::Write as _;

const WIDTH: f64 = 640.0;
const MARGIN: f64 = 24.0;

/// The mean score of the log, and of each trusted log as the others see it.
pub fn html(detector: &Detector, report: &Report) -> String {
    let units = &detector.header().statistics.calibration().units;
    let mine = report.evidence.mean_score.value();
    let lower = units.iter().filter(|u| u.mean_score.value() < mine).count();
    let intro = format!(
        "<p>Its mean score is {mine:.2}, higher than that of {lower} of {} trusted ones. Each trusted one is scored by \
         the others, as this log is.</p>",
        units.len()
    );
    let mut sorted: Vec<&UnitCalibration> = units.iter().collect();
    sorted.sort_by_key(|unit| std::cmp::Reverse(unit.mean_score));
    let row = |unit: &&UnitCalibration| {
        vec![
            Text(&unit.name).to_string() + if unit.left_out { " (left out)" } else { "" },
            format!("{:.2}", unit.mean_score.value()),
            format!("{} of {}", unit.beyond, unit.windows),
        ]
    };
    let e = &report.evidence;
    let own = vec![
        format!("<b>{}</b>", Text(&report.log.name)),
        format!("<b>{mine:.2}</b>"),
        format!("<b>{} of {}</b>", e.beyond, e.windows),
    ];
    let at = sorted
        .iter()
        .filter(|u| u.mean_score.value() >= mine)
        .count();
    let mut rows: Vec<Vec<String>> = sorted.iter().map(row).collect();
    rows.insert(at, own);
    let table = table(
        &["log", "mean score", "windows beyond the threshold"],
        &rows,
    );
    let content = format!(
        "{intro}<div class=\"scroll\">{}</div><details><summary>The trusted logs in a table</summary>{table}</details>",
        strip(units, mine, &report.log.name)
    );
    section("trusted", "Among the trusted logs", &content)
}

/// One dot a trusted log, a diamond for this one, on a scale on which far is not out of sight.
fn strip(units: &[UnitCalibration], mine: f64, name: &str) -> String {
    let values = units.iter().map(|u| u.mean_score.value()).chain([mine]);
    let (low, high) = values
        .clone()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(v), h.max(v))
        });
    let spread = spread(units);
    let scaled = |v: f64| ((v - low) / spread).asinh();
    let most = scaled(high).max(1e-9);
    let x = |v: f64| MARGIN + (WIDTH - 2.0 * MARGIN) * scaled(v) / most;
    let mut out = format!(
        "<svg class=\"strip\" viewBox=\"0 0 {WIDTH} 84\" role=\"img\" aria-label=\"mean scores of the trusted logs and of this one\">\
         <line class=\"axis\" x1=\"{MARGIN}\" x2=\"{}\" y1=\"44\" y2=\"44\"/>",
        WIDTH - MARGIN
    );
    for unit in units {
        let v = unit.mean_score.value();
        let class = if unit.left_out { "dot out" } else { "dot" };
        let _ = write!(
            out,
            "<circle class=\"{class}\" cx=\"{:.1}\" cy=\"44\" r=\"5\"><title>{}: {v:.2}</title></circle>",
            x(v),
            Text(&unit.name)
        );
    }
    let at = x(mine);
    let anchor = match at {
        a if a < 0.3 * WIDTH => "start",
        a if a > 0.7 * WIDTH => "end",
        _ => "middle",
    };
    let trusted: Vec<f64> = units.iter().map(|u| u.mean_score.value()).collect();
    let ends = [
        trusted.iter().copied().fold(f64::INFINITY, f64::min),
        trusted.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ];
    let _ = write!(
        out,
        "<path class=\"mine\" d=\"M{at:.1} 35l8 9-8 9-8-9z\"><title>{0}: {mine:.2}</title></path>\
         <text x=\"{at:.1}\" y=\"22\" text-anchor=\"{anchor}\">this log, {mine:.2}</text>",
        Text(name)
    );
    // Both ends of the trusted ones, or one number where they would overlap.
    let apart = x(ends[1]) - x(ends[0]) > 120.0;
    let _ = write!(
        out,
        "<text class=\"tick\" x=\"{:.1}\" y=\"74\" text-anchor=\"start\">trusted {:.2}{}</text>",
        x(ends[0]) - 4.0,
        ends[0],
        if apart {
            String::new()
        } else {
            format!(" to {:.2}", ends[1])
        }
    );
    if apart {
        let _ = write!(
            out,
            "<text class=\"tick\" x=\"{:.1}\" y=\"74\" text-anchor=\"middle\">{:.2}</text>",
            x(ends[1]),
            ends[1]
        );
    }
    out + "</svg>"
}

/// How far trusted logs are from each other, the unit of the scale.
fn spread(units: &[UnitCalibration]) -> f64 {
    let values = units.iter().map(|u| u.mean_score.value());
    let highest = values.clone().fold(f64::NEG_INFINITY, f64::max);
    let lowest = values.fold(f64::INFINITY, f64::min);
    (highest - lowest).max(0.1)
}
