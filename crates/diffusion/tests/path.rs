//! The deterministic DDIM path, against closed forms and with a network.

use dose3_diffusion::{
    Branches, ModelPair, NoiseSchedule, NoiseSharing, ProbePlan, Process, ProcessConfig,
    RotationProcess, Traces, Window, rotation_logs, trace,
};
use dose3_engine::{Engine, EngineOptions};
use dose3_lie::{Vector, so3};
use dose3_model::{
    Input, LossGradient, ModelError, NoiseModel, PairConfig, PairParameters, UNetConfig,
};
use std::sync::{Arc, Mutex};

const LENGTH: usize = 4;
const TOTAL: usize = 30;

/// The states that a network was shown, in order: `(step, [length, channels])`.
type Seen = Arc<Mutex<Vec<(usize, Vec<f32>)>>>;

/// A network that answers the same noise for every pose and remembers what it was shown.
struct Constant {
    config: UNetConfig,
    answer: [f32; 3],
    seen: Seen,
}

impl NoiseModel for Constant {
    fn config(&self) -> &UNetConfig {
        &self.config
    }

    fn set_parameters(&mut self, _: &[f32]) -> Result<(), ModelError> {
        Ok(())
    }

    fn forward(&mut self, input: Input<'_>, output: &mut [f32]) -> Result<(), ModelError> {
        let one = input.x.len() / input.batch;
        let states = input.x.chunks_exact(one).zip(input.steps);
        let mut seen = self.seen.lock().unwrap();
        seen.extend(states.map(|(x, t)| (*t as usize, x.to_vec())));
        for out in output.chunks_exact_mut(3) {
            out.copy_from_slice(&self.answer);
        }
        Ok(())
    }

    fn forward_backward(
        &mut self,
        _: Input<'_>,
        _: &LossGradient<'_>,
        _: &mut [f32],
    ) -> Result<(), ModelError> {
        Ok(())
    }
}

fn constant(translation: [f32; 3], rotation: [f32; 3]) -> (ModelPair, Seen, Seen) {
    let network = PairConfig::new(8, &[1]);
    let (of_translation, of_rotation) = (Seen::default(), Seen::default());
    let models = ModelPair {
        translation: Box::new(Constant {
            config: network.translation,
            answer: translation,
            seen: of_translation.clone(),
        }),
        rotation: Box::new(Constant {
            config: network.rotation,
            answer: rotation,
            seen: of_rotation.clone(),
        }),
    };
    (models, of_translation, of_rotation)
}

fn process(schedule: NoiseSchedule, rotation_process: RotationProcess) -> Process {
    Process::new(ProcessConfig {
        steps: TOTAL,
        translation: schedule,
        rotation: schedule,
        rotation_process,
        ..ProcessConfig::default()
    })
    .unwrap()
}

fn config(steps: usize) -> ProbePlan {
    ProbePlan {
        steps,
        draws: 1,
        seed: 0,
        sharing: NoiseSharing::None,
    }
}

/// Poses that turn about `axis` by `angle` more at each, as a window.
fn turning(length: usize, axis: Vector, angle: f64) -> (Vec<f32>, Vec<f32>) {
    let translation = (0..length * 3).map(|i| (i as f32 * 0.7).sin()).collect();
    let rotation = (0..length).flat_map(|i| {
        let r = *so3::exp(&(axis * (angle * (i + 1) as f64))).matrix();
        (0..9).map(move |k| r[(k / 3, k % 3)] as f32)
    });
    (translation, rotation.collect())
}

fn follow(
    models: &mut ModelPair,
    process: &Process,
    config: &ProbePlan,
    data: &(Vec<f32>, Vec<f32>),
) -> Traces {
    let window = Window {
        translation: &data.0,
        rotation: &data.1,
    };
    trace(
        models,
        process,
        config,
        &[window],
        0..config.draws,
        Branches::Both,
    )
    .unwrap()
}

const MODES: [RotationProcess; 2] = [RotationProcess::Group, RotationProcess::Tangent];
const AXIS: [f64; 3] = [0.0, 0.6, 0.8];

