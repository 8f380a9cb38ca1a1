//! What each row of the main table costs.

use super::experiment::Experiment;
use super::findings::{Findings, Query};
use super::table::{Entry, Line, Table};
use crate::rows::{LEARNED, MAIN, Row, label};
use crate::sets::DataSet;
use crate::split::Split;
use crate::training::{Training, shipped_shape};
use anyhow::{Context, Result, bail};
use dose3::diffusion::trainer::LogRow;
use dose3::progress::OnStep;
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
    let short = Training {
        steps: TIMED,
        ..Training::PAPER
    };
    let mut options = short.options(shipped_shape(), HoldOut::Fraction(0.0));
    options.computing.threads = threads;
    let mut heard: Vec<(usize, Instant)> = Vec::new();
    let hear = &mut OnStep(|row: &LogRow| heard.push((row.step, Instant::now())));
    train(&set.trajectories, &options, hear)?;
    let (Some(first), Some(last)) = (heard.first(), heard.last()) else {
        bail!("training told of no step");
    };
    let steps = last.0.saturating_sub(first.0).max(1);
    let seconds = last.1.duration_since(first.1).as_secs_f64();
    Ok(seconds / steps as f64 * Training::PAPER.steps as f64)
}

/// The mean AUROC of every row of each main table, with its cost.
pub fn cost(findings: &Findings, training: Option<f64>) -> Table {
    let (main, learned) = (
        findings.present(&Experiment::main()),
        findings.present(&Experiment::learned()),
    );
    let mut rows = Vec::new();
    for row in &LEARNED {
        rows.push(line(
            findings,
            row,
            &learned,
            Experiment::learned_motion(),
            None,
        ));
    }
    for row in &MAIN {
        rows.push(line(findings, row, &main, Experiment::motion(), training));
    }
    let of_seeds = LEARNED
        .iter()
        .flat_map(|row| learned.iter().map(move |experiment| (row, experiment)));
    let notes = of_seeds.filter_map(|(row, experiment)| {
        let training = findings.cost(experiment, row)?.training.as_ref()?;
        let (label, seed) = (label(row), experiment.seed);
        Some(format!(
            "{label}, training seed {seed}: {}.",
            training.outcome
        ))
    });
    Table {
        title: "Mean AUROC, and what each row costs".into(),
        text: "Mean AUROC over the cells of the three tables above. Training: of the diffusion networks the time of \
               some optimiser steps in this run times their number; of the baselines the wall time when they were \
               trained, one thread each beside other work (processor time: Glow 7 minutes, JEM 4, \
               crates/baselines/README.md). Scoring: milliseconds a window with `paper` windows, in this run."
            .into(),
        head: [
            "method",
            "`paper`, `held-out`",
            "`paper`, `released-code`",
            "`motion`, `held-out`",
            "parameters",
            "training, minutes",
            "scoring, ms a window",
        ]
        .map(String::from)
        .to_vec(),
        rows,
        notes: notes.collect(),
    }
}

fn line(
    findings: &Findings,
    row: &Row,
    paper: &[Experiment],
    motion: Experiment,
    training: Option<f64>,
) -> Line {
    let mean = |of: &[Experiment], split| {
        let value = findings.overall(Query {
            of,
            row: *row,
            split,
        });
        Entry {
            text: value.map_or("not run".into(), |v| format!("{v:.3}")),
            auroc: value,
        }
    };
    let mut cells = vec![
        mean(paper, Split::HeldOut),
        mean(paper, Split::ReleasedCode),
        mean(&[motion], Split::HeldOut),
    ];
    let none = || Entry::from("–".to_string());
    match paper.first().and_then(|first| findings.cost(first, row)) {
        Some(cost) => {
            let recorded = cost.training.as_ref().and_then(|t| t.seconds);
            let trained = recorded.or(training.filter(|_| cost.parameters > 0));
            cells.push(Entry::from(cost.parameters.to_string()));
            cells.push(trained.map_or_else(none, |s| Entry::from(format!("{:.1}", s / 60.0))));
            cells.push(Entry::from(format!("{:.2}", cost.milliseconds)));
        }
        None => cells.extend([none(), none(), none()]),
    }
    Line::new(label(row), cells)
}
