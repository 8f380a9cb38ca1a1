//! burn's two CPU backends against each other, and backends that are not there.
#![cfg(feature = "flex")]

mod common;
#[allow(dead_code)]
#[path = "../golden/golden.rs"]
mod golden;

use burn::tensor::Device;
use common::{Batch, numbers, parameters, small};
use dose3_model::burn_unet::{Backend, BurnModel};
use dose3_model::{ModelError, NoiseModel};
use golden::relative_error;

const TOLERANCE: f32 = 1e-4;

#[test]
fn flex_and_ndarray_agree() {
    let config = small();
    let parameters = parameters(&config);
    let batch = Batch::new(&config, 2, 64);
    let loss = |_: usize, output: &[f32], gradient: &mut [f32]| {
        gradient.copy_from_slice(&numbers(output.len(), 9));
    };
    let run = |device| {
        let mut model = BurnModel::on(&parameters, device).unwrap();
        let mut output = vec![0.0; 2 * 64 * 3];
        let mut gradient = vec![0.0; config.parameter_count()];
        model.forward(batch.input(), &mut output).unwrap();
        model
            .forward_backward(batch.input(), &loss, &mut gradient)
            .unwrap();
        (output, gradient)
    };
    let (output, gradient) = run(Device::flex());
    #[allow(deprecated)] // deprecated upstream, kept as a cross-check
    let (other_output, other_gradient) = run(Device::ndarray());

    let error = relative_error(&output, &other_output);
    assert!(error < TOLERANCE, "output: {error}");
    for spec in config.layout().entries() {
        let error = relative_error(&gradient[spec.range()], &other_gradient[spec.range()]);
        assert!(error < TOLERANCE, "{}: {error}", spec.name);
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let config = small();
    let batch = Batch::new(&config, 3, 64);
    let run = || {
        let mut model = BurnModel::new(&parameters(&config), Backend::Flex).unwrap();
        let mut output = vec![0.0; 3 * 64 * 3];
        model.forward(batch.input(), &mut output).unwrap();
        output
    };
    assert_eq!(run(), run());
}

#[test]
fn a_backend_that_is_not_compiled_in_says_which_feature_it_needs() {
    let parameters = parameters(&small());
    for backend in Backend::ALL
        .into_iter()
        .filter(|backend| !backend.is_compiled())
    {
        let error = BurnModel::new(&parameters, backend).unwrap_err();
        assert!(matches!(error, ModelError::Backend { .. }), "{error}");
        let expected = format!("build with the feature `{backend}`");
        assert!(error.to_string().contains(&expected), "{error}");
    }
}

#[test]
fn backends_have_names() {
    for backend in Backend::ALL {
        assert_eq!(backend.name().parse::<Backend>().unwrap(), backend);
        assert_eq!(
            format!("burn-{backend}").parse::<Backend>().unwrap(),
            backend
        );
    }
    let error = "tpu".parse::<Backend>().unwrap_err().to_string();
    assert!(error.contains("tpu") && error.contains("flex"), "{error}");
}