#[test]
fn without_estimated_noise_the_path_only_shrinks() {
    for (schedule, mode) in [
        (NoiseSchedule::COSINE, MODES[0]),
        (NoiseSchedule::COSINE, MODES[1]),
        (NoiseSchedule::LOG_SIGMA, MODES[0]),
    ] {
        let process = process(schedule, mode);
        let data = turning(LENGTH, Vector::from(AXIS), 0.5);
        let (mut models, translations, rotations) = constant([0.0; 3], [0.0; 3]);
        let traces = follow(&mut models, &process, &config(10), &data);
        assert!(traces.eps_hat.iter().all(|e| *e == 0.0));
        let translations = translations.lock().unwrap();
        let visited: Vec<usize> = translations.iter().map(|s| s.0).collect();
        assert_eq!(visited, traces.steps);
        for (t, x) in translations.iter() {
            let left = process.translation.signal(*t) / process.translation.signal(0);
            for (x, clean) in x.iter().zip(&data.0) {
                assert!(
                    (f64::from(*x) - left * f64::from(*clean)).abs() < 1e-6,
                    "{t}"
                );
            }
        }
        for (t, x) in rotations.lock().unwrap().iter() {
            let left = process.rotation.signal(*t) / process.rotation.signal(0);
            for (i, log) in rotation_logs(x).iter().enumerate() {
                let expected = Vector::from(AXIS) * (0.5 * (i + 1) as f64 * left);
                assert!((log - expected).norm() < 1e-6, "{t} {mode:?}");
            }
        }
    }
}

/// Two steps of 30 are the first and the last; rotations about one axis commute, so both readings of
/// the process add angles.
#[test]
fn one_move_by_hand() {
    // alpha_bar of the cosine schedule from its definition, not from the table under test.
    let f = |k: f64| {
        ((k / 30.0 + 0.008) / 1.008 * std::f64::consts::FRAC_PI_2)
            .cos()
            .powi(2)
    };
    let first = f(1.0) / f(0.0);
    let last = f(29.0) / f(0.0) * (1.0 - 0.999);
    let next = |x: f64, eps: f64| {
        let x0_hat = (x - (1.0 - first).sqrt() * eps) / first.sqrt();
        last.sqrt() * x0_hat + (1.0 - last).sqrt() * eps
    };
    let eps = [0.5_f32, -2.0, 1.5];
    let turn = -1.3;
    let along = Vector::from(AXIS) * turn;
    for mode in MODES {
        let process = process(NoiseSchedule::COSINE, mode);
        let data = turning(LENGTH, Vector::from(AXIS), 0.4);
        let answer = [along.x as f32, along.y as f32, along.z as f32];
        let (mut models, translations, rotations) = constant(eps, answer);
        let traces = follow(&mut models, &process, &config(2), &data);
        assert_eq!(traces.steps, [0, 29]);
        let [e, r] = [&eps[..], &answer[..]];
        assert!(
            traces
                .eps_hat(0, 0)
                .chunks_exact(6)
                .all(|x| x == [e, r].concat())
        );

        let translations = translations.lock().unwrap();
        assert_eq!(translations[0].1, data.0);
        for (i, x) in translations[1].1.iter().enumerate() {
            let expected = next(data.0[i].into(), eps[i % 3].into());
            assert!((f64::from(*x) - expected).abs() < 1e-6, "{x} {expected}");
        }
        for (i, log) in rotation_logs(&rotations.lock().unwrap()[1].1)
            .iter()
            .enumerate()
        {
            let expected = Vector::from(AXIS) * next(0.4 * (i + 1) as f64, turn);
            assert!((log - expected).norm() < 1e-6, "{mode:?} {log} {expected}");
        }
    }
}

/// With estimates far larger than a network's, at schedules that divide by 0.05 and less.
#[test]
fn nothing_leaves_the_finite_numbers() {
    for schedule in [
        NoiseSchedule::COSINE,
        NoiseSchedule::LOG_SIGMA,
        NoiseSchedule::LINEAR,
    ] {
        for mode in MODES {
            let process = process(schedule, mode);
            let data = turning(LENGTH, Vector::new(0.3, -0.8, 0.52), 0.9);
            let (mut models, translations, rotations) =
                constant([1e3, -1e3, 50.0], [40.0, 7.0, -90.0]);
            follow(&mut models, &process, &config(TOTAL), &data);
            let bound = 1e3 + data.0.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
            let translations = translations.lock().unwrap();
            assert_eq!(translations.len(), TOTAL);
            assert!(
                translations
                    .iter()
                    .flat_map(|s| &s.1)
                    .all(|x| x.abs() <= bound)
            );
            for (t, x) in rotations.lock().unwrap().iter() {
                assert!(
                    x.iter().all(|x| x.abs() <= 1.0 + 1e-6),
                    "{schedule:?} {mode:?} {t}"
                );
            }
        }
    }
}

