//! What the log shows as a whole: stamps, gaps, lost tracking, calibration.

use super::{list, section, table};
use crate::escape::Text;
use crate::words;
use dose3::Report;
use dose3::datasets::{LostSpan, Trajectory, stretches};
use dose3::ood::timing::Symptom;

/// Gaps and places of lost tracking that are named.
const SHOWN: usize = 8;

/// Stamps, gaps and lost tracking; `log` as it was read.
pub fn timing(report: &Report, log: &Trajectory) -> String {
    let mut out = String::new();
    match &report.whole.timing {
        None => out.push_str(
            "<p>Stamps are not compared: this log or the trusted logs have none, or it was not asked for.</p>",
        ),
        Some(timing) => {
            out.push_str(&match timing.events.is_empty() {
                true => "<p>Stamps come as those of the trusted logs.</p>".to_owned(),
                false => list(&timing.events),
            });
            let rows: Vec<Vec<String>> = timing
                .findings
                .iter()
                .map(|f| {
                    vec![
                        f.symptom.to_string(),
                        value(f.symptom, f.value),
                        value(f.symptom, f.trusted),
                        words::chance(f.chance),
                    ]
                })
                .collect();
            out.push_str("<details><summary>All that was compared</summary>");
            out.push_str(&table(&["of the stamps", "this log", "trusted at most", "chance"], &rows));
            out.push_str("</details>");
        }
    }
    out.push_str(&gaps(log));
    out.push_str(&lost(log));
    section("timing", "Stamps, gaps, lost tracking", &out)
}

/// A symptom's value in its unit.
fn value(symptom: Symptom, value: f64) -> String {
    match symptom {
        Symptom::Lost | Symptom::Crowded => format!("{:.1} % of steps", 100.0 * value),
        Symptom::Pause | Symptom::Start => format!("{value:.3} s"),
        Symptom::Irregular => format!("{:.1} % of a period", 100.0 * value),
        Symptom::Pace => format!("{:.1} %", 100.0 * value.exp_m1()),
        Symptom::Rate => format!("{:.2} Hz", (-value).exp()),
    }
}

fn gaps(log: &Trajectory) -> String {
    let pieces = stretches(log, log.max_gap);
    let start = log.stamps.first().copied().unwrap_or_default();
    let seconds = |pose: usize| log.stamps[pose].saturating_sub(start) as f64 * 1e-9;
    let sentences: Vec<String> = pieces
        .windows(2)
        .take(SHOWN)
        .map(|pair| {
            let (last, next) = (pair[0].end - 1, pair[1].start);
            format!(
                "{} from {:.1} s on, between {} {} and {}",
                words::duration(seconds(next) - seconds(last)),
                seconds(last),
                log.row_kind,
                log.rows[last],
                log.rows[next]
            )
        })
        .collect();
    let count = pieces.len().saturating_sub(1);
    match count {
        0 => "<p>No gap.</p>".to_owned(),
        _ => format!(
            "<p>{count} {} that no window crosses{}:</p>{}",
            if count == 1 { "gap" } else { "gaps" },
            first(count),
            list(sentences)
        ),
    }
}

fn lost(log: &Trajectory) -> String {
    let spans = &log.report.lost;
    let sentence = |span: &LostSpan| {
        format!(
            "{}s {} to {}: {} rows ({})",
            log.row_kind, span.first_row, span.last_row, span.rows, span.kind
        )
    };
    match spans.len() {
        0 => String::new(),
        count => format!(
            "<p>Tracking was lost in {} rows, {count} {}{}:</p>{}",
            log.report.lost_rows(),
            if count == 1 { "place" } else { "places" },
            first(count),
            list(spans.iter().take(SHOWN).map(sentence))
        ),
    }
}

fn first(count: usize) -> String {
    match count > SHOWN {
        true => format!(", the first {SHOWN} of them"),
        false => String::new(),
    }
}

/// Whether position and attitude belong together.
pub fn calibration(report: &Report) -> String {
    let content = match &report.whole.calibration {
        None => "<p>Not compared: the log or the trusted logs are too short for it, or it was not asked for.</p>".to_owned(),
        Some(finding) => {
            let sentence = finding.sentence(report.log.named_axes);
            let said = match (finding.called, finding.chance <= 0.05) {
                (true, _) => "called",
                (false, true) => "unusual, but not called",
                (false, false) => "within what trusted logs show",
            };
            let measured = &finding.measured;
            format!(
                "<p>Position against attitude: {said}. The largest difference from the trusted logs reads as \
                 “{}” (chance {}).</p><p class=\"more\">Of {} pieces of {} trusted logs, {} would be called by those of the others.</p>",
                Text(sentence),
                words::chance(finding.chance),
                measured.pieces,
                measured.groups,
                measured.called
            )
        }
    };
    section("calibration", "Calibration", &content)
}
