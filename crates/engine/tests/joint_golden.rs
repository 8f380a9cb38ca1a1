//! The joint network's engine against the values that an independent implementation in NumPy computed.

use dose3_engine::{EngineOptions, Instructions, JointEngine};

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
