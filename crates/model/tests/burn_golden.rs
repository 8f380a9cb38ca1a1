//! The burn network against the golden values from PyTorch.
#![cfg(feature = "flex")]

#[allow(dead_code)]
#[path = "../golden/golden.rs"]
mod golden;
#[path = "../golden/joint.rs"]
mod joint;

use burn::tensor::Device;
use dose3_model::NoiseModel;
use dose3_model::burn_unet::{Backend, BurnJoint, BurnModel};
use golden::{Golden, relative_error};

const TOLERANCE: f32 = 1e-4;

#[allow(deprecated)] // ndarray is deprecated upstream, kept as a cross-check
fn models(golden: &Golden) -> [(&'static str, BurnModel); 2] {
    let devices = [("flex", Device::flex()), ("ndarray", Device::ndarray())];
    devices.map(|(name, device)| (name, BurnModel::on(&golden.parameters(), device).unwrap()))
}

#[test]
fn the_output_is_that_of_pytorch() {
    let golden = Golden::load();
    for (backend, mut model) in models(&golden) {
        let mut output = vec![0.0; golden.output.len()];
        model.forward(golden.input(), &mut output).unwrap();
        let error = relative_error(&output, &golden.output);
        assert!(error < TOLERANCE, "{backend}: {error}");
    }
}

#[test]
fn every_gradient_is_that_of_pytorch() {
    let golden = Golden::load();
    for (backend, mut model) in models(&golden) {
        let mut gradient = vec![0.0; golden.gradient.len()];
        model
            .forward_backward(golden.input(), &golden.loss(), &mut gradient)
            .unwrap();
        for spec in golden.config.layout().entries() {
            let error = relative_error(&gradient[spec.range()], &golden.gradient[spec.range()]);
            assert!(error < TOLERANCE, "{backend}: {}: {error}", spec.name);
        }
    }
}

/// The joint network, against NumPy.
#[test]
fn the_joint_network_computes_what_numpy_does() {
    let golden = joint::Golden::load();
    let mut model = BurnJoint::new(&golden.parameters, Backend::Flex).unwrap();
    golden.hold("burn", &mut model);
}
