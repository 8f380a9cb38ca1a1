//! Loads `golden.json`; included by path from the tests of every implementation of the network.

use dose3_model::{Init, Input, Parameters, UNetConfig};
use serde_json::Value;

/// The file as README.md describes it.
pub struct Golden {
    pub config: UNetConfig,
    pub batch: usize,
    pub length: usize,
    pub layout: Vec<(String, Vec<usize>)>,
    pub parameter_seed: u64,
    pub parameter_sum: f64,
    pub steps: Vec<f32>,
    pub input: Vec<f32>,
    pub upstream: Vec<f32>,
    pub output: Vec<f32>,
    pub gradient: Vec<f32>,
}

impl Golden {
    pub fn load() -> Self {
        let file: Value = serde_json::from_str(include_str!("golden.json")).expect("JSON");
        Self {
            config: serde_json::from_value(file["config"].clone()).expect("config"),
            batch: serde_json::from_value(file["batch"].clone()).expect("batch"),
            length: serde_json::from_value(file["length"].clone()).expect("length"),
            layout: serde_json::from_value(file["layout"].clone()).expect("layout"),
            parameter_seed: file["seeds"]["parameters"].as_u64().expect("seed"),
            parameter_sum: file["parameter_sum"].as_f64().expect("sum"),
            steps: numbers(&file, "steps"),
            input: numbers(&file, "input"),
            upstream: numbers(&file, "upstream"),
            output: numbers(&file, "output"),
            gradient: numbers(&file, "gradient"),
        }
    }

    pub fn input(&self) -> Input<'_> {
        Input {
            x: &self.input,
            steps: &self.steps,
            batch: self.batch,
            length: self.length,
        }
    }

    /// The parameters by the formula in README.md.
    pub fn parameters(&self) -> Parameters {
        let layout = self.config.layout();
        let mut values = Vec::with_capacity(layout.len());
        for spec in layout.entries() {
            // The bias of a layer starts like its weight: find the fan-in there.
            let owner = spec.name.rsplit_once('.').expect("dotted name").0;
            let weight = layout
                .find(&format!("{owner}.weight"))
                .expect("every layer has a weight");
            let fan_in: usize = weight.shape[1..].iter().product();
            for i in spec.range() {
                let u = signed(self.parameter_seed, i as u64);
                values.push(match spec.init {
                    Init::Uniform { .. } => u / (fan_in as f64).sqrt(),
                    Init::Ones => 1.0 + 0.2 * u,
                    Init::Zeros => 0.2 * u,
                } as f32);
            }
        }
        Parameters::new(self.config.clone(), values).expect("the golden parameters are valid")
    }

    /// The loss gradient callback of `sum(output * upstream)`.
    pub fn loss(&self) -> impl Fn(usize, &[f32], &mut [f32]) + Sync + '_ {
        let sample = self.length * self.config.out_channels;
        move |first, output, gradient| {
            let start = first * sample;
            gradient.copy_from_slice(&self.upstream[start..start + output.len()]);
        }
    }
}

fn numbers(file: &Value, key: &str) -> Vec<f32> {
    serde_json::from_value(file[key].clone()).expect("an array of numbers")
}

fn signed(seed: u64, index: u64) -> f64 {
    let mut z = ((seed << 32) + index + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^= z >> 31;
    (z >> 40) as f64 / f64::from(1 << 23) - 1.0
}

/// The largest difference, relative to the largest expected magnitude of the tensor.
pub fn relative_error(found: &[f32], expected: &[f32]) -> f32 {
    assert_eq!(found.len(), expected.len());
    let scale = expected
        .iter()
        .fold(0f32, |max, value| max.max(value.abs()));
    let pairs = found.iter().zip(expected);
    // Not `max`, which would drop a NaN.
    pairs.fold(0f32, |worst, (a, b)| {
        let error = (a - b).abs() / scale.max(f32::MIN_POSITIVE);
        if error <= worst { worst } else { error }
    })
}
