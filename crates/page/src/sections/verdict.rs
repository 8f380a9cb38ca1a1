//! The verdict, its chance, and what decided.

use super::table;
use crate::escape::Text;
use crate::words;
use dose3::Report;
use dose3::datasets::Trajectory;
use dose3::ood::detector::{Evidence, TestVerdict};
use std::fmt::Write as _;

/// The head of the page.
pub fn head(report: &Report, log: &Trajectory) -> String {
    let (verdict, sentence) = words::verdict(report);
    let e = &report.evidence;
    let class = if e.verdict.differs() { "out" } else { "in" };
    // Not by colour alone: a mark tells the verdicts apart as well.
    let mark = if e.verdict.differs() { "!" } else { "✓" };
    let alike = match e.basis.groups {
        1 => "the trusted one",
        _ => "the trusted ones",
    };
    let called = match e.verdict.differs() {
        true => "called, because the limit is",
        false => "not called: the limit is",
    };
    format!(
        "<header class=\"{class}\"><p class=\"log\">{}</p>\
         <h1><span class=\"mark\" aria-hidden=\"true\">{mark}</span>{}</h1>\
         <p class=\"lead\">{sentence} Of logs like {alike}, {} would be as unusual as this \
         (chance {}); {called} {}.</p><p>{}</p></header>{}",
        Text(&report.log.name),
        capital(verdict),
        words::odds(e.p_value),
        words::chance(e.p_value),
        e.alpha,
        decided(report),
        tiles(report, log),
    )
}

/// With a capital first letter.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => String::new(),
    }
}

fn decided(report: &Report) -> String {
    let deciding = report.evidence.deciding();
    match &deciding.evidence {
        Evidence::Run(run) => {
            let (first, last) = (&report.windows[run.first], &report.windows[run.last]);
            let poses = last.last_pose - first.first_pose + 1;
            let start = report.windows.first().map_or(0, |w| w.first_stamp_ns);
            let seconds = |stamp: i64| stamp.saturating_sub(start) as f64 * 1e-9;
            format!(
                "Decided by its most unusual run of poses: {poses} of them from {} on \
                 (statistics <code>{}</code>).",
                words::duration(seconds(first.first_stamp_ns)),
                Text(&deciding.name)
            )
        }
        Evidence::Finding(sentence) => format!(
            "Decided by its {}: {}.",
            Text(&deciding.name),
            Text(sentence)
        ),
    }
}

fn tiles(report: &Report, log: &Trajectory) -> String {
    let e = &report.evidence;
    let far = match e.excess {
        x if x < 0.1 => "no farther than usual".to_owned(),
        x => format!("{x:.1} ×"),
    };
    let rate = match report.log.rate_is_nominal {
        true => format!("{} Hz, assumed", rounded(report.log.rate_hz)),
        false => format!("{} Hz", rounded(report.log.rate_hz)),
    };
    let tiles = [
        (
            "chance",
            words::chance(e.p_value),
            format!("called at {} or less", e.alpha),
        ),
        (
            "how far",
            far,
            "of what one trusted run in a thousand reaches".to_owned(),
        ),
        (
            "windows beyond the threshold",
            format!("{} of {}", e.beyond, e.windows),
            format!(
                "score above {:.2}; mean {:.2}",
                e.threshold.value(),
                e.mean_score.value()
            ),
        ),
        (
            "the log",
            words::duration(log.duration()),
            format!(
                "{} poses judged at {rate}, {}",
                words::grouped(report.log.poses as u64),
                words::distance(log.distance())
            ),
        ),
    ];
    let mut out = String::from("<dl class=\"tiles\">");
    for (name, value, more) in tiles {
        let _ = write!(
            out,
            "<div><dt>{name}</dt><dd>{value}<small>{more}</small></dd></div>"
        );
    }
    out + "</dl>"
}

/// Two decimals at most.
fn rounded(hertz: f64) -> f64 {
    (100.0 * hertz).round() / 100.0
}

/// How the verdict came about, for those who ask.
pub fn made(report: &Report) -> String {
    let e = &report.evidence;
    let row = |test: &TestVerdict| {
        let said = match &test.evidence {
            Evidence::Run(run) => format!(
                "windows {} to {}, lowest score {:.2}",
                run.first + 1,
                run.last + 1,
                run.score.value()
            ),
            Evidence::Finding(sentence) => Text(sentence).to_string(),
        };
        vec![
            format!("<code>{}</code>", Text(&test.name)),
            words::chance(test.p_value),
            format!("{:.2}", test.share),
            words::chance(test.weighted_p_value()),
            said,
        ]
    };
    let rows: Vec<Vec<String>> = e.tests.iter().map(row).collect();
    let groups: Vec<Vec<String>> = report
        .contributions
        .iter()
        .map(|of| {
            vec![
                format!("<code>{}</code>", Text(&of.group)),
                format!("{:.0} %", 100.0 * of.share_beyond),
                format!("{:.1}", of.excess),
                format!("{:.3}", of.p_value),
            ]
        })
        .collect();
    let basis = &e.basis;
    let rests = match basis.tail {
        true => format!(
            "The chance rests on a tail fitted to {} trusted windows; {} trusted logs alone could say no less than {:.3}.",
            basis.windows, basis.groups, basis.smallest_rank_p
        ),
        false => format!(
            "The chance rests on ranks among {} trusted windows of {} logs.",
            basis.windows, basis.groups
        ),
    };
    format!(
        "<details><summary>How the verdict is made</summary><p>{rests} Every test has a share of the limit; \
         the smallest chance for its share decides. Higher scores are more unusual, everywhere.</p>{}\
         <p>Which statistics drove the scores of the windows that decided: 0 is a usual trusted window, 1 the threshold.</p>{}</details>",
        table(
            &[
                "test",
                "chance alone",
                "share",
                "chance for its share",
                "most unusual"
            ],
            &rows
        ),
        table(&["statistics", "windows beyond", "how far", "p"], &groups)
    )
}
