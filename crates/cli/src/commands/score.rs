//! `dose3 score`

use super::{Bar, computing, count, print, print_json, progress, read_options, say, say_skipped};
use crate::args::Score;
use crate::explain::explain;
use anyhow::{Result, bail};
use dose3::logs::find_each;
use dose3::ood::fdr::benjamini_hochberg;
use dose3::{Detector, JudgeOptions, Report, Trajectory};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// What `score --json` prints.
#[derive(Serialize)]
struct Output<'a> {
    detector: String,
    statistics: String,
    seed: u64,
    draws: usize,
    steps: usize,
    logs: &'a [Report],
    errors: &'a [Failure],
    skipped: &'a [Failure],
}

#[derive(Serialize)]
struct Failure {
    path: String,
    error: String,
}

pub fn run(args: &Score) -> Result<u8> {
    if let Some(alpha) = args.alpha.filter(|a| !(*a > 0.0 && *a < 1.0)) {
        bail!("--alpha {alpha}: expected a share between 0 and 1");
    }
    if let Some(level) = args.fdr.filter(|l| !(*l > 0.0 && *l < 1.0)) {
        bail!("--fdr {level}: expected a share between 0 and 1");
    }
    let detector = Detector::load(&args.detector)?.on(computing(&args.computing));
    let (mut reports, mut failures) = (Vec::new(), Vec::new());
    let found = find_each(&args.logs, &read_options(&args.reading))?;
    say_skipped(&found.skipped);
    let skipped: Vec<Failure> = found
        .skipped
        .iter()
        .map(|(path, error)| Failure {
            path: path.display().to_string(),
            error: error.clone(),
        })
        .collect();
    for (path, log) in found.logs {
        let judged = log.map_err(anyhow::Error::from);
        match judged.and_then(|log| judge(&detector, args, &log)) {
            Ok(report) => {
                if !args.json {
                    print(&text(&report, args.windows))?;
                }
                reports.push(report);
            }
            Err(error) => failures.push(failure(&path, &error)),
        }
    }
    if args.json {
        let plan = detector.header().plan();
        print_json(&Output {
            detector: args.detector.display().to_string(),
            statistics: detector.header().statistics.config().statistics.to_string(),
            seed: plan.seed,
            draws: plan.draws,
            steps: plan.steps,
            logs: &reports,
            errors: &failures,
            skipped: &skipped,
        })?;
    }
    if let Some(level) = args.fdr {
        let chances: Vec<f64> = reports.iter().map(|r| r.evidence.p_value).collect();
        let differ = benjamini_hochberg(&chances, level);
        let names: Vec<&str> = reports
            .iter()
            .zip(&differ)
            .filter(|(_, differs)| **differs)
            .map(|(r, _)| r.log.name.as_str())
            .collect();
        say(&format!(
            "{} of {} out of distribution with at most {:.0} % of them false alarms{}{}",
            names.len(),
            count(reports.len(), "log"),
            100.0 * level,
            if names.is_empty() { "" } else { ": " },
            names.join(", ")
        ));
    }
    let ood = reports.iter().filter(|r| r.is_ood()).count();
    if reports.len() + failures.len() > 1 {
        say(&format!(
            "{} judged: {ood} out of distribution, {} could not be read",
            count(reports.len(), "log"),
            failures.len()
        ));
    }
    Ok(if !failures.is_empty() {
        2
    } else if ood > 0 {
        1
    } else {
        0
    })
}

fn failure(path: &Path, error: &anyhow::Error) -> Failure {
    let error = explain(error);
    say(&format!("error: {error}"));
    Failure {
        path: path.display().to_string(),
        error,
    }
}

fn judge(detector: &Detector, args: &Score, log: &Trajectory) -> Result<Report> {
    let mut bar = Bar(progress(0, "scoring")?);
    let options = JudgeOptions { alpha: args.alpha };
    let report = detector.judge_with(log, &options, &mut bar);
    bar.0.finish_and_clear();
    Ok(report?)
}

/// The library's summary, and every window where it is asked for.
fn text(report: &Report, windows: bool) -> String {
    let mut out = report.to_string();
    for w in report.windows.iter().filter(|_| windows) {
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "  window      {}s {:>6} to {:>6}  score {:>9.3}  p {:.3}{}",
            report.log.row_kind,
            w.first_row,
            w.last_row,
            w.score.value(),
            w.p_value,
            if w.beyond { "  beyond" } else { "" }
        );
    }
    out
}
