//! Against the values that an independent implementation in PyTorch computed.

use dose3_engine::{Engine, EngineOptions, Instructions};
use dose3_model::NoiseModel;

#[path = "../../model/golden/golden.rs"]
mod golden;

use golden::{Golden, relative_error};

fn engines(golden: &Golden) -> Vec<Engine> {
    use Instructions::{Avx2, Avx512, Neon, Portable};
    let sets = [Portable, Avx2, Avx512, Neon]
        .into_iter()
        .filter(|set| set.available());
    sets.map(|set| {
        let options = EngineOptions {
            threads: 1,
            instructions: Some(set),
        };
        Engine::new(&golden.parameters(), options).expect("the golden network")
    })
    .collect()
}

#[test]
fn forward_is_pytorchs() {
    let golden = Golden::load();
    for mut engine in engines(&golden) {
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
    for mut engine in engines(&golden) {
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
