//! The burn network against the golden values from PyTorch.

#[allow(dead_code)]
#[path = "../golden/golden.rs"]
mod golden;

use dose3_model::NoiseModel;
use dose3_model::burn_unet::{Backend, BurnModel};
use golden::{Golden, relative_error};

const TOLERANCE: f32 = 1e-4;

#[test]
fn the_output_is_that_of_pytorch() {
    let golden = Golden::load();
    let mut model = BurnModel::new(&golden.parameters(), Backend::Flex).unwrap();
    let mut output = vec![0.0; golden.output.len()];
    model.forward(golden.input(), &mut output).unwrap();
    let error = relative_error(&output, &golden.output);
    assert!(error < TOLERANCE, "{error}");
}

#[test]
fn every_gradient_is_that_of_pytorch() {
    let golden = Golden::load();
    let parameters = golden.parameters();
    let mut model = BurnModel::new(&parameters, Backend::Flex).unwrap();
    let mut gradient = vec![0.0; golden.gradient.len()];
    model
        .forward_backward(golden.input(), &golden.loss(), &mut gradient)
        .unwrap();
    for spec in parameters.layout().entries() {
        let error = relative_error(&gradient[spec.range()], &golden.gradient[spec.range()]);
        assert!(error < TOLERANCE, "{}: {error}", spec.name);
    }
}
