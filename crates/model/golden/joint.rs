//! Loads `joint.json`, and holds an implementation of the joint network to it; included by path from tests.

use dose3_model::joint::{JOINT_AXES, JointInput, JointNoiseModel, JointParameters};
use serde_json::Value;

/// The file as README.md describes it.
pub struct Golden {
    pub parameters: JointParameters,
    file: Value,
}

impl Golden {
    pub fn load() -> Self {
        let file: Value = serde_json::from_str(include_str!("joint.json")).expect("JSON");
        let config = serde_json::from_value(file["config"].clone()).expect("config");
        let values = numbers(&file, "parameters");
        let parameters = JointParameters::new(config, values).expect("parameters");
        let layout: Vec<(String, Vec<usize>)> =
            serde_json::from_value(file["layout"].clone()).expect("layout");
        let own = parameters.layout();
        let own = own
            .entries()
            .iter()
            .map(|s| (s.name.clone(), s.shape.clone()));
        assert_eq!(layout, own.collect::<Vec<_>>());
        Self { parameters, file }
    }

    /// Output and gradients are those of NumPy.
    pub fn hold(&self, what: &str, model: &mut dyn JointNoiseModel) {
        let read = |key| numbers(&self.file, key);
        let size = |key: &str| self.file[key].as_u64().expect("a size") as usize;
        let (x, conditions, upstream) = (read("input"), read("conditions"), read("upstream"));
        let input = JointInput {
            x: &x,
            conditions: &conditions,
            batch: size("batch"),
            length: size("length"),
        };
        let mut output = vec![f32::NAN; x.len()];
        model.forward(input, &mut output).expect("forward");
        let error = relative_error(&output, &read("output"));
        assert!(error < 1e-5, "{what}: output {error:e}");

        let sequence = input.length * JOINT_AXES;
        let loss = |first: usize, output: &[f32], to: &mut [f32]| {
            to.copy_from_slice(&upstream[first * sequence..][..output.len()]);
        };
        let mut gradient = vec![f32::NAN; self.parameters.values.len()];
        let done = model.forward_backward(input, &loss, &mut gradient);
        done.expect("backward");
        let expected = read("gradient");
        for spec in self.parameters.layout().entries() {
            let error = relative_error(&gradient[spec.range()], &expected[spec.range()]);
            assert!(error < 1e-4, "{what}: {}: {error:e}", spec.name);
        }
    }
}

fn numbers(file: &Value, key: &str) -> Vec<f32> {
    serde_json::from_value(file[key].clone()).expect("an array of numbers")
}

/// The largest difference, relative to the largest expected magnitude of the tensor.
fn relative_error(found: &[f32], expected: &[f32]) -> f32 {
    assert_eq!(found.len(), expected.len());
    let scale = expected.iter().fold(0_f32, |m, x| m.max(x.abs()));
    let pairs = found.iter().zip(expected);
    // Not `max`, which would drop a NaN.
    pairs.fold(0_f32, |worst, (a, b)| {
        let error = (a - b).abs() / scale.max(f32::MIN_POSITIVE);
        if error <= worst { worst } else { error }
    })
}
