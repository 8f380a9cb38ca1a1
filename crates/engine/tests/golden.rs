//! Against the values that an independent implementation in PyTorch computed.

use dose3_model::NoiseModel;

#[allow(dead_code)] // the layout is checked where the layout is made
#[path = "../../model/golden/golden.rs"]
mod golden;
mod support;

use golden::{Golden, relative_error};

#[test]
fn forward_is_pytorchs() {
    let golden = Golden::load();
    for mut engine in support::every_instruction_set(&golden.parameters()) {
        let mut output = vec![0.0; golden.output.len()];
        engine
            .forward(golden.input(), &mut output)
            .expect("forward");
        let error = relative_error(&output, &golden.output);
        assert!(error < 1e-5, "{:?}: {error:e}", engine.instructions());
    }
}

#[test]
fn every_parameters_gradient_is_pytorchs() {
    let golden = Golden::load();
    for mut engine in support::every_instruction_set(&golden.parameters()) {
        let mut gradient = vec![f32::NAN; golden.gradient.len()];
        engine
            .forward_backward(golden.input(), &golden.loss(), &mut gradient)
            .expect("backward");
        for spec in golden.config.layout().entries() {
            let error = relative_error(&gradient[spec.range()], &golden.gradient[spec.range()]);
            assert!(
                error < 1e-4,
                "{:?}: {}: {error:e}",
                engine.instructions(),
                spec.name
            );
        }
    }
}
