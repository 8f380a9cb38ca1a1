//! The learned baselines as jobs: scores that no density is fitted to.

use super::figures::Curve;
use super::measure::{Cost, Found, RowFound, SetFound, Settings, thinned};
use super::tables::{LEARNED_MOTION, learned_job};
use crate::cells::{Protocol, Side, cell, split};
use crate::learned::{Baseline, LearnedScores, Request, request};
use crate::sets::DataSet;
use anyhow::Result;
use dose3_datasets::Kind;
use dose3_ood::Score;
use dose3_ood::metrics::{Bootstrap, roc};
use std::time::Instant;

/// A representation and a training seed.
#[derive(Clone, Debug)]
pub struct LearnedJob {
    /// Its name in results.
    pub key: String,
    /// How poses become numbers.
    pub representation: Kind,
    /// Seed of training.
    pub seed: u64,
}

/// The jobs; `quick` leaves out the training seeds after the first.
pub fn plan(quick: bool) -> Vec<LearnedJob> {
    let seeds = if quick { 1 } else { 3 };
    let paper = (0..seeds).map(|seed| LearnedJob {
        key: learned_job(seed),
        representation: Kind::Paper,
        seed: seed as u64,
    });
    let motion = LearnedJob {
        key: LEARNED_MOTION.into(),
        representation: Kind::Motion,
        seed: 0,
    };
    paper.chain([motion]).collect()
}

/// The bytes of the weights that a job uses, as far as they are there.
pub fn weights(job: &LearnedJob) -> Vec<u8> {
    let files = Baseline::ALL.map(|b| b.weights(job.representation, job.seed));
    let bytes = files.iter().filter_map(|file| std::fs::read(file).ok());
    bytes.flatten().collect()
}

/// Scores `sets` (with their strides) by both baselines.
///
/// # Errors
/// Missing weights, a build that fails, windows that do not match.
pub fn run(
    job: &LearnedJob,
    asked: &Request,
    sets: &[(DataSet, usize)],
    settings: &Settings<'_>,
) -> Result<Found> {
    let start = Instant::now();
    let only: Vec<DataSet> = sets.iter().map(|(set, _)| set.clone()).collect();
    let answers = request(asked, &only)?;
    let mut found = Found {
        key: job.key.clone(),
        network: "learned baselines".into(),
        parameters: 0,
        window: 128,
        steps: (0, 0),
        trained_on: Vec::new(),
        sets: sets
            .iter()
            .map(|(set, stride)| SetFound::new(set, *stride))
            .collect(),
        costs: Vec::new(),
        seconds: 0.0,
        rows: Vec::new(),
    };
    for (baseline, scores) in &answers {
        for protocol in Protocol::ALL {
            found
                .rows
                .push(row(*baseline, scores, protocol, &only, job.seed, settings)?);
        }
        let windows: usize = only.iter().map(|set| set.windows.len()).sum();
        found.costs.push(Cost {
            row: baseline.name().into(),
            parameters: scores.parameters,
            milliseconds: 1e3 * scores.score_seconds / windows.max(1) as f64,
            training_seconds: scores.train_seconds,
            remark: scores.outcome.clone(),
        });
    }
    found.seconds = start.elapsed().as_secs_f64();
    Ok(found)
}

fn row(
    baseline: Baseline,
    scores: &LearnedScores,
    protocol: Protocol,
    sets: &[DataSet],
    seed: u64,
    settings: &Settings<'_>,
) -> Result<RowFound> {
    let side = |s: usize, windows: &[usize]| {
        let of = windows.iter().map(|w| Score::new(scores.scores[s][*w]));
        Side::of(&sets[s], windows, of.collect())
    };
    let bootstrap = Bootstrap {
        resamples: settings.resamples.div_ceil(10),
        seed,
        ..Bootstrap::default()
    };
    let (mut cells, mut curves) = (Vec::new(), Vec::new());
    for (i, id) in sets.iter().enumerate() {
        let tested = side(i, &split(id, protocol, seed).1);
        for (o, ood) in sets.iter().enumerate().filter(|(o, _)| *o != i) {
            let all: Vec<usize> = (0..ood.windows.len()).collect();
            let other = side(o, &all);
            // No density is fitted: the baseline is what training on KITTI made it.
            cells.push(cell(
                (id.letter, ood.letter),
                0,
                &tested,
                &other,
                bootstrap,
            )?);
            if protocol == Protocol::Paper {
                curves.push(Curve {
                    label: format!("{}/{}", id.letter, ood.letter),
                    points: thinned(&roc(&tested.scores, &other.scores)?),
                });
            }
        }
    }
    Ok(RowFound {
        row: baseline.name().into(),
        protocol,
        cells,
        curves,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sets;
    use dose3_ood::DensityConfig;

    #[test]
    fn cells_come_from_the_scores_of_test_windows_and_of_the_other_set() {
        let mut sets = sets::synthetic(0, 3).unwrap();
        for set in &mut sets {
            set.choose_test_logs(&[], &[]);
            set.cut(128, 30);
        }
        // Set number as the score: a later set is always more OOD than an earlier one.
        let scores = LearnedScores {
            scores: sets
                .iter()
                .enumerate()
                .map(|(s, set)| vec![s as f64; set.windows.len()])
                .collect(),
            parameters: 1,
            train_seconds: None,
            score_seconds: 1.0,
            outcome: String::new(),
        };
        let settings = Settings {
            density: &DensityConfig::default(),
            resamples: 10,
            quick: true,
            backend: Default::default(),
            threads: 1,
        };
        let found = row(Baseline::Jem, &scores, Protocol::Paper, &sets, 0, &settings).unwrap();
        assert_eq!(found.cells.len(), 6);
        for cell in &found.cells {
            let order = |letter| sets.iter().position(|s| s.letter == letter);
            let expected = f64::from(u8::from(order(cell.ood) > order(cell.id)));
            assert_eq!(cell.auroc.value, expected);
            let id = sets.iter().find(|s| s.letter == cell.id).unwrap();
            let tested = id
                .windows
                .iter()
                .filter(|w| id.test_logs.contains(&w.trajectory));
            assert_eq!(cell.id_windows, tested.count());
        }
    }
}
