//! What the burn network must do whatever its weights are.
#![cfg(feature = "flex")]

mod common;

use common::{Batch, numbers, parameters, small};
use dose3_model::burn_unet::{Backend, BurnModel};
use dose3_model::{Input, ModelError, NoiseModel, UNetConfig};

fn model(config: &UNetConfig) -> BurnModel {
    BurnModel::new(&parameters(config), Backend::Flex).unwrap()
}

#[test]
fn every_length_from_64_to_512_keeps_its_shape() {
    let four = UNetConfig {
        heads: 1,
        head_dim: 4,
        ..UNetConfig::new(3, 3, 8, &[1, 2, 4, 8])
    };
    for config in [small(), four, UNetConfig::new(9, 3, 8, &[2])] {
        let mut model = model(&config);
        for length in [64, 128, 256, 512] {
            let batch = Batch::new(&config, 2, length);
            let mut output = vec![f32::NAN; 2 * length * config.out_channels];
            model.forward(batch.input(), &mut output).unwrap();
            assert!(
                output.iter().all(|value| value.is_finite()),
                "length {length}"
            );
            let spread = output.iter().fold(0f32, |max, value| max.max(value.abs()));
            assert!(
                spread > 1e-3,
                "length {length}: the output is {spread} at most"
            );
        }
    }
}

#[test]
fn windows_of_a_batch_do_not_see_each_other() {
    let config = small();
    let mut model = model(&config);
    let batch = Batch::new(&config, 3, 64);
    let sample = 64 * config.out_channels;
    let mut together = vec![0.0; 3 * sample];
    model.forward(batch.input(), &mut together).unwrap();
    for (i, expected) in together.chunks_exact(sample).enumerate() {
        let inputs = 64 * config.in_channels;
        let x = &batch.x[i * inputs..][..inputs];
        let input = Input {
            x,
            steps: &batch.steps[i..=i],
            batch: 1,
            length: 64,
        };
        let mut alone = vec![0.0; sample];
        model.forward(input, &mut alone).unwrap();
        for (a, b) in alone.iter().zip(expected) {
            assert!(
                (a - b).abs() < 1e-5,
                "window {i}: {a} alone, {b} in the batch"
            );
        }
    }
}

#[test]
fn the_step_matters() {
    let config = small();
    let mut model = model(&config);
    let mut batch = Batch::new(&config, 1, 64);
    let mut outputs = [vec![0.0; 64 * 3], vec![0.0; 64 * 3]];
    for (step, output) in [1.0, 29.0].into_iter().zip(&mut outputs) {
        batch.steps = vec![step];
        model.forward(batch.input(), output).unwrap();
    }
    let difference: f32 = outputs[0]
        .iter()
        .zip(&outputs[1])
        .map(|(a, b)| (a - b).abs())
        .sum();
    assert!(difference > 1e-2, "{difference}");
}

#[test]
fn gradients_reach_every_parameter() {
    let config = small();
    let mut model = model(&config);
    let batch = Batch::new(&config, 2, 64);
    let mut gradient = vec![f32::NAN; config.parameter_count()];
    let loss = |_: usize, output: &[f32], gradient: &mut [f32]| {
        gradient.copy_from_slice(&numbers(output.len(), 9));
    };
    model
        .forward_backward(batch.input(), &loss, &mut gradient)
        .unwrap();
    for spec in config.layout().entries() {
        let values = &gradient[spec.range()];
        assert!(
            values.iter().all(|value| value.is_finite()),
            "{}",
            spec.name
        );
        let largest = values.iter().fold(0f32, |max, value| max.max(value.abs()));
        assert!(largest > 1e-5, "{}: at most {largest}", spec.name);
    }
}

#[test]
fn one_batch_is_overfitted() {
    let config = UNetConfig {
        heads: 1,
        head_dim: 8,
        ..UNetConfig::new(3, 3, 16, &[1, 2])
    };
    let mut parameters = parameters(&config).values;
    let mut model = model(&config);
    let batch = Batch::new(&config, 2, 16);
    let target = numbers(2 * 16 * 3, 21);
    let total = std::sync::Mutex::new(0.0);
    let loss = |first: usize, output: &[f32], gradient: &mut [f32]| {
        let mut sum = 0.0;
        for (i, (out, slope)) in output.iter().zip(gradient).enumerate() {
            let error = out - target[first * 16 * 3 + i];
            sum += error * error / target.len() as f32;
            *slope = 2.0 * error / target.len() as f32;
        }
        *total.lock().unwrap() += sum;
    };

    // Adam (Kingma and Ba 2015) with its default constants.
    let (mut m, mut v) = (vec![0f32; parameters.len()], vec![0f32; parameters.len()]);
    let mut gradient = vec![0.0; parameters.len()];
    let mut history = Vec::new();
    for step in 1..=120 {
        *total.lock().unwrap() = 0.0;
        model
            .forward_backward(batch.input(), &loss, &mut gradient)
            .unwrap();
        history.push(*total.lock().unwrap());
        let (bias1, bias2) = (1.0 - 0.9f32.powi(step), 1.0 - 0.999f32.powi(step));
        for (i, g) in gradient.iter().enumerate() {
            m[i] += 0.1 * (g - m[i]);
            v[i] += 0.001 * (g * g - v[i]);
            parameters[i] -= 3e-3 * (m[i] / bias1) / ((v[i] / bias2).sqrt() + 1e-8);
        }
        model.set_parameters(&parameters).unwrap();
    }
    let (first, last) = (history[0], history[history.len() - 1]);
    assert!(last < first / 10.0, "the loss went from {first} to {last}");
}

#[test]
fn input_that_does_not_fit_is_refused() {
    let config = small();
    let mut model = model(&config);
    let batch = Batch::new(&config, 2, 64);
    let mut output = vec![0.0; 2 * 64 * 3];
    let good = batch.input();

    let odd = Batch::new(&config, 2, 63);
    let error = model.forward(odd.input(), &mut output).unwrap_err();
    assert!(
        matches!(
            error,
            ModelError::Length {
                length: 63,
                multiple: 2,
                ..
            }
        ),
        "{error}"
    );
    let empty = Input {
        batch: 0,
        x: &[],
        steps: &[],
        ..good
    };
    assert!(matches!(
        model.forward(empty, &mut []),
        Err(ModelError::EmptyBatch)
    ));
    let short = Input {
        x: &batch.x[1..],
        ..good
    };
    assert!(matches!(
        model.forward(short, &mut output),
        Err(ModelError::TensorSize { .. })
    ));
    let steps = Input {
        steps: &batch.steps[1..],
        ..good
    };
    assert!(matches!(
        model.forward(steps, &mut output),
        Err(ModelError::TensorSize { .. })
    ));
    assert!(matches!(
        model.forward(good, &mut output[1..]),
        Err(ModelError::TensorSize { .. })
    ));

    let mut x = batch.x.clone();
    x[70] = f32::NAN;
    let error = model
        .forward(Input { x: &x, ..good }, &mut output)
        .unwrap_err();
    assert!(
        matches!(error, ModelError::NotFinite { index: 70, .. }),
        "{error}"
    );

    let nothing = |_: usize, _: &[f32], _: &mut [f32]| {};
    let error = model
        .forward_backward(good, &nothing, &mut [0.0])
        .unwrap_err();
    assert!(
        matches!(error, ModelError::ParameterCount { found: 1, .. }),
        "{error}"
    );
    let error = model.set_parameters(&[0.0]).unwrap_err();
    assert!(
        matches!(error, ModelError::ParameterCount { found: 1, .. }),
        "{error}"
    );
    model.forward(good, &mut output).unwrap();
}
