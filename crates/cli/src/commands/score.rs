//! `dose3 score`

use super::{count, print, print_json, progress, read_options, say};
use crate::args::Score;
use crate::explain::explain;
use anyhow::{Result, bail};
use dose3::detector_file::Detector;
use dose3::logs;
use dose3::score::{Judge, LogReport};
use dose3_datasets::{LoadOptions, discover};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Segments and groups shown per log.
const SHOWN: usize = 5;

/// What `score --json` prints.
#[derive(Serialize)]
struct Output<'a> {
    detector: String,
    statistics: String,
    seed: u64,
    draws: usize,
    steps: usize,
    logs: &'a [LogReport],
    errors: &'a [Failure],
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
    let detector = Detector::read(&args.detector)?;
    let mut judge = Judge::new(detector, args.computing.backend, args.computing.threads)?;
    let (mut reports, mut failures) = (Vec::new(), Vec::new());
    for path in logs_under(args, &mut failures) {
        match judge_log(&mut judge, args, &path) {
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
        let header = &judge.detector().header;
        print_json(&Output {
            detector: args.detector.display().to_string(),
            statistics: header.statistics.config().statistics.to_string(),
            seed: header.probe.seed,
            draws: header.probe.draws,
            steps: header.probe.steps,
            logs: &reports,
            errors: &failures,
        })?;
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

/// Every log that the arguments name; what cannot be searched is reported and the rest goes on.
fn logs_under(args: &Score, failures: &mut Vec<Failure>) -> Vec<PathBuf> {
    let options = LoadOptions {
        format: args.reading.format,
        ..LoadOptions::default()
    };
    let mut all = Vec::new();
    for path in &args.logs {
        match discover(path, &options) {
            Ok(found) if found.is_empty() => failures.push(failure(
                path,
                &anyhow::anyhow!("{}: no pose log in it", path.display()),
            )),
            Ok(found) => all.extend(found),
            Err(error) => failures.push(failure(path, &error.into())),
        }
    }
    all
}

fn failure(path: &std::path::Path, error: &anyhow::Error) -> Failure {
    let error = explain(error);
    say(&format!("error: {error}"));
    Failure {
        path: path.display().to_string(),
        error,
    }
}

fn judge_log(judge: &mut Judge, args: &Score, path: &PathBuf) -> Result<LogReport> {
    let mut logs = logs::read(std::slice::from_ref(path), &read_options(&args.reading))?;
    let Some(log) = logs.pop() else {
        bail!("{}: no pose log in it", path.display())
    };
    let bar = progress(0, "scoring")?;
    let report = judge.judge(log, args.alpha, &|done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    Ok(report?)
}

fn text(r: &LogReport, windows: bool) -> String {
    let mut out = String::new();
    let verdict = match r.verdict {
        "out_of_distribution" => "OUT OF DISTRIBUTION",
        "in_distribution" => "in distribution",
        "unlike" => "UNLIKE the one trusted log",
        _ => "like the one trusted log",
    };
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{:<24} {verdict}", r.log);
    let decided = &r.tests[r.decided_by];
    let _ = writeln!(
        out,
        "  decided by  {}: chance {:.2e} in a log like the trusted ones, alpha {}",
        decided.name, r.p_value, r.alpha
    );
    let _ = writeln!(
        out,
        "  rests on    a tail fitted to {}; without a model {} can only say {:.3}",
        count(r.basis.windows, "trusted window"),
        count(r.basis.groups, "trusted log"),
        r.basis.smallest_rank_p
    );
    let _ = writeln!(
        out,
        "  windows     {} of {} beyond {:.2}; mean score {:.2}; {:.2} times a trusted extreme",
        r.beyond,
        r.windows,
        r.threshold.value(),
        r.mean_score.value(),
        r.excess
    );
    for (i, s) in r.segments.iter().take(SHOWN).enumerate() {
        let _ = writeln!(
            out,
            "  {:<11} poses {} to {} ({:.1} s to {:.1} s), worst score {:.2}",
            if i == 0 { "where" } else { "" },
            s.first_pose,
            s.last_pose,
            s.start_s,
            s.end_s,
            s.worst_score.value()
        );
    }
    if r.segments.len() > SHOWN {
        let more = count(r.segments.len() - SHOWN, "more segment");
        let _ = writeln!(out, "              and {more} (--json shows all)");
    }
    for (i, s) in r.pose_spans.iter().take(SHOWN).enumerate() {
        let _ = writeln!(
            out,
            "  {:<11} {} to {} ({:.1} s to {:.1} s), pose {} the most ({:.1} times a trusted extreme)",
            if i == 0 { "poses" } else { "" },
            s.first_pose,
            s.last_pose,
            s.start_s,
            s.end_s,
            s.worst_pose,
            s.worst_score.value()
        );
    }
    if r.beyond > 0 {
        for (i, g) in r.groups.iter().take(3).enumerate() {
            let _ = writeln!(
                out,
                "  {:<11} {}: {:.0} % of windows beyond the trusted ones, p {:.3}",
                if i == 0 { "why" } else { "" },
                g.group,
                100.0 * g.share_beyond,
                g.p_value
            );
        }
    }
    if windows {
        for w in &r.window_reports {
            let _ = writeln!(
                out,
                "  window      poses {:>6} to {:>6}  score {:>9.3}  p {:.3}{}",
                w.first_pose,
                w.last_pose,
                w.score.value(),
                w.p_value,
                if w.beyond { "  beyond" } else { "" }
            );
        }
    }
    for note in &r.notes {
        let _ = writeln!(out, "  note        {note}");
    }
    out
}
