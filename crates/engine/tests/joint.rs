//! The joint network's engine: gradients against differences, and what must not change a result.

use dose3_engine::{EngineOptions, Instructions, JointEngine};
use dose3_model::joint::{CONDITIONS, JOINT_AXES};
use dose3_model::joint::{JointConfig, JointInput, JointNoiseModel, JointParameters};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

struct Batch {
    x: Vec<f32>,
    conditions: Vec<f32>,
    upstream: Vec<f32>,
    batch: usize,
    length: usize,
}

impl Batch {
    fn new(batch: usize, length: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = |n: usize| (0..n).map(|_| rng.random_range(-1.5..1.5)).collect();
        let values = batch * length * JOINT_AXES;
        Self {
            x: draw(values),
            conditions: draw(batch * CONDITIONS),
            upstream: draw(values),
            batch,
            length,
        }
    }

    fn input(&self) -> JointInput<'_> {
        JointInput {
            x: &self.x,
            conditions: &self.conditions,
            batch: self.batch,
            length: self.length,
        }
    }

    fn output(&self, model: &mut dyn JointNoiseModel) -> Vec<f32> {
        let mut output = vec![f32::NAN; self.x.len()];
        model.forward(self.input(), &mut output).unwrap();
        output
    }

    /// Of `sum(output * upstream)`.
    fn gradient(&self, model: &mut dyn JointNoiseModel) -> Vec<f32> {
        let mut gradient = vec![f32::NAN; model.config().layout().len()];
        let size = self.length * JOINT_AXES;
        let loss = |first: usize, output: &[f32], to: &mut [f32]| {
            to.copy_from_slice(&self.upstream[first * size..][..output.len()]);
        };
        model
            .forward_backward(self.input(), &loss, &mut gradient)
            .unwrap();
        gradient
    }

    fn loss(&self, model: &mut dyn JointNoiseModel) -> f64 {
        let output = self.output(model);
        let terms = output.iter().zip(&self.upstream);
        terms.map(|(o, u)| f64::from(*o) * f64::from(*u)).sum()
    }
}

fn engine(parameters: &JointParameters, options: EngineOptions) -> JointEngine {
    JointEngine::new(parameters, options).unwrap()
}

/// Moves one parameter tensor at a time along its own gradient: the loss must grow by the gradient's squared length.
#[test]
fn every_tensors_gradient_predicts_the_loss() {
    let config = JointConfig::new(12, &[1, 3, 2]);
    let parameters = JointParameters::init(&config, 1).unwrap();
    let mut engine = engine(&parameters, EngineOptions::default());
    let batch = Batch::new(3, 21, 2);
    let gradient = batch.gradient(&mut engine);
    for spec in config.layout().entries() {
        let own = &gradient[spec.range()];
        let square: f64 = own.iter().map(|g| f64::from(*g).powi(2)).sum();
        let step = 1e-2 / square.sqrt();
        let mut moved = |sign: f64| {
            let mut values = parameters.values.clone();
            for (value, g) in values[spec.range()].iter_mut().zip(own) {
                *value += (sign * step * f64::from(*g)) as f32;
            }
            engine.set_parameters(&values).unwrap();
            batch.loss(&mut engine)
        };
        let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
        let error = difference / square - 1.0;
        assert!(
            error.abs() < 0.01,
            "{}: {difference} for {square}",
            spec.name
        );
    }
}

#[test]
fn a_sequence_depends_on_itself_alone() {
    let config = JointConfig::new(20, &[1, 4, 2]);
    let parameters = JointParameters::init(&config, 4).unwrap();
    let mut engine = engine(&parameters, EngineOptions::default());
    let many = Batch::new(5, 40, 3);
    let all = many.output(&mut engine);
    // Another length in between leaves nothing behind.
    Batch::new(2, 77, 9).output(&mut engine);
    let size = many.length * JOINT_AXES;
    for i in 0..many.batch {
        let one = Batch {
            x: many.x[i * size..][..size].to_vec(),
            conditions: many.conditions[i * CONDITIONS..][..CONDITIONS].to_vec(),
            upstream: Vec::new(),
            batch: 1,
            length: many.length,
        };
        assert_eq!(one.output(&mut engine), all[i * size..][..size]);
    }
}

#[test]
fn a_step_sees_as_far_as_it_says() {
    let config = JointConfig::new(16, &[1, 2, 4]);
    let parameters = JointParameters::init(&config, 5).unwrap();
    let mut engine = engine(&parameters, EngineOptions::default());
    let mut batch = Batch::new(1, 64, 6);
    let before = batch.output(&mut engine);
    batch.x[32 * JOINT_AXES] += 1.0;
    let after = batch.output(&mut engine);
    let changed: Vec<usize> = (0..64)
        .filter(|t| before[t * JOINT_AXES..][..JOINT_AXES] != after[t * JOINT_AXES..][..JOINT_AXES])
        .collect();
    let reach = config.reach();
    assert_eq!(changed.first(), Some(&(32 - reach)));
    assert_eq!(changed.last(), Some(&(32 + reach)));
}

#[test]
fn threads_change_nothing_and_instructions_little() {
    let config = JointConfig::new(48, &[1, 2, 4, 8]);
    let parameters = JointParameters::init(&config, 7).unwrap();
    let batch = Batch::new(11, 50, 8);
    let run = |threads: usize, instructions: Option<Instructions>| {
        let options = EngineOptions {
            threads,
            instructions,
        };
        let mut engine = engine(&parameters, options);
        let output = batch.output(&mut engine);
        (output, batch.gradient(&mut engine))
    };
    let one = run(1, None);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build();
    assert_eq!(pool.unwrap().install(|| run(0, None)), one);
    let sets = Instructions::ALL.into_iter();
    for set in sets.filter(|set| set.available()) {
        let other = run(1, Some(set));
        for (a, b) in [(&one.0, &other.0), (&one.1, &other.1)] {
            let scale = a.iter().fold(0_f32, |m, x| m.max(x.abs()));
            let worst = a.iter().zip(b).map(|(x, y)| (x - y).abs());
            let worst = worst.fold(0.0, f32::max) / scale;
            assert!(worst < 2e-5, "{set:?}: {worst:e}");
        }
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let config = JointConfig::new(8, &[1]);
    let parameters = JointParameters::init(&config, 0).unwrap();
    let mut engine = engine(&parameters, EngineOptions::default());
    let mut batch = Batch::new(2, 5, 1);
    let mut output = vec![0.0; 2 * 5 * JOINT_AXES];
    assert!(engine.forward(batch.input(), &mut output[1..]).is_err());
    batch.length = 6;
    assert!(engine.forward(batch.input(), &mut output).is_err());
    batch.length = 5;
    batch.x[3] = f32::NAN;
    assert!(engine.forward(batch.input(), &mut output).is_err());
    assert!(engine.set_parameters(&[0.0; 3]).is_err());
}
