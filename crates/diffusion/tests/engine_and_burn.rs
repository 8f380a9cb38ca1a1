//! The engine against the network's definition on burn.

use dose3_engine::{Adam, AdamConfig, Engine};
use dose3_model::burn_unet::{Backend, BurnModel};
use dose3_model::{Input, NoiseModel, Parameters, UNetConfig};

#[path = "../../engine/tests/support/mod.rs"]
mod support;

use support::{Batch, engine, error_above, parameters, relative_error};

fn both(parameters: &Parameters) -> (Engine, BurnModel) {
    let burn = BurnModel::new(parameters, Backend::Flex).expect("flex");
    (engine(parameters), burn)
}

fn compare(config: &UNetConfig, batch: usize, length: usize) {
    let parameters = parameters(config, (batch + length) as u64);
    let (mut engine, mut burn) = both(&parameters);
    let batch = Batch::new(config, batch, length, 2);
    let what = format!(
        "width {} batch {} length {length}",
        config.width, batch.batch
    );

    let output = relative_error(&batch.output(&mut engine), &batch.output(&mut burn));
    assert!(output < 1e-5, "{what}: output {output:e}");

    let (found, expected) = (batch.gradient(&mut engine), batch.gradient(&mut burn));
    let largest = expected
        .iter()
        .fold(0f32, |max, value| max.max(value.abs()));
    for spec in config.layout().entries() {
        // Some gradients are zero but for rounding, such as that of a bias before a
        // normalisation of single channels: no tensor is measured in less than this.
        let floor = 1e-3 * largest;
        let error = error_above(&found[spec.range()], &expected[spec.range()], floor);
        assert!(error < 1e-4, "{what}: gradient of {}: {error:e}", spec.name);
    }
}

#[test]
fn narrow() {
    for (batch, length) in [(1, 64), (3, 128), (17, 64), (2, 512)] {
        compare(&UNetConfig::new(3, 3, 8, &[1, 2]), batch, length);
    }
}

#[test]
fn release_width() {
    for (batch, length) in [(1, 128), (5, 256), (33, 64)] {
        compare(&UNetConfig::new(9, 3, 16, &[1, 2, 4]), batch, length);
    }
}

#[test]
fn wide_and_deep() {
    for (batch, length) in [(1, 64), (9, 128)] {
        compare(&UNetConfig::new(9, 3, 32, &[1, 2, 4, 8]), batch, length);
    }
}

#[test]
fn one_level_and_odd_sizes() {
    let config = UNetConfig {
        heads: 3,
        head_dim: 10,
        groups: 4,
        ..UNetConfig::new(3, 3, 20, &[3])
    };
    compare(&config, 4, 67);
}

/// Fifty steps of Adam on one batch, from the same start.
#[test]
fn a_short_training_run_ends_at_the_same_loss_and_output() {
    let config = UNetConfig::new(3, 3, 16, &[1, 2]);
    let start = Parameters::init(&config, 4).expect("valid");
    let batch = Batch::new(&config, 8, 64, 5);
    let (mut engine, mut burn) = both(&start);
    let (ours, our_loss) = train(&mut engine, &start.values, &batch);
    let (theirs, their_loss) = train(&mut burn, &start.values, &batch);
    assert!(
        our_loss < 0.8 * mean_square(&batch.upstream),
        "it learns: {our_loss}"
    );
    // Rounding grows along the way, so parameters are compared through what they do.
    assert!(
        (our_loss / their_loss - 1.0).abs() < 1e-3,
        "{our_loss} and {their_loss}"
    );
    engine.set_parameters(&ours).expect("finite");
    burn.set_parameters(&theirs).expect("finite");
    let error = relative_error(&batch.output(&mut engine), &batch.output(&mut burn));
    assert!(error < 1e-2, "{error:e}");
}

fn mean_square(values: &[f32]) -> f64 {
    values.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / values.len() as f64
}

/// Learns to put out `batch.upstream`; answers the parameters and the last loss.
fn train(model: &mut dyn NoiseModel, start: &[f32], batch: &Batch) -> (Vec<f32>, f64) {
    let mut values = start.to_vec();
    let mut gradient = vec![0.0; values.len()];
    let mut adam = Adam::new(&values, AdamConfig::default());
    let Batch {
        length, upstream, ..
    } = batch;
    let scale = 2.0 / upstream.len() as f32;
    let input: Input<'_> = batch.input();
    for _ in 0..50 {
        let loss = |first: usize, output: &[f32], gradient: &mut [f32]| {
            let target = &upstream[first * length * 3..][..output.len()];
            for ((g, o), t) in gradient.iter_mut().zip(output).zip(target) {
                *g = scale * (o - t);
            }
        };
        model
            .forward_backward(input, &loss, &mut gradient)
            .expect("backward");
        adam.step(&mut values, &gradient, 3e-3, 0.9);
        model.set_parameters(&values).expect("finite");
    }
    let output = batch.output(model);
    let rest: Vec<f32> = output.iter().zip(upstream).map(|(o, t)| o - t).collect();
    (values, mean_square(&rest))
}
