//! The joint network's engine against the values that an independent implementation in NumPy computed.

use dose3_engine::{EngineOptions, Instructions, JointEngine};
use dose3_model::burn_unet::{Backend, BurnJoint};

#[path = "../../model/golden/joint.rs"]
mod golden;

#[test]
fn every_instruction_set_computes_what_numpy_does() {
    let golden = golden::Golden::load();
    let sets = Instructions::ALL.into_iter().filter(|set| set.available());
    for set in sets {
        let options = EngineOptions {
            threads: 1,
            instructions: Some(set),
        };
        let mut engine = JointEngine::new(&golden.parameters, options).unwrap();
        golden.hold(&format!("{set:?}"), &mut engine);
    }
}

/// The definition of the network too.
#[test]
fn burn_computes_what_numpy_does() {
    let golden = golden::Golden::load();
    let mut model = BurnJoint::new(&golden.parameters, Backend::Flex).unwrap();
    golden.hold("burn", &mut model);
}
