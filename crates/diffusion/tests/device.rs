//! Training where the network lies, on burn's CPU backend: what the engine does, and resumable to the bit.

mod support;

use dose3_diffusion::trainer::{LearnerPair, LogRow, TrainConfig, Trainer};
use dose3_diffusion::{ModelPair, ProcessConfig, RotationProcess};
use dose3_model::burn_unet::{Backend, BurnModel};
use dose3_model::{NoiseModel, PairParameters, Parameters};
use std::path::Path;
use support::{Arcs, config, models, network};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// Network and optimiser in the engine.
    Engine,
    /// The network on burn; every step carries parameters and gradients.
    Carried,
    /// All on burn.
    Device,
}

fn learners(place: Place, config: &TrainConfig) -> LearnerPair {
    let initial = config.initial(&network()).unwrap();
    let burn = |p: &Parameters| -> Box<dyn NoiseModel> {
        Box::new(BurnModel::new(p, Backend::Flex).unwrap())
    };
    let models = match place {
        Place::Engine => models(),
        Place::Carried => ModelPair {
            translation: burn(&initial.translation),
            rotation: burn(&initial.rotation),
        },
        Place::Device => {
            return LearnerPair::on_device(Backend::Flex, &initial, config.clip).unwrap();
        }
    };
    LearnerPair::on_host(models, initial, config.clip)
}

struct Run {
    heard: Vec<LogRow>,
    log: Vec<LogRow>,
    averaged: PairParameters,
    checkpoints: Vec<Vec<u8>>,
}

fn run(place: Place, config: TrainConfig, process: RotationProcess, resume: Option<&[u8]>) -> Run {
    let process = ProcessConfig {
        steps: 10,
        rotation_process: process,
        ..ProcessConfig::default()
    };
    let (train, validation) = (Arcs(40), Arcs(7));
    let learners = learners(place, &config);
    let (network, data) = (network(), "arcs".to_owned());
    let mut trainer = Trainer::new(
        config,
        process,
        network,
        data,
        learners,
        &train,
        &validation,
    )
    .unwrap();
    if let Some(bytes) = resume {
        trainer.resume(Path::new("test.checkpoint"), bytes).unwrap();
    }
    let mut heard = Vec::new();
    let mut checkpoints = Vec::new();
    trainer
        .run(
            &mut |row| {
                heard.push(*row);
                Ok(())
            },
            &mut |t| {
                checkpoints.push(t.checkpoint()?);
                Ok(())
            },
        )
        .unwrap();
    Run {
        heard,
        log: trainer.log().to_vec(),
        averaged: trainer.averaged().unwrap(),
        checkpoints,
    }
}

fn close(what: &str, a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance * b.abs(), "{what}: {a} and {b}");
}

/// Root mean square of the difference, relative to how far the weights have come.
fn apart(a: &Parameters, b: &Parameters, start: &Parameters) -> f64 {
    let square = |a: &[f32], b: &[f32]| -> f64 {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum()
    };
    (square(&a.values, &b.values) / square(&b.values, &start.values)).sqrt()
}

/// Ten steps; f32 on either side, in another order. Adam divides every gradient by its own size, so that differences
/// in gradients that are nearly zero count as much as any.
#[test]
fn the_device_takes_the_steps_of_the_engine() {
    for process in [RotationProcess::Group, RotationProcess::Tangent] {
        let config = config(10);
        let device = run(Place::Device, config, process, None);
        let start = config.initial(&network()).unwrap();
        for place in [Place::Engine, Place::Carried] {
            let host = run(place, config, process, None);
            let what = format!("{place:?} {process:?}");
            assert_eq!(device.log.len(), host.log.len());
            for (a, b) in device.log.iter().zip(&host.log) {
                assert_eq!(
                    (a.step, a.learning_rate.to_bits()),
                    (b.step, b.learning_rate.to_bits())
                );
                for (name, a, b) in [
                    ("translation eps", a.translation_eps, b.translation_eps),
                    ("translation x0", a.translation_x0, b.translation_x0),
                    ("rotation eps", a.rotation_eps, b.rotation_eps),
                    ("rotation x0", a.rotation_x0, b.rotation_x0),
                    (
                        "translation norm",
                        a.translation_gradient,
                        b.translation_gradient,
                    ),
                    ("rotation norm", a.rotation_gradient, b.rotation_gradient),
                ] {
                    close(&format!("{what}: {name}"), a, b, 1e-4);
                }
            }
            let validation = |row: &LogRow| row.rotation_validation.unwrap();
            let (a, b) = (device.log.last().unwrap(), host.log.last().unwrap());
            close(&what, validation(a), validation(b), 1e-4);
            for (a, b, start) in [
                (
                    &device.averaged.translation,
                    &host.averaged.translation,
                    &start.translation,
                ),
                (
                    &device.averaged.rotation,
                    &host.averaged.rotation,
                    &start.rotation,
                ),
            ] {
                let apart = apart(a, b, start);
                assert!(apart < 1e-2, "{what}: weights {apart}");
            }
        }
    }
}

#[test]
fn a_run_that_goes_on_ends_in_the_same_bytes() {
    let config = config(20);
    let whole = run(Place::Device, config, RotationProcess::Group, None);
    // Of step 10.
    let first = &whole.checkpoints[0];
    let resumed = run(Place::Device, config, RotationProcess::Group, Some(first));
    assert_eq!(resumed.log, whole.log);
    assert_eq!(resumed.averaged, whole.averaged);
    assert_eq!(resumed.checkpoints[..], whole.checkpoints[1..]);

    // The file is the host's too.
    let elsewhere = run(Place::Engine, config, RotationProcess::Group, Some(first));
    let (a, b) = (elsewhere.log.last().unwrap(), whole.log.last().unwrap());
    close("engine", a.translation_eps, b.translation_eps, 1e-3);
}

/// Between rows of the log, what was read last is heard.
#[test]
fn losses_come_down_with_the_rows_of_the_log() {
    let device = run(Place::Device, config(10), RotationProcess::Group, None);
    let host = run(Place::Engine, config(10), RotationProcess::Group, None);
    let steps: Vec<usize> = device.heard.iter().map(|row| row.step).collect();
    assert_eq!(steps, (1..=10).collect::<Vec<_>>());
    let losses = |run: &Run| -> Vec<f64> { run.heard.iter().map(|row| row.rotation_eps).collect() };
    let (device_losses, host_losses) = (losses(&device), losses(&host));
    close("the first", device_losses[0], host_losses[0], 1e-5);
    for (i, loss) in device_losses.iter().enumerate().take(9).skip(1) {
        assert_eq!(*loss, device_losses[if i < 4 { 0 } else { 4 }]);
    }
    let mean = host_losses[1..5].iter().sum::<f64>() / 4.0;
    close("the next four", device_losses[4], mean, 1e-4);
    assert!(host_losses.windows(2).all(|pair| pair[0] != pair[1]));
}
