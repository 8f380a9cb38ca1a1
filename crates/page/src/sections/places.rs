//! Where: the stretches and the poses that stick out.

use super::{place_button, reasons, section};
use crate::escape::Text;
use crate::words;
use dose3::Report;
use dose3::report::{Place, PoseSpan, Segment};
use std::fmt::Write as _;

/// Rows that are shown; the rest are in the charts.
const SHOWN: usize = 12;

/// A list of stretches, each a button that shows it in the charts.
pub fn html(report: &Report) -> String {
    if report.segments.is_empty() {
        let nothing = "<p>No window is beyond the threshold.</p>";
        return section("where", "Where", nothing);
    }
    let mut order: Vec<&Segment> = report.segments.iter().collect();
    order.sort_by_key(|segment| std::cmp::Reverse(segment.worst_score));
    let mut out = String::from("<ol class=\"stretches\">");
    for segment in order.into_iter().take(SHOWN) {
        let _ = write!(
            out,
            "<li><button type=\"button\" data-from=\"{:.3}\" data-to=\"{:.3}\"><b>{}</b> \
             <span>{}</span> <span class=\"score\">worst score {:.2}</span></button>{}{}</li>",
            segment.place.start_s,
            segment.place.end_s,
            Text(words::rows(report, &segment.place)),
            when(&segment.place),
            segment.worst_score.value(),
            reasons::list(report, &segment.reasons),
            spans_within(report, segment)
        );
    }
    out.push_str("</ol>");
    let more = report.segments.len().saturating_sub(SHOWN);
    if more > 0 {
        let _ = write!(
            out,
            "<p>And {more} more, marked in the chart of scores.</p>"
        );
    }
    section("where", "Where", &out)
}

fn when(place: &Place) -> String {
    let stamps = match (&place.first_stamp, &place.last_stamp) {
        (Some(first), Some(last)) => format!(", stamps {} to {}", Text(first), Text(last)),
        _ => String::new(),
    };
    format!("{:.1} s to {:.1} s{stamps}", place.start_s, place.end_s)
}

/// Poses within a stretch that stick out, the worst first.
fn spans_within(report: &Report, segment: &Segment) -> String {
    const OF_ONE: usize = 3;
    let within = |span: &&PoseSpan| {
        (segment.place.first_pose..=segment.place.last_pose).contains(&span.place.first_pose)
    };
    let spans: Vec<String> = report
        .pose_spans
        .iter()
        .filter(within)
        .take(OF_ONE)
        .map(|span| {
            format!(
                "{} {:.1} times a trusted extreme",
                place_button(report, &span.place),
                span.worst_score.value()
            )
        })
        .collect();
    match spans.is_empty() {
        true => String::new(),
        false => format!("<small>Poses that stick out: {}</small>", spans.join(", ")),
    }
}
