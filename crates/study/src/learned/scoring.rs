//! Scores of the baselines for the sets of the benchmark.

use super::training::{LENGTH, Options, report, train_on};
use super::weights::Learned;
use super::{Answer, Baseline, LearnedScores, Request, ScoresArgs, SetWindows};
use crate::data::DataRoot;
use crate::release::RATE;
use crate::sets::{self, DataSet};
use anyhow::{Context, Result, bail};
use dose3::atomic;
use dose3::train::{HoldOut, split};
use dose3_datasets::{Kind, Trajectory, Window, at_rate};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// Training steps on synthetic data; with `--quick`, a fifth.
const SYNTHETIC_STEPS: usize = 300;
/// Share of the synthetic vehicle's logs that is held out of training.
const HELD_OUT_SHARE: f64 = 0.25;

/// Scores of the weights in `file` for windows of logs, higher = more out of distribution.
///
/// # Errors
/// No such file, or windows that are not of its kind.
pub fn score(file: &Path, trajectories: &[Trajectory], windows: &[Window]) -> Result<Vec<f64>> {
    Learned::read(file)?.score(trajectories, windows)
}

/// Scores of the shipped weights for the windows of `sets`; for `motion`, logs are at 10 Hz and
/// windows have one pose more than elements.
///
/// # Errors
/// Weights that are not there, with the command that trains them, and windows of another kind.
pub fn scores(
    baseline: Baseline,
    representation: Kind,
    seed: u64,
    sets: &[DataSet],
) -> Result<LearnedScores> {
    let path = baseline.weights(representation, seed);
    if !path.exists() {
        bail!(
            "{} is missing: cargo run --release -p xtask --features baselines -- train-baselines \
             --baseline {} --representation {representation} --seed {seed}",
            path.display(),
            baseline.name()
        );
    }
    of(&Learned::read(&path)?, sets)
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

/// Both baselines on `sets`, with the shipped weights or, for synthetic data, trained now.
pub(super) fn answer(
    request: &Request,
    sets: &[DataSet],
) -> Result<BTreeMap<Baseline, LearnedScores>> {
    let both = Baseline::ALL.into_iter().map(|baseline| {
        let scores = if request.synthetic {
            trained_now(baseline, request, sets)?
        } else {
            scores(baseline, request.representation, request.seed, sets)?
        };
        Ok((baseline, scores))
    });
    both.collect()
}

fn trained_now(baseline: Baseline, request: &Request, sets: &[DataSet]) -> Result<LearnedScores> {
    let vehicle = sets
        .iter()
        .find(|set| set.letter == 'V')
        .context("the synthetic vehicle is missing")?;
    let held_out = HoldOut::Fraction(HELD_OUT_SHARE);
    let (training, _) = split(&vehicle.trajectories, &held_out, request.seed)?;
    let by_default = match request.quick {
        true => SYNTHETIC_STEPS / 5,
        false => SYNTHETIC_STEPS,
    };
    let options = Options {
        baseline,
        representation: request.representation,
        seed: request.seed,
        steps: Some(request.train_steps.unwrap_or(by_default)),
    };
    let learned = train_on(&training, options, &mut report(Instant::now()))?;
    let mut scores = of(&learned, sets)?;
    scores.outcome += ", SYNTHETIC: trained on the synthetic vehicle, not on KITTI";
    Ok(scores)
}

/// Writes the answer to a request.
pub fn run(args: &ScoresArgs) -> Result<()> {
    let sets = load(&args.request)?;
    let answer = Answer {
        sets: sets.iter().map(SetWindows::new).collect(),
        baselines: answer(&args.request, &sets)?,
    };
    atomic::write(&args.out, &serde_json::to_vec(&answer)?)
}

/// The sets of the benchmark with the windows that the request names.
fn load(request: &Request) -> Result<Vec<DataSet>> {
    let mut sets = match request.synthetic {
        true => sets::synthetic(0, sets::synthetic_logs(request.quick))?,
        false => sets::real(&DataRoot::find(request.data.as_deref())?)?,
    };
    let kind = request.representation;
    for set in &mut sets {
        if kind == Kind::Motion {
            for log in &mut set.trajectories {
                *log = at_rate(log, RATE)?;
            }
        }
        set.cut(kind.poses(LENGTH), request.most);
    }
    Ok(sets)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_weights_name_the_command_that_trains_them() {
        let refusal = scores(Baseline::Jem, Kind::Motion, 987_654, &[]).unwrap_err();
        let command = "train-baselines --baseline jem --representation motion --seed 987654";
        assert!(refusal.to_string().contains(command), "{refusal}");
    }

    #[test]
    fn synthetic_sets_are_scored_by_what_is_trained_now() {
        let request = Request {
            representation: Kind::Motion,
            seed: 1,
            most: 40,
            data: None,
            synthetic: true,
            quick: true,
            train_steps: Some(2),
            threads: 0,
        };
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("scores.json");
        let args = ScoresArgs {
            request: request.clone(),
            out: out.clone(),
        };
        run(&args).unwrap();
        let written: Answer = serde_json::from_slice(&std::fs::read(out).unwrap()).unwrap();

        let mut sets = sets::synthetic(0, sets::synthetic_logs(true)).unwrap();
        for set in &mut sets {
            for log in &mut set.trajectories {
                *log = at_rate(log, RATE).unwrap();
            }
            set.cut(129, request.most);
        }
        let direct = super::super::request(&request, &sets).unwrap();
        let written = written.for_sets(&sets).unwrap();
        assert_eq!(written.len(), Baseline::ALL.len());
        for (baseline, scores) in written {
            assert_eq!(scores.scores, direct[&baseline].scores);
            assert!(scores.outcome.contains("SYNTHETIC"));
            assert!(scores.parameters > 10_000);
        }
    }
}
