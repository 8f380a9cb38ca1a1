//! Scores of the baselines for the sets of the benchmark.

use super::training::{Options, train_on};
use super::weights::Learned;
use super::{Baseline, LearnedScores, Weights};
use crate::sets::DataSet;
use anyhow::{Context, Result, bail};
use dose3::train::{HoldOut, split};
use dose3_datasets::{Kind, Trajectory, Window};
use std::path::Path;
use std::time::Instant;

/// Share of the synthetic vehicle's logs that is held out of training.
const HELD_OUT_SHARE: f64 = 0.25;

/// Scores of the weights in `file` for windows of logs, higher = more out of distribution.
///
/// # Errors
/// No such file, or windows that are not of its kind.
pub fn of_file(file: &Path, trajectories: &[Trajectory], windows: &[Window]) -> Result<Vec<f64>> {
    Learned::read(file)?.score(trajectories, windows)
}

/// Scores for the windows of `sets`; for `motion`, logs are at 10 Hz and windows have one pose more than elements.
///
/// # Errors
/// Weights that are not there, with the command that trains them, and windows of another kind.
pub fn scores(
    baseline: Baseline,
    representation: Kind,
    seed: u64,
    sets: &[DataSet],
    weights: Weights,
) -> Result<LearnedScores> {
    let options = |steps| Options {
        baseline,
        representation,
        seed,
        steps: Some(steps),
    };
    match weights {
        Weights::Study => of(&study(baseline, representation, seed)?, sets),
        Weights::Vehicle { steps } => trained_now(options(steps), sets),
    }
}

fn study(baseline: Baseline, representation: Kind, seed: u64) -> Result<Learned> {
    let path = baseline.weights(representation, seed);
    if !path.exists() {
        bail!(
            "{} is missing: cargo run --release -p xtask --features baselines -- train-baselines \
             --baseline {} --representation {representation} --seed {seed}",
            path.display(),
            baseline.name()
        );
    }
    Learned::read(&path)
}

fn of(learned: &Learned, sets: &[DataSet]) -> Result<LearnedScores> {
    let start = Instant::now();
    let scores = sets
        .iter()
        .map(|set| learned.score(&set.trajectories, &set.windows))
        .collect::<Result<_>>()?;
    Ok(LearnedScores {
        scores,
        parameters: learned.parameters(),
        train_seconds: learned.seconds,
        score_seconds: start.elapsed().as_secs_f64(),
        outcome: learned.record.outcome.clone(),
    })
}

fn trained_now(options: Options, sets: &[DataSet]) -> Result<LearnedScores> {
    let vehicle = sets
        .iter()
        .find(|set| set.letter == 'V')
        .context("the synthetic vehicle is missing")?;
    let held_out = HoldOut::Fraction(HELD_OUT_SHARE);
    let (training, _) = split(&vehicle.trajectories, &held_out, options.seed)?;
    let learned = train_on(&training, options, &mut |_| ())?;
    let mut scores = of(&learned, sets)?;
    scores.outcome += ", SYNTHETIC: trained on the synthetic vehicle, not on KITTI";
    Ok(scores)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sets;
    use crate::training::RATE;
    use dose3_datasets::at_rate;

    #[test]
    fn missing_weights_name_the_command_that_trains_them() {
        let refusal = scores(Baseline::Jem, Kind::Motion, 987_654, &[], Weights::Study);
        let refusal = refusal.unwrap_err().to_string();
        let command = "train-baselines --baseline jem --representation motion --seed 987654";
        assert!(refusal.contains(command), "{refusal}");
    }

    #[test]
    fn synthetic_sets_are_scored_by_what_is_trained_now() {
        let mut sets = sets::synthetic(0, 4).unwrap();
        for set in &mut sets {
            let logs = std::mem::take(&mut set.trajectories).into_iter();
            set.trajectories = logs.map(|log| at_rate(&log, RATE).unwrap()).collect();
            set.cut(129, 40);
        }
        for baseline in Baseline::ALL {
            let weights = Weights::Vehicle { steps: 2 };
            let found = scores(baseline, Kind::Motion, 1, &sets, weights).unwrap();
            assert!(found.outcome.contains("SYNTHETIC"));
            assert!(found.parameters > 10_000);
            for (scores, set) in found.scores.iter().zip(&sets) {
                assert_eq!(scores.len(), set.windows.len());
            }
        }
    }
}