fn engine() -> ModelPair {
    let p = PairParameters::init(&PairConfig::new(8, &[1, 2]), 0).unwrap();
    ModelPair {
        translation: Box::new(Engine::new(&p.translation, EngineOptions::default()).unwrap()),
        rotation: Box::new(Engine::new(&p.rotation, EngineOptions::default()).unwrap()),
    }
}

#[test]
fn a_path_depends_on_its_window_alone() {
    let process = process(NoiseSchedule::COSINE, RotationProcess::Group);
    let data = [0.01, -0.02, 0.3].map(|angle| turning(32, Vector::from(AXIS), angle));
    let windows: Vec<Window<'_>> = data
        .iter()
        .map(|(translation, rotation)| Window {
            translation,
            rotation,
        })
        .collect();
    let run = |windows: &[Window<'_>], config: ProbePlan, draws, branches| {
        trace(&mut engine(), &process, &config, windows, draws, branches).unwrap()
    };
    let all = run(&windows, config(6), 0..1, Branches::Both);
    assert_eq!((all.draws, all.steps.len()), (1, 6));
    assert!(all.eps.iter().all(|e| *e == 0.0) && all.eps.len() == 3 * 32 * 6);
    for w in 0..3 {
        let alone = run(&windows[w..=w], config(6), 0..1, Branches::Both);
        assert_eq!(alone.eps_hat(0, 0), all.eps_hat(w, 0), "window {w}");
    }

    let other = ProbePlan {
        seed: 77,
        draws: 5,
        ..config(6)
    };
    assert_eq!(other.distinct_draws(), 1);
    assert_eq!(run(&windows, other, 0..5, Branches::Both), all);
    assert_eq!(run(&windows, other, 3..4, Branches::Both), all);
    assert!(
        run(&windows, other, 2..2, Branches::Both)
            .eps_hat
            .is_empty()
    );

    let translation = run(&windows, config(6), 0..1, Branches::Translation);
    for (part, whole) in translation.eps_hat.chunks(6).zip(all.eps_hat.chunks(6)) {
        assert_eq!((&part[..3], &part[3..]), (&whole[..3], &[0.0; 3][..]));
    }
}

#[test]
fn the_first_estimate_is_that_of_the_clean_window() {
    let process = process(NoiseSchedule::COSINE, RotationProcess::Group);
    let data = turning(32, Vector::from(AXIS), 0.05);
    let mut models = engine();
    let traces = follow(&mut models, &process, &config(3), &data);
    let mut run = |model: usize, x: &[f32]| {
        let model = [&mut models.translation, &mut models.rotation][model].as_mut();
        let input = Input {
            x,
            steps: &[0.0],
            batch: 1,
            length: 32,
        };
        let mut out = vec![0.0; 32 * 3];
        model.forward(input, &mut out).unwrap();
        out
    };
    let (translation, rotation) = (run(0, &data.0), run(1, &data.1));
    let first = &traces.eps_hat(0, 0)[..32 * 6];
    for (i, estimate) in first.chunks_exact(6).enumerate() {
        assert_eq!(estimate[..3], translation[i * 3..i * 3 + 3]);
        assert_eq!(estimate[3..], rotation[i * 3..i * 3 + 3]);
    }
    assert_ne!(traces.eps_hat(0, 0)[32 * 6..64 * 6], first[..]);
}

#[test]
fn windows_of_other_lengths_are_refused() {
    let process = process(NoiseSchedule::COSINE, RotationProcess::Group);
    let (long, short) = (
        turning(32, Vector::from(AXIS), 0.1),
        turning(24, Vector::from(AXIS), 0.1),
    );
    let windows = [&long, &short].map(|(translation, rotation)| Window {
        translation,
        rotation,
    });
    for sharing in [NoiseSharing::None, NoiseSharing::Shared] {
        let config = ProbePlan {
            sharing,
            ..config(3)
        };
        let refused = trace(
            &mut engine(),
            &process,
            &config,
            &windows,
            0..1,
            Branches::Both,
        );
        let error = refused.unwrap_err().to_string();
        assert!(error.contains("expected 96 numbers, found 72"), "{error}");
    }
}

#[test]
fn the_name_in_files() {
    let stored = |sharing| serde_json::to_string(&sharing).unwrap();
    assert_eq!(stored(NoiseSharing::None), "\"none\"");
    assert_eq!(stored(NoiseSharing::Own), "\"own\"");
    assert_eq!(stored(NoiseSharing::Shared), "\"shared\"");
}
