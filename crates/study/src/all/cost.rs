//! What each row of the main table costs.

use super::findings::{Findings, Query};
use super::jobs::SEEDS;
use super::table::{Entry, Line, Table};
use super::tables::{
    LEARNED, LEARNED_MOTION, ORDER, label, learned_job, learned_jobs, main_jobs, present,
};
use crate::cells::Protocol;
use crate::release::ReleaseArgs;
use crate::sets::DataSet;
use anyhow::{Context, Result, bail};
use dose3::train::{HoldOut, train};
use std::time::Instant;

/// Steps that are timed: from the log's second row to its last.
const TIMED: usize = 60;

/// Seconds that training the shipped network takes: its steps times the time of one, measured over a few
/// on the set it is trained on.
///
/// # Errors
/// No set to train on, a failing training.
pub fn training_seconds(sets: &[DataSet], threads: usize) -> Result<f64> {
    let set = sets
        .iter()
        .find(|s| matches!(s.letter, 'K' | 'V'))
        .context("the set to train on is missing")?;
    let shipped = ReleaseArgs::shipped(0);
    let mut short = shipped.clone();
    short.steps = Some(TIMED);
    short.threads = threads;
    let mut options = short.options(Vec::new());
    options.hold_out = HoldOut::Fraction(0.0);
    options.checkpoint = None;
    let mut heard: Vec<(usize, Instant)> = Vec::new();
    train(&set.trajectories, &options, &mut |_, _| (), &mut |row| {
        heard.push((row.step, Instant::now()));
    })?;
    let (Some(first), Some(last)) = (heard.first(), heard.last()) else {
        bail!("training told of no step");
    };
    let steps = last.0.saturating_sub(first.0).max(1);
    let seconds = last.1.duration_since(first.1).as_secs_f64();
    Ok(seconds / steps as f64 * shipped.steps() as f64)
}

/// The mean AUROC of every row under each protocol, with its cost.
pub fn cost(findings: &Findings, training: Option<f64>) -> Table {
    let (main, learned) = (main_jobs(), learned_jobs());
    let first = format!("main-{}", SEEDS[0]);
    let mut rows = Vec::new();
    for (key, label) in LEARNED {
        rows.push(line(
            findings,
            (key, label),
            &learned,
            LEARNED_MOTION,
            &learned_job(0),
            None,
        ));
    }
    for key in ORDER {
        rows.push(line(
            findings,
            (key, label(key)),
            &main,
            "motion",
            &first,
            training,
        ));
    }
    let notes = LEARNED
        .iter()
        .flat_map(|(key, _)| learned.iter().map(move |job| (job, key)))
        .filter_map(|(job, key)| Some((job, key, findings.cost(job, key)?)))
        .map(|(job, key, cost)| format!("{key}, {job}: {}.", cost.remark))
        .collect();
    Table {
        title: "Three protocols and what each row costs".into(),
        text: "Mean AUROC over the cells. Training: of the diffusion networks the time of some optimiser steps in \
               this run times their number; of the baselines the wall time when they were trained, one thread \
               each beside other work (processor time: Glow 7 minutes, JEM 4, crates/baselines/README.md). Scoring: milliseconds a window with `paper` windows, in this run."
            .into(),
        head: [
            "method",
            "`paper`",
            "`released-code`",
            "`motion`",
            "parameters",
            "training, minutes",
            "scoring, ms a window",
        ]
        .map(String::from)
        .to_vec(),
        rows,
        notes,
    }
}

fn line(
    findings: &Findings,
    (key, label): (&str, &str),
    jobs: &[String],
    motion: &str,
    first: &str,
    training: Option<f64>,
) -> Line {
    let jobs: Vec<&str> = jobs.iter().map(String::as_str).collect();
    let jobs = present(findings, &jobs);
    let mean = |jobs: &[&str], protocol| {
        let value = findings.overall(Query {
            jobs,
            row: key,
            protocol,
        });
        Entry {
            text: value.map_or("not run".into(), |v| format!("{v:.3}")),
            auroc: value,
        }
    };
    let mut cells = vec![
        mean(&jobs, Protocol::Paper),
        mean(&jobs, Protocol::ReleasedCode),
        mean(&[motion], Protocol::Paper),
    ];
    let none = || Entry::from("–".to_string());
    match findings.cost(first, key) {
        Some(cost) => {
            let trained = cost
                .training_seconds
                .or(training.filter(|_| cost.parameters > 0));
            cells.push(Entry::from(cost.parameters.to_string()));
            cells.push(trained.map_or_else(none, |s| Entry::from(format!("{:.1}", s / 60.0))));
            cells.push(Entry::from(format!("{:.2}", cost.milliseconds)));
        }
        None => cells.extend([none(), none(), none()]),
    }
    Line::new(label, cells)
}
