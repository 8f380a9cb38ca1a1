//! `dose3 eval`

use super::{computing, read_options, read_set};
use crate::args::Eval;
use crate::terminal::{Bar, count, print, print_json, progress, say};
use anyhow::Result;
use dose3::Detector;
use dose3::evaluate::{Evaluation, MetricReport, evaluate};
use dose3_ood::metrics::Bootstrap;
use std::fmt::Write as _;

pub fn run(args: &Eval) -> Result<()> {
    let detector = Detector::load(&args.detector)?.on(computing(&args.computing));
    let options = read_options(&args.reading);
    let id = read_set(&args.id, &options)?;
    let ood = read_set(&args.ood, &options)?;
    let mut bar = Bar(progress((id.len() + ood.len()) as u64, "logs", false)?);
    let bootstrap = Bootstrap {
        resamples: args.resamples,
        seed: detector.header().plan().seed,
        ..Bootstrap::default()
    };
    let evaluation = evaluate(&detector, &id, &ood, bootstrap, &mut bar)?;
    bar.0.finish_and_clear();
    for name in &evaluation.leaked {
        say(&format!(
            "warning: the detector was fitted on log {name}; its scores are better than those of \
             an unseen log"
        ));
    }
    if args.json {
        print_json(&evaluation)
    } else {
        print(&text(&evaluation))
    }
}

fn text(e: &Evaluation) -> String {
    let mut out = format!(
        "statistics {}, {} draw(s) of {} steps, seed {}, {} bootstrap resamples\n",
        e.statistics, e.draws, e.steps, e.seed, e.resamples
    );
    // Writing to a String cannot fail.
    for (title, (rejected, of)) in [
        ("in distribution", e.id_logs_rejected),
        ("out of distribution", e.ood_logs_rejected),
    ] {
        let _ = writeln!(
            out,
            "{title:<20} {rejected} of {} rejected",
            count(of, "log")
        );
    }
    let _ = writeln!(
        out,
        "\n{:<16} {:>8}  95 % interval over logs",
        "metric", "value"
    );
    let sections = [
        (
            format!("{} ID, {} OOD windows", e.id_windows, e.ood_windows),
            &e.windows,
        ),
        ("logs (mean window score)".to_string(), &e.logs),
    ];
    for (title, metrics) in sections {
        let _ = writeln!(out, "{title}");
        for m in metrics {
            let _ = writeln!(out, "{}", row(m));
        }
    }
    out
}

fn row(m: &MetricReport) -> String {
    let interval = m.estimate.interval.as_ref().map_or_else(
        || "too few logs for an interval".to_string(),
        |i| format!("{:.3} to {:.3}", i.lower, i.upper),
    );
    format!("  {:<14} {:>8.3}  {interval}", m.metric, m.estimate.value)
}
