//! The trainer learns, resumes to the bit, and tells one run's checkpoint from another's.

mod support;

use dose3_diffusion::trainer::{LearnerPair, LogRow, TrainConfig, Trainer, WindowSource};
use dose3_diffusion::{Branches, Error, ProbePlan, Process, ProcessConfig, Window, trace};
use dose3_model::PairParameters;
use std::path::Path;
use support::{Arcs, LENGTH, config, models, network};

/// What `work` answers on so many threads, be they more than the machine has.
fn on<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build().unwrap().install(work)
}

/// Runs to the end, or to the checkpoint at `stop`; answers log, weights and last checkpoint.
fn run(
    config: TrainConfig,
    threads: usize,
    resume: Option<&[u8]>,
    stop: Option<usize>,
) -> Result<(Vec<LogRow>, PairParameters, Vec<u8>), Error> {
    on(threads, || run_here(config, resume, stop))
}

fn run_here(
    config: TrainConfig,
    resume: Option<&[u8]>,
    stop: Option<usize>,
) -> Result<(Vec<LogRow>, PairParameters, Vec<u8>), Error> {
    let (train, validation) = (Arcs(40), Arcs(7));
    let learners = LearnerPair::on_host(models(), config.initial(&network())?, config.clip);
    let mut trainer = Trainer::new(
        config,
        ProcessConfig {
            steps: 10,
            ..ProcessConfig::default()
        },
        network(),
        "arcs".into(),
        learners,
        &train,
        &validation,
    )?;
    if let Some(bytes) = resume {
        trainer.resume(Path::new("test.checkpoint"), bytes)?;
    }
    while trainer.step_count() < stop.unwrap_or(config.steps) {
        trainer.advance()?;
    }
    Ok((
        trainer.log().to_vec(),
        trainer.averaged()?,
        trainer.checkpoint()?,
    ))
}

#[test]
fn a_resumed_run_ends_in_the_same_bytes() {
    let (log, weights, _) = run(config(40), 2, None, None).unwrap();
    let (_, _, checkpoint) = run(config(40), 1, None, Some(20)).unwrap();
    let (resumed_log, resumed, _) = run(config(40), 3, Some(&checkpoint), None).unwrap();
    assert_eq!(log, resumed_log);
    assert_eq!(weights, resumed);
    assert_eq!(log.len(), 8);
    assert!(log[1].translation_validation.is_some() && log[0].translation_validation.is_none());
}

#[test]
fn training_lowers_both_losses() {
    let (log, _, _) = run(config(200), 2, None, None).unwrap();
    let (first, last) = (log[0], log[log.len() - 1]);
    assert!(
        last.translation_eps < 0.6 * first.translation_eps,
        "{first:?} {last:?}"
    );
    assert!(
        last.rotation_eps < 0.6 * first.rotation_eps,
        "{first:?} {last:?}"
    );
    let (v0, v1) = (
        log[1].translation_validation.unwrap(),
        last.translation_validation.unwrap(),
    );
    assert!(v1 < 0.7 * v0, "validation {v0} to {v1}");
}

#[test]
fn checkpoints_of_other_runs_and_damaged_ones_are_refused() {
    let (_, _, checkpoint) = run(config(20), 1, None, Some(10)).unwrap();
    let refusal = |config, bytes: &[u8]| match run(config, 1, Some(bytes), None) {
        Err(Error::Checkpoint { reason, path }) => {
            assert_eq!(path, "test.checkpoint");
            reason
        }
        other => panic!("{:?}", other.map(|_| ())),
    };
    let other = TrainConfig {
        seed: 1,
        ..config(20)
    };
    assert!(refusal(other, &checkpoint).contains("training configuration differs"));
    assert!(refusal(config(20), &checkpoint[..100]).contains("not a checkpoint"));
    assert!(!refusal(config(20), &checkpoint[..checkpoint.len() - 8]).is_empty());
}

#[test]
fn divergence_is_an_error_that_names_the_branch() {
    let wild = TrainConfig {
        learning_rate: 1e30,
        warmup: 0,
        clip: 1e30,
        ..config(30)
    };
    match run(wild, 1, None, None) {
        Err(Error::Diverged { branch, .. }) => assert_eq!(branch, "translation"),
        Err(Error::Model(error)) => assert!(error.to_string().contains("not finite"), "{error}"),
        other => panic!("{:?}", other.map(|_| ())),
    }
}

/// The statistics of a window depend on the window alone: not on its batch, nor on the threads.
#[test]
fn traces_depend_on_the_window_alone() {
    let process = Process::new(ProcessConfig {
        steps: 10,
        ..ProcessConfig::default()
    })
    .unwrap();
    let arcs = Arcs(5);
    let data: Vec<(Vec<f32>, Vec<f32>)> = (0..5)
        .map(|i| {
            let (mut t, mut r) = (vec![0.0; LENGTH * 3], vec![0.0; LENGTH * 9]);
            arcs.read(i, &mut t, &mut r).unwrap();
            (t, r)
        })
        .collect();
    let windows: Vec<Window<'_>> = data
        .iter()
        .map(|(t, r)| Window {
            translation: t,
            rotation: r,
        })
        .collect();
    for sharing in [
        dose3_diffusion::NoiseSharing::Own,
        dose3_diffusion::NoiseSharing::Shared,
    ] {
        let config = ProbePlan {
            steps: 4,
            draws: 3,
            seed: 3,
            sharing,
        };
        assert_eq!(config.step_indices(10), [0, 3, 6, 9]);
        let run = |windows: &[Window<'_>], draws, branches, threads| {
            let mut models = models();
            let trace = || trace(&mut models, &process, &config, windows, draws, branches);
            on(threads, trace).unwrap()
        };
        let all = run(&windows, 0..3, Branches::Both, 2);
        let translation = run(&windows, 0..3, Branches::Translation, 2);
        for i in 0..5 {
            for d in 0..3 {
                let alone = run(&windows[i..=i], d..d + 1, Branches::Both, 1);
                assert_eq!(alone.eps(0, 0), all.eps(i, d));
                assert_eq!(
                    alone.eps_hat(0, 0),
                    all.eps_hat(i, d),
                    "window {i}, draw {d}, {sharing:?}"
                );
                assert_eq!(translation.eps(i, d), all.eps(i, d));
                let pairs = translation.eps_hat(i, d).chunks(6);
                for (part, whole) in pairs.zip(all.eps_hat(i, d).chunks(6)) {
                    assert_eq!(part[..3], whole[..3]);
                    assert_eq!(part[3..], [0.0; 3]);
                }
            }
        }
        assert_ne!(all.eps(0, 0), all.eps(0, 1));
    }
}
