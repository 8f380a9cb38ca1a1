//! The joint network's engine against its definition on burn.

use dose3_engine::{EngineOptions, JointEngine};
use dose3_model::burn_unet::{Backend, BurnJoint};
use dose3_model::joint::{CONDITIONS, JOINT_AXES};
use dose3_model::joint::{JointConfig, JointInput, JointNoiseModel, JointParameters};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn worst(found: &[f32], expected: &[f32], floor: f32) -> f32 {
    let scale = expected.iter().fold(floor, |m, x| m.max(x.abs()));
    let apart = found
        .iter()
        .zip(expected)
        .map(|(a, b)| (a - b).abs() / scale);
    // Not `max`, which would drop a NaN.
    apart.fold(0.0, |worst, x| if x <= worst { worst } else { x })
}

fn compare(config: &JointConfig, batch: usize, length: usize) {
    let what = format!("width {} batch {batch} length {length}", config.width);
    let parameters = JointParameters::init(config, length as u64).unwrap();
    let mut engine = JointEngine::new(&parameters, EngineOptions::default()).unwrap();
    let mut burn = BurnJoint::new(&parameters, Backend::Flex).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut draw = |n: usize| -> Vec<f32> { (0..n).map(|_| rng.random_range(-1.5..1.5)).collect() };
    let values = batch * length * JOINT_AXES;
    let (x, conditions, upstream) = (draw(values), draw(batch * CONDITIONS), draw(values));
    let input = JointInput {
        x: &x,
        conditions: &conditions,
        batch,
        length,
    };
    let (mut found, mut expected) = (vec![0.0; values], vec![0.0; values]);
    engine.forward(input, &mut found).unwrap();
    burn.forward(input, &mut expected).unwrap();
    let error = worst(&found, &expected, 0.0);
    assert!(error < 1e-5, "{what}: output {error:e}");

    let size = length * JOINT_AXES;
    let loss = |first: usize, output: &[f32], to: &mut [f32]| {
        to.copy_from_slice(&upstream[first * size..][..output.len()]);
    };
    let count = config.layout().len();
    let (mut found, mut expected) = (vec![0.0; count], vec![0.0; count]);
    engine.forward_backward(input, &loss, &mut found).unwrap();
    burn.forward_backward(input, &loss, &mut expected).unwrap();
    let largest = expected.iter().fold(0_f32, |m, x| m.max(x.abs()));
    for spec in config.layout().entries() {
        let own = spec.range();
        let error = worst(&found[own.clone()], &expected[own], 1e-3 * largest);
        assert!(error < 1e-4, "{what}: gradient of {}: {error:e}", spec.name);
    }
}

#[test]
fn engine_and_burn_agree() {
    compare(&JointConfig::new(8, &[1]), 1, 1);
    compare(&JointConfig::new(12, &[1, 3, 2]), 3, 21);
    compare(&JointConfig::new(48, &[1, 2, 4, 8, 1, 2, 4, 8]), 9, 128);
    // A halo longer than the sequence.
    compare(&JointConfig::new(16, &[16, 1]), 2, 7);
}
