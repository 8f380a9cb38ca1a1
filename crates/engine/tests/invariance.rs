//! What may not change a result: threads, the rest of the batch, what was computed before.

use dose3_engine::{Engine, EngineOptions};
use dose3_model::{Input, ModelError, NoiseModel, UNetConfig};

mod support;

use support::{Batch, engine, every_instruction_set, parameters, pool, relative_error};

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let config = UNetConfig::new(3, 3, 16, &[1, 2]);
    let parameters = parameters(&config, 3);
    for batch in [1, 5, 32, 67] {
        let batch = Batch::new(&config, batch, 48, 4);
        let (output, gradient) = pool(1).install(|| {
            let mut one = engine(&parameters);
            (batch.output(&mut one), batch.gradient(&mut one))
        });
        assert!(
            output
                .iter()
                .chain(&gradient)
                .all(|value| value.is_finite())
        );
        let mut many = engine(&parameters);
        for threads in [2, 3, 8, 1] {
            // Twice: what the first call leaves behind must not show in the second.
            for _ in 0..2 {
                let (found, slope) =
                    pool(threads).install(|| (batch.output(&mut many), batch.gradient(&mut many)));
                assert_eq!(bits(&found), bits(&output), "{threads} threads");
                assert_eq!(bits(&slope), bits(&gradient), "{threads} threads");
            }
        }
        let options = EngineOptions {
            threads: 2,
            ..EngineOptions::default()
        };
        let mut two = Engine::new(&parameters, options).expect("an engine");
        let slope = pool(4).install(|| batch.gradient(&mut two));
        assert_eq!(bits(&slope), bits(&gradient), "2 of 4 threads");
    }
}

#[test]
fn a_windows_output_does_not_depend_on_its_batch() {
    let config = UNetConfig::new(9, 3, 8, &[1, 2, 4]);
    let mut engine = engine(&parameters(&config, 5));
    let batch = Batch::new(&config, 37, 64, 6);
    let together = batch.output(&mut engine);
    let (inputs, outputs) = (64 * 9, 64 * 3);
    for i in 0..batch.batch {
        let mut alone = vec![0.0; outputs];
        let x = &batch.x[i * inputs..(i + 1) * inputs];
        let input = Input {
            x,
            steps: &batch.steps[i..=i],
            batch: 1,
            length: 64,
        };
        engine.forward(input, &mut alone).expect("forward");
        assert_eq!(
            bits(&alone),
            bits(&together[i * outputs..(i + 1) * outputs]),
            "window {i}"
        );
    }
}

#[test]
fn other_lengths_and_parameters_in_between_leave_no_trace() {
    let config = UNetConfig::new(3, 3, 8, &[1, 2]);
    let parameters = parameters(&config, 7);
    let mut engine = engine(&parameters);
    let short = Batch::new(&config, 9, 32, 8);
    let expected = (short.output(&mut engine), short.gradient(&mut engine));
    let long = Batch::new(&config, 20, 256, 9);
    long.output(&mut engine);
    long.gradient(&mut engine);
    let other: Vec<f32> = parameters.values.iter().map(|value| value * 1.1).collect();
    engine.set_parameters(&other).expect("finite");
    assert_ne!(short.output(&mut engine), expected.0);
    engine.set_parameters(&parameters.values).expect("finite");
    assert_eq!(bits(&short.output(&mut engine)), bits(&expected.0));
    assert_eq!(bits(&short.gradient(&mut engine)), bits(&expected.1));
}

#[test]
fn instruction_sets_agree_on_sizes_that_fill_no_vector() {
    let config = UNetConfig {
        heads: 3,
        head_dim: 5,
        groups: 3,
        ..UNetConfig::new(3, 3, 18, &[1, 3])
    };
    let batch = Batch::new(&config, 5, 22, 10);
    let mut engines = every_instruction_set(&parameters(&config, 11));
    let (portable, wider) = engines.split_first_mut().expect("portable is everywhere");
    let (output, gradient) = (batch.output(portable), batch.gradient(portable));
    for engine in wider {
        let error = relative_error(&batch.output(engine), &output);
        assert!(error < 1e-5, "{:?}: {error:e}", engine.instructions());
        let found = batch.gradient(engine);
        for spec in config.layout().entries() {
            let error = relative_error(&found[spec.range()], &gradient[spec.range()]);
            assert!(
                error < 1e-4,
                "{:?}: {}: {error:e}",
                engine.instructions(),
                spec.name
            );
        }
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let config = UNetConfig::new(3, 3, 8, &[1, 2]);
    let parameters = parameters(&config, 14);
    let mut engine = engine(&parameters);
    let odd = Batch::new(&config, 2, 33, 15);
    let mut output = vec![0.0; odd.upstream.len()];
    let refused = engine.forward(odd.input(), &mut output);
    assert!(matches!(
        refused,
        Err(ModelError::Length {
            length: 33,
            multiple: 2,
            ..
        })
    ));
    let even = Batch::new(&config, 2, 32, 15);
    assert!(matches!(
        engine.forward(even.input(), &mut output[..7]),
        Err(ModelError::TensorSize { .. })
    ));
    assert!(matches!(
        engine.forward_backward(even.input(), &even.loss(), &mut [0.0; 3]),
        Err(ModelError::ParameterCount { .. })
    ));
    let mut values = parameters.values.clone();
    values[5] = f32::NAN;
    assert!(matches!(
        engine.set_parameters(&values),
        Err(ModelError::NotFinite { .. })
    ));
}
